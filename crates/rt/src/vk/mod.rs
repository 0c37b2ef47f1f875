//! The only room that talks to Vulkan, and the only one with `unsafe`.
//!
//! Ownership: [`Device`] is shared by `Arc`; every object keeps a clone, frees itself in `Drop`
//! without waiting, and is kept alive by the recording that uses it until the GPU is done with it.

#![allow(unsafe_code, reason = "this is the room for it")]

mod accel;
mod context;
mod device;
mod memory;
mod pipeline;
mod raster;
mod submit;
mod swapchain;

pub use accel::{Blas, BlasGeometry, BlasInput, Rebuild, Scratch, Tlas, TlasInstance};
pub use context::{Instance, Options};
pub use device::{Device, DeviceInfo, DeviceKind, Limits};
pub use memory::{Buffer, Image, Location};
pub use pipeline::{
    ComputePipeline, DescriptorSet, RayTracingPipeline, RayTracingShaders, Specialization,
};
pub use raster::{Draw, DrawTexture, Filter, RasterPipeline, Target};
pub use submit::{Access, Recording, Submission, Timing};
pub use swapchain::{FRAMES_IN_FLIGHT, Pace, Presented, Surface, Swapchain, Window};

pub use ash::vk::BufferUsageFlags as Usage;
pub use ash::vk::Format;

use ash::vk;

/// A Vulkan call or a requirement that failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No Vulkan at all on this machine.
    #[error("no Vulkan on this machine: {0}")]
    NoVulkan(String),
    /// A device that can't be used.
    #[error("{name} can't be used: it lacks {}", lacking.join(", "))]
    Unusable {
        /// The device.
        name: String,
        /// Names of extensions, features or limits.
        lacking: Vec<String>,
    },
    /// A scene that is larger than the device allows.
    #[error("the scene needs {needed} {what}, the device allows {allowed}")]
    Limit {
        /// What there is too much of.
        what: &'static str,
        /// How much the scene needs.
        needed: u64,
        /// How much the device allows.
        allowed: u64,
    },
    /// A scene or a frame that contradicts itself, or can't be shown; says how.
    #[error("the scene is invalid: {0}")]
    Scene(&'static str),
    /// The window's surface is gone: another one must be made.
    #[error("the window's surface is lost")]
    SurfaceLost,
    /// The device is gone: everything on it must be made anew.
    #[error("the device is lost ({call})")]
    DeviceLost {
        /// The Vulkan function that said so.
        call: &'static str,
    },
    /// A call failed.
    #[error("{call} failed: {result}")]
    Call {
        /// The Vulkan function.
        call: &'static str,
        /// What it answered.
        result: vk::Result,
    },
    /// No memory.
    #[error("could not allocate {size} bytes of GPU memory for {name}: {reason}")]
    Memory {
        /// The object.
        name: String,
        /// Its size.
        size: u64,
        /// What the allocator said.
        reason: String,
    },
}

impl Error {
    /// Whether less of everything could help: the device, or its driver, has no memory left.
    #[must_use]
    pub fn lacks_memory(&self) -> bool {
        use vk::Result as R;
        match self {
            Self::Memory { .. } => true,
            Self::Call { result, .. } => [
                R::ERROR_OUT_OF_DEVICE_MEMORY,
                R::ERROR_OUT_OF_HOST_MEMORY,
                R::ERROR_OUT_OF_POOL_MEMORY,
            ]
            .contains(result),
            _ => false,
        }
    }
}

/// Names the call in an error.
trait Named<T> {
    fn named(self, call: &'static str) -> Result<T, Error>;
}

impl<T> Named<T> for Result<T, vk::Result> {
    fn named(self, call: &'static str) -> Result<T, Error> {
        self.map_err(|result| match result {
            vk::Result::ERROR_SURFACE_LOST_KHR => Error::SurfaceLost,
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { call },
            result => Error::Call { call, result },
        })
    }
}
