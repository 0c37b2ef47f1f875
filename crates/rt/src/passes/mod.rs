//! The passes, and the frame that is made of them.

pub mod path_trace;
pub mod tonemap;

use crate::film::GpuFilm;
use crate::gpu_scene::GpuScene;
use crate::vk::{Error, Recording};
use glam::Affine3A;
use path_trace::PathTrace;
use scene::render::Settings;

/// What one frame does.
pub(crate) struct Frame<'a> {
    /// Where instances move to, with `refit` or a rebuild of the top level; `None` if none moved.
    pub moved: Option<(&'a [Affine3A], bool)>,
    /// Who looks, and how.
    pub settings: &'a Settings,
    /// First sample and number of samples to add.
    pub samples: (u32, u32),
}

/// Records one frame: move what moves, then add samples to the film.
///
/// Display passes (see [`tonemap`]) read the film afterwards and never write it.
///
/// # Errors
/// When a call fails or there is no memory.
pub(crate) fn record_frame(
    recording: &mut Recording,
    scene: &mut GpuScene,
    film: &GpuFilm,
    path_trace: &PathTrace,
    frame: &Frame<'_>,
) -> Result<(), Error> {
    if let Some((transforms, refit)) = frame.moved {
        scene.record_transforms(recording, transforms, refit)?;
    }
    let (begin, count) = frame.samples;
    recording.span("path trace", |r| {
        path_trace.record(r, scene, film, frame.settings, begin, count)
    })
}

/// SPIR-V words of a compiled shader.
macro_rules! spirv {
    ($name:literal) => {{
        const BYTES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv"));
        $crate::passes::words(BYTES)
    }};
}
pub(crate) use spirv;

/// Little-endian bytes to words.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
