//! Radiance to display codes: `shaders/tonemap.comp`.

use super::spirv;
use crate::film::GpuFilm;
use crate::vk::{Buffer, ComputePipeline, Device, Error, Location, Recording, Usage};
use std::sync::Arc;

/// Tone curves, numbered as in the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ToneCurve {
    /// AgX with its base look.
    Agx = 0,
    /// Narkowicz's fit of the ACES curve.
    Aces = 1,
    /// x / (1 + x) on luminance.
    Reinhard = 2,
    /// Cut off at 1.
    Clip = 3,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    width: u32,
    height: u32,
    curve: u32,
    gain: f32,
}

/// The pass.
pub(crate) struct Tonemap {
    pipeline: Arc<ComputePipeline>,
}

impl Tonemap {
    pub fn new(device: &Arc<Device>) -> Result<Self, Error> {
        Self::with_code(device, &spirv!("tonemap.comp"))
    }

    fn with_code(device: &Arc<Device>, code: &[u32]) -> Result<Self, Error> {
        let size = size_of::<Params>() as u32;
        Ok(Self {
            pipeline: ComputePipeline::new(device, "tone map", code, 2, size)?,
        })
    }

    /// The pass as the other compiler makes it: the test of both runs the two side by side.
    #[doc(hidden)]
    pub fn from_other_compiler(device: &Arc<Device>) -> Result<Self, Error> {
        Self::with_code(device, &spirv!("tonemap.comp.glslang"))
    }

    /// Records display codes at an exposure of `ev` stops into `out`: RGB and 255, rows from the top. `sums` are of
    /// radiance, with the number of samples: a film's first plane.
    pub fn record(
        &self,
        recording: &mut Recording,
        (sums, size): (&Arc<Buffer>, [u32; 2]),
        out: &Arc<Buffer>,
        (curve, ev): (ToneCurve, f32),
    ) -> Result<(), Error> {
        let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
        let params = Params {
            width: size[0],
            height: size[1],
            curve: curve as u32,
            gain: ev.exp2(),
        };
        recording.span("tone map", |r| {
            let buffers = [(sums, 4 * bytes), (out, bytes)];
            let groups = size.map(|n| n.div_ceil(8));
            self.pipeline
                .record_dispatch(r, &buffers, bytemuck::bytes_of(&params), groups)
        })
    }

    /// What [`Self::record`] makes of a film, read back.
    pub fn run(&self, film: &GpuFilm, curve: ToneCurve, ev: f32) -> Result<Vec<[u8; 4]>, Error> {
        let device = film.sums.device();
        let [width, height] = film.size();
        let bytes = 4 * u64::from(width) * u64::from(height);
        let make = |usage, location| Buffer::new(device, "display", bytes, usage, location);
        let out = make(Usage::STORAGE_BUFFER, Location::Device)?;
        let host = make(Usage::empty(), Location::ReadBack)?;
        let mut recording = Recording::begin(device)?;
        let sums = (&film.sums, [width, height]);
        self.record(&mut recording, sums, &out, (curve, ev))?;
        recording.copy(&out, &host, (0, 0), bytes);
        recording.submit_and_wait()?;
        Ok(bytemuck::cast_slice(&host.read()?[..bytes as usize]).to_vec())
    }
}
