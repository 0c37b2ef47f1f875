//! The path tracing pass: `shaders/path_trace.*`, `shaders/shadow.rmiss`, `shaders/transmittance.*`.

use super::spirv;
use crate::abi;
use crate::film::GpuFilm;
use crate::gpu_scene::GpuScene;
use crate::vk::{
    Buffer, DescriptorSet, Device, Error, RayTracingPipeline, RayTracingShaders, Recording,
    Specialization, Tlas,
};
use scene::camera::Lens;
use scene::render::{Estimator, MOST_CANDIDATES, Sampler, Selection, Settings};
use std::sync::Arc;

/// Where rays are logged, for the yardstick.
#[derive(Clone)]
pub(crate) struct RayLog {
    /// Room for `length` rays per pixel.
    pub buffer: Arc<Buffer>,
    /// Rays per pixel at most.
    pub length: u32,
}

/// How many samples to add.
#[derive(Clone)]
pub(crate) enum Samples {
    /// As many to every pixel.
    Even(u32),
    /// To each pixel as many as its `u32` in the buffer says, and how many that is on average.
    PerPixel(Arc<Buffer>, f64),
}

impl Samples {
    /// Samples per pixel, on average.
    pub fn mean(&self) -> f64 {
        match self {
            Self::Even(count) => f64::from(*count),
            Self::PerPixel(_, mean) => *mean,
        }
    }
}

/// The pipeline for one scene and one kind of settings, with the descriptors of the scene.
pub(crate) struct PathTrace {
    pipeline: Arc<RayTracingPipeline>,
    set: Arc<DescriptorSet>,
    /// The structure that the set has.
    tlas: Arc<Tlas>,
    log: Option<RayLog>,
    /// Whether it is for cameras with a lens, or for pinholes.
    pub has_lens: bool,
    specialization: Specialization,
}

/// What shaders are told of a camera without a lens, and do not read.
const PINHOLE: Lens = Lens {
    radius: 0.0,
    focus: 1.0,
};

/// Which ray generation shader a pipeline gets.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The path tracer.
    PathTrace,
    /// The path tracer, writing every ray into the log.
    LogRays,
    /// Tracing the logged rays and nothing else.
    TraceOnly,
}

impl PathTrace {
    /// Builds the pipeline for what the scene contains.
    pub fn new(
        device: &Arc<Device>,
        scene: &GpuScene,
        settings: &Settings,
        kind: Kind,
        log: Option<RayLog>,
    ) -> Result<Self, Error> {
        let specialization = Self::specialization(scene, settings, kind);
        let textures = scene.textures.len() as u32;
        // All that `build` depends on: the other features are among the specialization's numbers.
        let of = [kind as u32, textures, super::generation()];
        let made_for = [&of, &specialization.0[..]].concat();
        let pipeline = RayTracingPipeline::shared(device, made_for, || {
            Self::build(device, scene, kind, &specialization)
        })?;
        let set = DescriptorSet::new(&pipeline, &scene.tlas, scene.textures.clone())?;
        Ok(Self {
            pipeline,
            set,
            tlas: scene.tlas.clone(),
            log,
            has_lens: settings.camera.lens.is_some(),
            specialization,
        })
    }

    fn build(
        device: &Arc<Device>,
        scene: &GpuScene,
        kind: Kind,
        specialization: &Specialization,
    ) -> Result<Arc<RayTracingPipeline>, Error> {
        let features = scene.features;
        let raygen = match kind {
            Kind::PathTrace | Kind::LogRays => spirv!("path_trace.rgen"),
            Kind::TraceOnly => spirv!("trace_only.rgen"),
        };
        let (miss, shadow_miss) = (spirv!("path_trace.rmiss"), spirv!("shadow.rmiss"));
        let sun_miss = spirv!("sun.rmiss");
        let (closest_hit, any_hit) = (spirv!("path_trace.rchit"), spirv!("path_trace.rahit"));
        let (clear, through) = (spirv!("transmittance.rmiss"), spirv!("transmittance.rahit"));
        // Opaque, alpha-tested, and what shadow rays ask where light passes through.
        let any_hits: &[&[u32]] = &[&any_hit, &through];
        let any_hits = match (features.fences, features.translucent) {
            (_, true) => any_hits,
            (true, false) => &any_hits[..1],
            (false, false) => &any_hits[..0],
        };
        // What comes last is left out where nothing asks for it.
        let misses: &[&[u32]] = &[&miss, &shadow_miss, &clear, &sun_miss];
        let misses = match features.translucent || features.suns {
            true => misses,
            false => &misses[..2],
        };
        let shaders = RayTracingShaders {
            raygen: &raygen,
            miss: misses,
            closest_hit: &closest_hit,
            any_hit: any_hits,
        };
        RayTracingPipeline::new(
            device,
            "path trace",
            &shaders,
            specialization,
            scene.textures.len() as u32,
            size_of::<abi::PathTraceParams>() as u32,
        )
    }

    /// What the shaders are specialized for: a pipeline serves all settings that give the same.
    fn specialization(scene: &GpuScene, settings: &Settings, kind: Kind) -> Specialization {
        let features = scene.features;
        Specialization(vec![
            match settings.estimator {
                Estimator::Naive => abi::ESTIMATOR_NAIVE,
                Estimator::Uniform => abi::ESTIMATOR_UNIFORM,
                Estimator::Nee => abi::ESTIMATOR_NEE,
                Estimator::Mis => abi::ESTIMATOR_MIS,
            },
            scene.sky,
            u32::from(features.emissive_surfaces),
            u32::from(features.point_lights),
            u32::from(features.liquids),
            u32::from(features.instances),
            u32::from(features.fences),
            u32::from(settings.aovs),
            u32::from(kind == Kind::LogRays),
            match settings.selection {
                Selection::Leaf if scene.has_cells && scene.has_tree => abi::SELECTION_LEAF,
                Selection::Leaf | Selection::Tree if scene.has_tree => abi::SELECTION_TREE,
                Selection::Power | Selection::Leaf | Selection::Tree => abi::SELECTION_POWER,
                Selection::Uniform => abi::SELECTION_UNIFORM,
            },
            u32::from(features.translucent),
            u32::from(features.suns),
            u32::from(features.gloss),
            u32::from(features.normal_maps),
            u32::from(features.compiler_lights),
            u32::from(features.baked_light),
            settings.candidates.clamp(1, MOST_CANDIDATES),
            u32::from(settings.sampler == Sampler::Sobol),
            u32::from(features.style_layers),
            u32::from(features.fog),
            u32::from(features.poses),
            u32::from(features.skins),
            u32::from(features.masks),
            u32::from(features.frames),
            GpuFilm::clamp_of(settings, features.style_layers).map_or(0, f32::to_bits),
            u32::from(settings.camera.lens.is_some()),
            u32::from(features.smooth_normals),
            u32::from(features.light_sums),
        ])
    }

    /// Whether the pipeline serves these settings.
    pub fn serves(&self, scene: &GpuScene, settings: &Settings) -> bool {
        Self::specialization(scene, settings, Kind::PathTrace) == self.specialization
    }

    /// Takes the scene's top-level structure where it has another than before.
    pub fn follow(&mut self, scene: &GpuScene) -> Result<(), Error> {
        if !Arc::ptr_eq(&self.tlas, &scene.tlas) {
            self.tlas = scene.tlas.clone();
            self.set = DescriptorSet::new(&self.pipeline, &self.tlas, scene.textures.clone())?;
        }
        Ok(())
    }

    /// Records `samples`, the next ones of each pixel.
    pub fn record(
        &self,
        recording: &mut Recording,
        scene: &GpuScene,
        film: &GpuFilm,
        settings: &Settings,
        samples: &Samples,
    ) -> Result<(), Error> {
        let (sample_count, schedule) = match samples {
            Samples::Even(0) => return Ok(()),
            Samples::Even(count) => (*count, 0),
            Samples::PerPixel(schedule, _) => {
                recording.keep(schedule.clone());
                (0, schedule.address())
            }
        };
        let view = settings.camera.view_basis(settings.width, settings.height);
        let lens = view.lens.unwrap_or(PINHOLE);
        let params = abi::PathTraceParams {
            scene: scene.address,
            film: film.sums.address(),
            tallies: film.tallies(recording),
            ray_log: self.log.as_ref().map_or(0, |l| l.buffer.address()),
            schedule,
            ray_log_length: self.log.as_ref().map_or(0, |l| l.length),
            origin: view.origin.as_vec3().to_array(),
            forward: view.forward.as_vec3().to_array(),
            right: view.right.as_vec3().to_array(),
            up: view.up.as_vec3().to_array(),
            t_max: scene.longest_ray(settings.camera.position) + 2.0 * lens.radius,
            time: settings.time,
            depth: settings.depth,
            seed: [settings.seed as u32, (settings.seed >> 32) as u32],
            sample_count,
            medium: scene.medium_at(settings.camera.position),
            lens_radius: lens.radius,
            focus: lens.focus,
        };
        let size = [settings.width, settings.height];
        recording.keep(film.sums.clone());
        self.pipeline
            .record_trace(recording, &self.set, bytemuck::bytes_of(&params), size)
    }
}
