//! The path tracer on Vulkan ray tracing: a [`scene::Scene`] in, radiance out.
//!
//! [`Vulkan`] lists what the machine has and opens a device as [`Gpu`], [`PathTracer`] renders. The
//! frame is `passes::record_frame`; the integrator is `shaders/path_trace.rgen`. [`Screen`] shows the film,
//! and triangles over it, in a window or off-screen.

pub mod abi;
mod film;
mod gpu_scene;
#[cfg(debug_assertions)]
pub mod hot;
mod passes;
mod renderer;
mod screen;
mod vk;

pub use passes::overlay::{Mesh, PICTURE, Vertex};
pub use passes::tonemap::ToneCurve;
pub use renderer::{Gpu, PathTracer, Vulkan, Yardstick};
pub use screen::{Look, Pixels, Screen, Shown};
pub use vk::{DeviceInfo, DeviceKind, Error, Filter, Options, Pace, Timing, Window};
