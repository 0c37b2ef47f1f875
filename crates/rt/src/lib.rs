//! The path tracer on Vulkan ray tracing: a [`scene::Scene`] in, radiance out.
//!
//! [`devices`] lists what the machine has, [`Gpu`] opens a device, [`PathTracer`] renders. The
//! frame is `passes::record_frame`; the integrator is `shaders/path_trace.rgen`.

pub mod abi;
mod film;
mod gpu_scene;
mod passes;
mod renderer;
mod vk;

pub use passes::tonemap::ToneCurve;
pub use renderer::{Gpu, PathTracer, Yardstick};
pub use vk::{DeviceInfo, DeviceKind, Error, Options, Timing};

/// Every Vulkan device of this machine, usable or not.
///
/// # Errors
/// [`Error::NoVulkan`], a sentence for people, when there is no Vulkan at all.
pub fn devices() -> Result<Vec<DeviceInfo>, Error> {
    vk::Instance::new(Options::default())?.devices()
}
