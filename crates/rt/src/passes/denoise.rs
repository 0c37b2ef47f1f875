//! A film's picture without its noise, for looking: `shaders/denoise_*.comp`.

use super::spirv;
use crate::abi;
use crate::film::GpuFilm;
use crate::vk::{Buffer, ComputePipeline, Device, Error, Location, Recording, Usage};
use glam::DVec3;
use scene::Camera;
use std::sync::Arc;

/// Times that light is averaged, each over gaps twice as wide as the time before.
const LEVELS: u32 = 5;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Planes {
    size: [u32; 2],
    planes: [u32; 6],
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Step {
    size: [u32; 2],
    gap: u32,
    unused: u32,
}

/// A camera as the shader projects with it; all 0 is none.
#[repr(C)]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Eye {
    origin: abi::vec4,
    forward: abi::vec4,
    right: abi::vec4,
    up: abi::vec4,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Recall {
    eye: Eye,
    size: [u32; 2],
    size_then: [u32; 2],
}

/// A picture that is one of several.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    /// The film, with all its layers.
    pub film: &'a GpuFilm,
    /// Who looks.
    pub camera: &'a Camera,
    /// What it is a picture of: those of one scene in one light have the same number.
    pub scene: u64,
    /// Which of these pictures it is. The same with more samples has the same number.
    pub picture: u64,
}

/// The passes, and what they know of pictures.
pub(crate) struct Denoise {
    pipelines: [Arc<ComputePipeline>; 5],
    pictures: Option<Pictures>,
}

/// The picture that is filtered, and the one before.
struct Pictures {
    now: Memory,
    /// Of the same scene.
    then: Option<Memory>,
    /// Light to read and light to write, and the other way round, of a picture of the size of `now`.
    lights: [Arc<Buffer>; 2],
}

/// What is kept of a picture.
struct Memory {
    scene: u64,
    picture: u64,
    size: [u32; 2],
    eye: Eye,
    /// What is seen, two words a pixel.
    guides: Arc<Buffer>,
    /// Light, and how many samples it is worth.
    kept: Arc<Buffer>,
}

/// Bytes of a word.
const VEC4: u64 = size_of::<abi::vec4>() as u64;

impl Denoise {
    pub fn new(device: &Arc<Device>) -> Result<Self, Error> {
        let code = [
            spirv!("denoise_part.comp"),
            spirv!("denoise_noise.comp"),
            spirv!("denoise_recall.comp"),
            spirv!("denoise_average.comp"),
            spirv!("denoise_join.comp"),
        ];
        Self::with_code(device, &code)
    }

    /// The passes as the other compiler makes them: the test of both runs them side by side.
    #[doc(hidden)]
    pub fn from_other_compiler(device: &Arc<Device>) -> Result<Self, Error> {
        let code = [
            spirv!("denoise_part.comp.glslang"),
            spirv!("denoise_noise.comp.glslang"),
            spirv!("denoise_recall.comp.glslang"),
            spirv!("denoise_average.comp.glslang"),
            spirv!("denoise_join.comp.glslang"),
        ];
        Self::with_code(device, &code)
    }

    fn with_code(
        device: &Arc<Device>,
        [part, noise, recall, average, join]: &[Vec<u32>; 5],
    ) -> Result<Self, Error> {
        let make = |code: &[u32], buffers, bytes: usize| {
            ComputePipeline::new(device, "denoise", code, buffers, bytes as u32)
        };
        Ok(Self {
            pipelines: [
                make(part, 3, size_of::<Planes>())?,
                make(noise, 3, size_of::<Step>())?,
                make(recall, 6, size_of::<Recall>())?,
                make(average, 3, size_of::<Step>())?,
                make(join, 3, size_of::<Planes>())?,
            ],
            pictures: None,
        })
    }

    /// Records the filter of a film. Returns where the picture will be: radiance and 1, like a film's first plane after one
    /// sample.
    ///
    /// # Errors
    /// When the film is larger than one buffer of the device, or there is no memory.
    pub fn record(
        &mut self,
        recording: &mut Recording,
        sight: &Sight<'_>,
    ) -> Result<Arc<Buffer>, Error> {
        let pictures = Pictures::follow(self.pictures.take(), recording.device(), sight)?;
        let done = pictures.record(recording, &self.pipelines, sight.film);
        self.pictures = Some(pictures);
        done
    }

    /// What [`Self::record`] makes, read back: linear RGB, rows from the top.
    pub fn run(&mut self, sight: &Sight<'_>) -> Result<Vec<[f32; 3]>, Error> {
        let device = sight.film.sums.device();
        let [width, height] = sight.film.size();
        let bytes = u64::from(width) * u64::from(height) * VEC4;
        let (usage, location) = (Usage::empty(), Location::ReadBack);
        let host = Buffer::new(device, "denoised", bytes, usage, location)?;
        let mut recording = Recording::begin(device)?;
        let picture = self.record(&mut recording, sight)?;
        recording.copy(&picture, &host, (0, 0), bytes);
        recording.submit_and_wait()?;
        let words: &[abi::vec4] = bytemuck::cast_slice(&host.read()?[..bytes as usize]);
        Ok(words.iter().map(|p| [p[0], p[1], p[2]]).collect())
    }
}

impl Eye {
    fn of(camera: &Camera, [width, height]: [u32; 2]) -> Self {
        let basis = camera.view_basis(width, height);
        let word = |v: DVec3, w: f32| {
            let [x, y, z] = v.as_vec3().to_array();
            [x, y, z, w]
        };
        Self {
            origin: word(basis.origin, 0.0),
            forward: word(basis.forward, 1.0),
            right: word(basis.right, 0.0),
            up: word(basis.up, 0.0),
        }
    }
}

impl Pictures {
    /// Those from which `sight` is filtered: the same once more, or the next.
    fn follow(
        before: Option<Self>,
        device: &Arc<Device>,
        sight: &Sight<'_>,
    ) -> Result<Self, Error> {
        let size = sight.film.size();
        let key = (sight.scene, sight.picture, size);
        let (last, spare, lights) = match before {
            Some(same) if same.now.key() == key => return Ok(same),
            Some(Self { now, then, lights }) => (Some(now), then, Some(lights)),
            None => (None, None, None),
        };
        let bytes = u64::from(size[0]) * u64::from(size[1]) * VEC4;
        let make = |name, bytes| {
            let usage = Usage::STORAGE_BUFFER;
            Buffer::new(device, name, bytes, usage, Location::Device)
        };
        let fits = last.as_ref().is_some_and(|m| m.size == size);
        let lights = match lights.filter(|_| fits) {
            Some(lights) => lights,
            None => [make("light", bytes)?, make("light", bytes)?],
        };
        // Buffers of the picture before the last serve again.
        let (guides, kept) = match spare.filter(|m| m.size == size) {
            Some(Memory { guides, kept, .. }) => (guides, kept),
            None => (make("guides", 2 * bytes)?, make("kept light", bytes)?),
        };
        Ok(Self {
            now: Memory {
                scene: sight.scene,
                picture: sight.picture,
                size,
                eye: Eye::of(sight.camera, size),
                guides,
                kept,
            },
            then: last.filter(|m| m.scene == sight.scene),
            lights,
        })
    }

    fn record(
        &self,
        recording: &mut Recording,
        [part, noise, recall, average, join]: &[Arc<ComputePipeline>; 5],
        film: &GpuFilm,
    ) -> Result<Arc<Buffer>, Error> {
        let (now, size) = (&self.now, self.now.size);
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let film = (&film.sums, u64::from(abi::PLANES_ALL) * pixels * VEC4);
        let (guides, kept) = ((&now.guides, 2 * pixels * VEC4), (&now.kept, pixels * VEC4));
        let [near, far] = [0, 1].map(|i| (&self.lights[i], pixels * VEC4));
        // Without a picture before there is nothing to read: any buffer will do.
        let (eye, size_then, then) = match &self.then {
            Some(then) => (then.eye, then.size, [&then.guides, &then.kept]),
            None => (Eye::default(), [0; 2], [guides.0, near.0]),
        };
        let groups = size.map(|n| n.div_ceil(8));
        let planes = Planes {
            size,
            planes: [
                abi::PLANE_BEAUTY,
                abi::PLANE_DEVIATION,
                abi::PLANE_EMISSION,
                abi::PLANE_ALBEDO,
                abi::PLANE_NORMAL,
                abi::PLANE_POSITION,
            ],
        };
        let planes = bytemuck::bytes_of(&planes);
        let step = |gap| Step {
            size,
            gap,
            unused: 0,
        };
        let recalls = Recall {
            eye,
            size,
            size_then,
        };
        recording.span("denoise", |r| {
            part.record_dispatch(r, &[film, guides, near], planes, groups)?;
            let params = step(0);
            let params = bytemuck::bytes_of(&params);
            noise.record_dispatch(r, &[guides, near, far], params, groups)?;
            let then = then.map(|buffer| (buffer, buffer.size()));
            let buffers = [guides, near, far, then[0], then[1], kept];
            recall.record_dispatch(r, &buffers, bytemuck::bytes_of(&recalls), groups)?;
            let (mut from, mut to) = (far, near);
            for level in 0..LEVELS {
                let params = step(1 << level);
                let params = bytemuck::bytes_of(&params);
                average.record_dispatch(r, &[guides, from, to], params, groups)?;
                std::mem::swap(&mut from, &mut to);
            }
            join.record_dispatch(r, &[film, from, to], planes, groups)?;
            Ok(to.0.clone())
        })
    }
}

impl Memory {
    fn key(&self) -> (u64, u64, [u32; 2]) {
        (self.scene, self.picture, self.size)
    }
}
