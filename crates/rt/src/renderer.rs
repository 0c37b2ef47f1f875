//! The renderer: scene and settings in, film out.

use crate::abi;
use crate::film::GpuFilm;
use crate::gpu_scene::GpuScene;
use crate::passes::denoise::{Denoise, Sight};
use crate::passes::path_trace::{Kind, PathTrace, RayLog, Samples};
use crate::passes::tonemap::{ToneCurve, Tonemap};
use crate::passes::{Frame, record_frame};
use crate::vk::{
    Buffer, Device, DeviceInfo, Error, Instance, Location, Options, Recording, Submission, Timing,
    Usage,
};
use scene::render::{Film, Renderer, Settings};
use scene::{Frame as Moment, Scene};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Vulkan on this machine, opened once: loading the drivers takes a tenth of a second.
#[derive(Clone)]
pub struct Vulkan {
    instance: Arc<Instance>,
}

impl Vulkan {
    /// Opens Vulkan.
    ///
    /// # Errors
    /// [`Error::NoVulkan`], a sentence for people, when there is no Vulkan at all.
    pub fn new(options: Options) -> Result<Self, Error> {
        Ok(Self {
            instance: Instance::new(options)?,
        })
    }

    /// Every device, usable or not.
    ///
    /// # Errors
    /// When the enumeration fails.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, Error> {
        self.instance.devices()
    }

    /// Opens the device with this index in [`Vulkan::devices`].
    ///
    /// # Errors
    /// When the device lacks something, named, or a call fails.
    pub fn open(&self, index: usize) -> Result<Gpu, Error> {
        Ok(Gpu {
            device: Device::open(&self.instance, index)?,
        })
    }
}

impl std::fmt::Debug for Vulkan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Vulkan")
    }
}

/// An opened GPU.
#[derive(Clone)]
pub struct Gpu {
    device: Arc<Device>,
}

impl Gpu {
    /// What the device is.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Bytes of device memory that are allocated on it.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.device.allocated_bytes()
    }

    /// Takes so many bytes of device memory at most from now on, where the device is shared with others. What
    /// would be more fails with [`Error::Memory`], as where the device has no more.
    pub fn limit_bytes(&self, most: u64) {
        self.device.limit_bytes(most);
    }

    pub(crate) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// What the validation layer has said so far; empty without validation.
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.instance().validation_messages()
    }
}

/// Longest GPU time one submission should take, in milliseconds: systems stop a device that does
/// not answer for a second or two.
const SUBMISSION_MS: f64 = 250.0;

/// The path tracer on one device, for one scene and one picture.
pub struct PathTracer {
    device: Arc<Device>,
    scene: GpuScene,
    film: GpuFilm,
    path_trace: PathTrace,
    /// That for cameras of the other kind, with a lens or without, once there was one.
    other_path_trace: Option<PathTrace>,
    settings: Settings,
    /// Whether the film is to be emptied before the next samples.
    is_stale: bool,
    /// What the pictures have in common, and which of them the film is: see [`Sight`].
    scene_number: u64,
    picture_number: u64,
    /// What is shown from the next samples on.
    moment: Option<Moment>,
    /// What the device works on, with its samples per pixel: the host prepares what comes next.
    running: Option<(Submission, f64)>,
    /// Tracing time of one sample per pixel, of the submission that was timed last.
    sample_ms: f64,
    trace_ms: f64,
    /// GPU times since they were asked for.
    timings: Vec<Timing>,
    upload_timings: Vec<Timing>,
    /// Made when a picture is asked for the first time.
    tonemap: OnceLock<Tonemap>,
}

/// Timings that are kept, at most: whoever does not ask for them does not pay for them.
const TIMINGS_KEPT: usize = 1 << 16;

impl PathTracer {
    /// Uploads the scene, builds its acceleration structures and the pipeline.
    ///
    /// # Errors
    /// When the scene is larger than the device allows, there is no memory, or a call fails.
    pub fn new(gpu: &Gpu, scene: &Arc<Scene>, settings: &Settings) -> Result<Self, Error> {
        let device = gpu.device.clone();
        let film = GpuFilm::new(&device, settings, &scene.styles)?;
        let scene = GpuScene::upload(&device, scene)?;
        let path_trace = PathTrace::new(&device, &scene, settings, Kind::PathTrace, None)?;
        let upload_timings = scene.timings.clone();
        let settings = settings.clone();
        Ok(Self {
            device,
            scene,
            film,
            path_trace,
            other_path_trace: None,
            settings,
            is_stale: false,
            scene_number: unused_number(),
            picture_number: 0,
            moment: None,
            running: None,
            sample_ms: 0.0,
            trace_ms: 0.0,
            timings: Vec::new(),
            upload_timings,
            tonemap: OnceLock::new(),
        })
    }

    /// GPU times of the upload: building and compacting bottom-level structures, building the top
    /// level. Empty on devices without timestamps.
    #[must_use]
    pub fn upload_timings(&self) -> &[Timing] {
        &self.upload_timings
    }

    /// Bytes of all bottom-level acceleration structures.
    #[must_use]
    pub fn blas_bytes(&self) -> u64 {
        self.scene.blas_bytes
    }

    /// Waits for the device; then the GPU time spent tracing so far, in milliseconds, or 0 on devices
    /// without timestamps.
    ///
    /// # Errors
    /// When the device fails.
    pub fn trace_ms(&mut self) -> Result<f64, Error> {
        self.wait()?;
        Ok(self.trace_ms)
    }

    /// Waits for the device; then the GPU times of all parts of the work since this was called last, in
    /// order. Of a moment: `pose`, `refit BLAS`, `build loose BLAS`, `upload moment`, `rebuild TLAS`; and
    /// `path trace`.
    ///
    /// # Errors
    /// When the device fails.
    pub fn take_timings(&mut self) -> Result<Vec<Timing>, Error> {
        self.wait()?;
        Ok(std::mem::take(&mut self.timings))
    }

    /// GPU times of all parts of the work that was waited for since this or [`Self::take_timings`] was called last, in
    /// order: waits for nothing.
    #[must_use]
    pub fn settled_timings(&mut self) -> Vec<Timing> {
        std::mem::take(&mut self.timings)
    }

    /// Bytes of device memory that are allocated, of all that was opened with this device.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.device.allocated_bytes()
    }

    /// Begins a new picture of the same scene: an empty film.
    ///
    /// # Errors
    /// When a call fails.
    pub fn clear(&mut self) -> Result<(), Error> {
        self.wait()?;
        self.film.clear()?;
        self.is_stale = false;
        self.picture_number += 1;
        self.trace_ms = 0.0;
        Ok(())
    }

    /// Begins a new picture of the same scene with other settings: an empty film. Only what they change
    /// is made anew.
    ///
    /// # Errors
    /// When there is no memory, or a call fails.
    pub fn set(&mut self, settings: &Settings) -> Result<(), Error> {
        let same_film = self.film.size() == [settings.width, settings.height]
            && self.settings.aovs == settings.aovs
            && self.settings.clamp.is_some() == settings.clamp.is_some();
        if !self.path_trace.serves(&self.scene, settings) {
            let kind = Kind::PathTrace;
            self.path_trace = PathTrace::new(&self.device, &self.scene, settings, kind, None)?;
            // It was made for the old settings.
            self.other_path_trace = None;
        }
        if same_film {
            // With the next samples: nobody waits for what the device still does.
            self.is_stale = true;
        } else {
            let styles = std::mem::take(&mut self.film.styles);
            self.film = GpuFilm::new(&self.device, settings, &styles)?;
            self.is_stale = false;
        }
        let seen_otherwise = Settings {
            width: settings.width,
            height: settings.height,
            camera: settings.camera.clone(),
            time: settings.time,
            seed: settings.seed,
            ..self.settings.clone()
        };
        if seen_otherwise != *settings {
            self.scene_number = unused_number();
        }
        self.picture_number += 1;
        self.settings.clone_from(settings);
        self.trace_ms = 0.0;
        Ok(())
    }

    /// Begins a new picture, made by the shaders as they are now: those of development builds can change.
    ///
    /// # Errors
    /// When a call fails; then the shaders stay that were there.
    pub fn renew(&mut self) -> Result<(), Error> {
        let kind = Kind::PathTrace;
        self.path_trace = PathTrace::new(&self.device, &self.scene, &self.settings, kind, None)?;
        self.other_path_trace = None;
        self.is_stale = true;
        self.scene_number = unused_number();
        self.trace_ms = 0.0;
        Ok(())
    }

    /// Whether the device still works on the samples asked for last. What it has done is settled.
    ///
    /// # Errors
    /// When the device fails.
    pub fn is_busy(&mut self) -> Result<bool, Error> {
        match &self.running {
            None => Ok(false),
            Some((submission, _)) if !submission.is_done()? => Ok(true),
            Some(_) => self.wait().map(|()| false),
        }
    }

    /// GPU time of one sample per pixel in milliseconds, of the samples that were timed last; 0 before
    /// the first, and on devices without timestamps.
    #[must_use]
    pub fn sample_ms(&self) -> f64 {
        self.sample_ms
    }

    /// Waits for the device; then the rays of the film so far. Costs less than the film itself.
    ///
    /// # Errors
    /// When the device fails.
    pub fn rays(&mut self) -> Result<u64, Error> {
        self.wait()?;
        if self.is_stale {
            return Ok(0);
        }
        self.film.rays()
    }

    /// The film as display passes read it.
    pub(crate) fn gpu_film(&self) -> &GpuFilm {
        &self.film
    }

    /// The film as the filter for noise reads it.
    pub(crate) fn sight(&self) -> Sight<'_> {
        Sight {
            film: &self.film,
            camera: &self.settings.camera,
            scene: self.scene_number,
            picture: self.picture_number,
        }
    }

    /// Samples per pixel that one submission should take. The film does not depend on how samples
    /// are split, so the split may follow the clock.
    fn samples_that_fit(&self) -> u32 {
        if self.sample_ms > 0.0 {
            ((SUBMISSION_MS / self.sample_ms) as u32).max(1)
        } else {
            1
        }
    }

    fn submit(&mut self, samples: Samples) -> Result<(), Error> {
        let mut recording = Recording::begin(&self.device)?;
        if std::mem::take(&mut self.is_stale) {
            self.film.record_clear(&mut recording);
        }
        let taken = samples.mean();
        let moment = self.moment.take();
        let frame = Frame {
            moment: moment.as_ref(),
            settings: &self.settings,
            samples,
        };
        record_frame(
            &mut recording,
            &mut self.scene,
            &self.film,
            &mut self.path_trace,
            &frame,
        )?;
        let submission = recording.submit()?;
        // The device has work: now there is time for the one before.
        self.wait()?;
        self.running = Some((submission, taken));
        Ok(())
    }

    /// Waits until the device has nothing to do.
    fn wait(&mut self) -> Result<(), Error> {
        let Some((submission, samples)) = self.running.take() else {
            return Ok(());
        };
        let timings = submission.wait()?;
        let traced: f64 = (timings.iter().filter(|t| t.name == "path trace"))
            .map(|t| t.milliseconds)
            .sum();
        self.trace_ms += traced;
        if samples > 0.0 {
            self.sample_ms = traced / samples;
        }
        if self.timings.len() < TIMINGS_KEPT {
            self.timings.extend(timings);
        }
        Ok(())
    }

    /// Display codes of the film at an exposure of `ev` stops, made on the device: red, green,
    /// blue and 255 per pixel, rows from the top.
    ///
    /// # Errors
    /// When the film is larger than one buffer of the device, or a call fails.
    pub fn display(&self, curve: ToneCurve, ev: f32) -> Result<Vec<[u8; 4]>, Error> {
        let tonemap = match self.tonemap.get() {
            Some(made) => made,
            None => {
                let made = Tonemap::new(&self.device)?;
                self.tonemap.get_or_init(|| made)
            }
        };
        tonemap.run(&self.film, curve, ev)
    }

    /// [`Self::display`] with the shader as glslang compiles it instead of naga, for the test that
    /// compares the two.
    ///
    /// # Errors
    /// As [`Self::display`].
    #[doc(hidden)]
    pub fn display_by_other_compiler(
        &self,
        curve: ToneCurve,
        ev: f32,
    ) -> Result<Vec<[u8; 4]>, Error> {
        Tonemap::from_other_compiler(&self.device)?.run(&self.film, curve, ev)
    }

    /// The film without its noise as [`crate::Look::denoise`] shows it, with no picture before it, by the shaders as naga
    /// and as glslang compile them: for the test that compares them with each other and the CPU. Linear RGB, rows
    /// from the top.
    ///
    /// # Errors
    /// As [`Self::display`].
    ///
    /// # Panics
    /// When the film does not have its layers.
    #[doc(hidden)]
    pub fn denoised(&self) -> Result<[Vec<[f32; 3]>; 2], Error> {
        assert!(self.film.has_layers(), "a film with all its layers");
        Ok([
            Denoise::new(&self.device)?.run(&self.sight())?,
            Denoise::from_other_compiler(&self.device)?.run(&self.sight())?,
        ])
    }
}

/// A number that no scene in one light has had.
fn unused_number() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl Renderer for PathTracer {
    type Error = Error;

    fn accumulate(&mut self, samples: u32) -> Result<(), Error> {
        let mut left = samples;
        while left > 0 {
            let now = left.min(self.samples_that_fit());
            self.submit(Samples::Even(now))?;
            left -= now;
        }
        Ok(())
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<(), Error> {
        let pixels = self.settings.width as usize * self.settings.height as usize;
        assert_eq!(samples.len(), pixels, "a number for each pixel");
        let mut left = samples.to_vec();
        while left.iter().any(|&n| n > 0) {
            let fits = self.samples_that_fit();
            let now: Vec<u32> = left.iter().map(|&n| n.min(fits)).collect();
            let bytes = bytemuck::cast_slice(&now);
            let usage = Usage::STORAGE_BUFFER;
            let schedule = Buffer::with_data(&self.device, "samples per pixel", usage, bytes)?;
            let taken: f64 = now.iter().map(|&n| f64::from(n)).sum();
            let mean = taken / now.len() as f64;
            self.submit(Samples::PerPixel(schedule, mean))?;
            left.iter_mut()
                .zip(now)
                .for_each(|(left, now)| *left -= now);
        }
        Ok(())
    }

    fn show(&mut self, frame: &Moment) -> Result<(), Error> {
        let scene = self.scene.scene();
        frame.check(scene).map_err(Error::Scene)?;
        self.film.styles = scene.styles_now(&frame.styles);
        self.settings.camera.clone_from(&frame.camera);
        self.settings.time = frame.time;
        if self.path_trace.has_lens != frame.camera.lens.is_some() {
            let other = match self.other_path_trace.take() {
                Some(other) => other,
                None => {
                    let kind = Kind::PathTrace;
                    PathTrace::new(&self.device, &self.scene, &self.settings, kind, None)?
                }
            };
            self.other_path_trace = Some(std::mem::replace(&mut self.path_trace, other));
        }
        self.moment = Some(frame.clone());
        Ok(())
    }

    fn restart(&mut self, seed: u64) -> Result<(), Error> {
        self.settings.seed = seed;
        self.clear()
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.wait()
    }

    fn film(&mut self) -> Result<Film, Error> {
        self.wait()?;
        if std::mem::take(&mut self.is_stale) {
            self.film.clear()?;
        }
        self.film.read_back()
    }
}

/// Measures how fast the device traces the path tracer's own rays with nothing else to do.
pub struct Yardstick {
    tracer: PathTracer,
    trace_only: PathTrace,
}

impl Yardstick {
    /// Renders `samples` samples while logging every ray.
    ///
    /// # Errors
    /// When there is no memory for the log, or a call fails.
    pub fn new(
        gpu: &Gpu,
        scene: &Arc<Scene>,
        settings: &Settings,
        samples: u32,
    ) -> Result<Self, Error> {
        let device = gpu.device.clone();
        // A path has at most one camera or bounce ray and one shadow ray per vertex.
        let length = samples * 2 * settings.depth.max(1);
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        let size = pixels * u64::from(length) * size_of::<abi::LoggedRay>() as u64;
        let buffer = Buffer::new(
            &device,
            "ray log",
            size,
            Usage::STORAGE_BUFFER,
            Location::Device,
        )?;
        let log = RayLog { buffer, length };
        let mut tracer = PathTracer::new(gpu, scene, settings)?;
        let (kind, scene) = (Kind::LogRays, &tracer.scene);
        tracer.path_trace = PathTrace::new(&device, scene, settings, kind, Some(log.clone()))?;
        tracer.submit(Samples::Even(samples))?;
        tracer.wait()?;
        let kind = Kind::TraceOnly;
        let trace_only = PathTrace::new(&device, &tracer.scene, settings, kind, Some(log))?;
        Ok(Self { tracer, trace_only })
    }

    /// Rays in the log.
    ///
    /// # Errors
    /// When a call fails.
    pub fn rays(&mut self) -> Result<u64, Error> {
        Ok(self.tracer.film()?.counters.rays)
    }

    /// Traces the logged rays once. Returns the GPU time in milliseconds. The film is lost.
    ///
    /// # Errors
    /// When a call fails.
    pub fn run(&mut self) -> Result<f64, Error> {
        let tracer = &self.tracer;
        let mut recording = Recording::begin(&tracer.device)?;
        recording.span("trace only", |r| {
            self.trace_only.record(
                r,
                &tracer.scene,
                &tracer.film,
                &tracer.settings,
                &Samples::Even(1),
            )
        })?;
        let timings = recording.submit_and_wait()?;
        Ok(timings.iter().map(|t| t.milliseconds).sum())
    }
}
