//! The path tracer on Vulkan ray tracing: a [`scene::Scene`] in, radiance out.
//!
//! [`Vulkan`] lists what the machine has and opens a device as [`Gpu`], [`PathTracer`] renders. The
//! frame is `passes::record_frame`; the integrator is `shaders/path_trace.rgen`.

pub mod abi;
mod film;
mod gpu_scene;
mod passes;
mod renderer;
mod vk;

pub use passes::tonemap::ToneCurve;
pub use renderer::{Gpu, PathTracer, Vulkan, Yardstick};
pub use vk::{DeviceInfo, DeviceKind, Error, Options, Timing};
