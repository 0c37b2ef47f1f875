//! The reference renderer: a path tracer on the CPU in double precision.
//!
//! It is the judge of the renderer on the GPU and the renderer of machines without one. What it
//! computes is said in `docs/transport.md`; it shares that meaning with the GPU, and neither
//! arithmetic nor random numbers.
//!
//! A pixel's picture depends on the scene, the settings and the number of samples alone: not on
//! the number of threads, nor on how the samples are split into calls.
//!
//! ```
//! use reference::Reference;
//! use scene::render::{Estimator, Renderer, Sampler, Selection, Settings};
//! use std::sync::Arc;
//!
//! let settings = Settings {
//!     width: 4,
//!     height: 3,
//!     camera: scene::Camera {
//!         name: String::new(),
//!         position: glam::Vec3::ZERO,
//!         pitch_deg: 0.0,
//!         yaw_deg: 0.0,
//!         roll_deg: 0.0,
//!         fov_deg: scene::camera::DEFAULT_FOV_DEG,
//!         lens: None,
//!     },
//!     estimator: Estimator::Mis,
//!     selection: Selection::Power,
//!     candidates: 1,
//!     sampler: Sampler::Independent,
//!     depth: 3,
//!     time: 0.0,
//!     seed: 0,
//!     aovs: false,
//!     clamp: None,
//! };
//! let mut renderer = Reference::new(Arc::new(scene::Scene::default()), &settings)?;
//! renderer.accumulate(2)?;
//! assert_eq!(renderer.film()?.counters.escaped, 24);
//! # Ok::<(), reference::Error>(())
//! ```

#![forbid(unsafe_code)]

mod bsdf;
mod bvh;
mod check;
mod choice;
#[cfg(test)]
mod choice_tests;
pub mod compiler;
mod emitters;
mod film;
pub mod fog;
mod integrator;
mod lights;
mod moment;
mod motion;
mod part;
mod passage;
pub mod probe;
pub mod rays;
mod rng;
pub mod shading;
mod sky;
mod sobol;
mod sums;
mod triangle;
mod world;

use film::{LayerSums, PixelSums};
use glam::{DVec2, DVec3};
use integrator::{PathSample, trace_path};
use motion::Seen;
use rayon::prelude::*;
use rng::Rng;
use scene::camera::ViewBasis;
use scene::render::{Counters, ESCAPES_KEPT, Escape, Film, Renderer, Settings};
use scene::{Frame, Scene};
use std::sync::Arc;
use triangle::Ray;
use world::World;

/// Why a picture can't be rendered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The picture has no pixels.
    #[error("the picture must be at least 1 pixel wide and high")]
    EmptyPicture,
    /// The sums of all pixels do not fit into memory.
    #[error("not enough memory for {0} pixels")]
    OutOfMemory(u64),
    /// The scene contradicts itself; says how.
    #[error("the scene is invalid: {0}")]
    InvalidScene(&'static str),
    /// More samples than can be counted.
    #[error("a pixel can have at most {} samples", u32::MAX)]
    TooManySamples,
}

/// Pixels that one task renders.
const CHUNK: usize = 64;

/// The renderer: a scene, settings, and the sums so far.
#[derive(Debug)]
pub struct Reference {
    view: View,
    pixels: Vec<PixelSums>,
    /// Empty if the layers are not wanted.
    layers: Vec<LayerSums>,
    tally: Tally,
}

/// All that a sample depends on.
#[derive(Debug)]
struct View {
    world: World,
    settings: Settings,
    basis: ViewBasis,
}

impl Reference {
    /// Prepares `scene` for rays: flattens its instances and builds the hierarchy.
    ///
    /// # Errors
    /// If the picture is empty or too large, or if the scene contradicts itself.
    pub fn new(scene: Arc<Scene>, settings: &Settings) -> Result<Self, Error> {
        let (width, height) = (settings.width, settings.height);
        if width == 0 || height == 0 {
            return Err(Error::EmptyPicture);
        }
        let count = u64::from(width) * u64::from(height);
        Ok(Self {
            pixels: zeroed(count, count)?,
            layers: zeroed(if settings.aovs { count } else { 0 }, count)?,
            view: View {
                world: World::new(scene, &settings.camera, settings.time)?,
                basis: settings.camera.view_basis(width, height),
                settings: settings.clone(),
            },
            tally: Tally::default(),
        })
    }
}

impl Renderer for Reference {
    type Error = Error;

    fn accumulate(&mut self, samples: u32) -> Result<(), Error> {
        self.add(|_| samples)
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<(), Error> {
        assert_eq!(samples.len(), self.pixels.len(), "a number for each pixel");
        self.add(|pixel| samples[pixel])
    }

    fn show(&mut self, frame: &Frame) -> Result<(), Error> {
        let View {
            world,
            settings,
            basis,
        } = &mut self.view;
        world.show(frame)?;
        world.before = Seen::new(frame, [settings.width, settings.height]);
        *basis = frame.camera.view_basis(settings.width, settings.height);
        settings.camera.clone_from(&frame.camera);
        settings.time = frame.time;
        Ok(())
    }

    fn restart(&mut self, seed: u64) -> Result<(), Error> {
        self.pixels.fill(PixelSums::default());
        self.layers.fill(LayerSums::default());
        self.tally = Tally::default();
        self.view.settings.seed = seed;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn film(&mut self) -> Result<Film, Error> {
        let size = [self.view.settings.width, self.view.settings.height];
        let Tally { counters, escapes } = self.tally.clone();
        let (pixels, layers) = (&self.pixels, &self.layers);
        let styles = &self.view.world.styles;
        let mut film = film::develop(size, pixels, styles, layers, counters, escapes);
        film.clamped = self.view.clamp().map(|_| film::clamped(pixels));
        Ok(film)
    }
}

impl Reference {
    /// Adds to each pixel as many samples as `how_many` says of its number.
    fn add(&mut self, how_many: impl Fn(usize) -> u32 + Sync) -> Result<(), Error> {
        let full = |(i, p): (usize, &PixelSums)| p.samples.checked_add(how_many(i)).is_none();
        if self.pixels.iter().enumerate().any(full) {
            return Err(Error::TooManySamples);
        }
        let (view, how_many) = (&self.view, &how_many);
        let pixels = self.pixels.par_chunks_mut(CHUNK);
        let tally = if self.layers.is_empty() {
            pixels
                .enumerate()
                .map(|(i, p)| view.render(i * CHUNK, how_many, p, None))
                .reduce(Tally::default, Tally::and)
        } else {
            pixels
                .zip(self.layers.par_chunks_mut(CHUNK))
                .enumerate()
                .map(|(i, (p, l))| view.render(i * CHUNK, how_many, p, Some(l)))
                .reduce(Tally::default, Tally::and)
        };
        self.tally = std::mem::take(&mut self.tally).and(tally);
        Ok(())
    }
}

impl View {
    /// What samples are clamped to: light that is summed by styles can't be darkened as a whole.
    fn clamp(&self) -> Option<f32> {
        (self.settings.clamp).filter(|_| self.world.scene.styles.len() < 2)
    }

    /// Adds as many samples as `how_many` says to the pixels from number `first` on, and to their
    /// layers if there are any.
    fn render(
        &self,
        first: usize,
        how_many: &impl Fn(usize) -> u32,
        pixels: &mut [PixelSums],
        mut layers: Option<&mut [LayerSums]>,
    ) -> Tally {
        let limit = self.clamp();
        let [width, height] = [self.settings.width, self.settings.height].map(f64::from);
        let per_unit = DVec2::new(width / 2.0, -height / 2.0);
        let mut tally = Tally::default();
        let mut stack = bvh::Stack::new();
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let place = first + i;
            for _ in 0..how_many(place) {
                let number = pixel.samples;
                let mut rng = Rng::new(
                    self.settings.sampler,
                    self.settings.seed,
                    place as u64,
                    number,
                );
                let ray = self.camera_ray(place, &mut rng);
                let mut path = trace_path(&self.world, &self.settings, ray, &mut rng, &mut stack);
                let whole = path.emission + path.direct + path.indirect;
                if let Some(limit) = limit.filter(|_| whole.is_finite()) {
                    let lost = path.clamp(f64::from(limit));
                    if lost != DVec3::ZERO {
                        pixel.add_lost(lost);
                    }
                }
                let radiance = path.emission + path.direct + path.indirect;
                tally.count(&path, radiance.is_finite(), place, number);
                if let Some(layers) = layers.as_deref_mut().map(|l| &mut l[i]) {
                    let depth = self.view_depth(&path);
                    layers.add_first_hit(&path, depth, per_unit, number == 0);
                    if radiance.is_finite() {
                        layers.add_light(&path);
                    }
                }
                if radiance.is_finite() {
                    pixel.add_styled(&path.styled, self.world.scene.styles.len());
                }
                pixel.add(radiance);
            }
        }
        tally
    }

    /// A ray through a point of a pixel, from the eye or a point of the lens around it.
    fn camera_ray(&self, pixel: usize, rng: &mut Rng) -> Ray {
        let u = rng.next2();
        let (width, height) = (self.settings.width as usize, self.settings.height as usize);
        let x = ((pixel % width) as f64 + u[0]) / width as f64 * 2.0 - 1.0;
        let y = 1.0 - ((pixel / width) as f64 + u[1]) / height as f64 * 2.0;
        let ViewBasis {
            origin,
            forward,
            right,
            up,
            lens,
        } = self.basis;
        let through = forward + right * x + up * y;
        let Some(lens) = lens else {
            return Ray::new(origin, through.normalize());
        };
        let [a, b] = shading::sample_disk(rng.next2());
        let off = (right.normalize() * a + up.normalize() * b) * f64::from(lens.radius);
        Ray::new(
            origin + off,
            (through - off / f64::from(lens.focus)).normalize(),
        )
    }

    /// Distance along the view direction to what the camera ray hit.
    fn view_depth(&self, path: &PathSample) -> f64 {
        path.first.map_or(0.0, |first| {
            (first.position - self.basis.origin).dot(self.basis.forward)
        })
    }
}

/// What is counted along the way.
#[derive(Clone, Debug, Default)]
struct Tally {
    counters: Counters,
    escapes: Vec<Escape>,
}

impl Tally {
    /// Counts one path.
    fn count(&mut self, path: &PathSample, is_finite: bool, pixel: usize, sample: u32) {
        self.counters.paths += 1;
        self.counters.rays += path.rays;
        self.counters.nonfinite += u64::from(!is_finite);
        if let Some(ray) = &path.escaped {
            self.counters.escaped += 1;
            if self.escapes.len() < ESCAPES_KEPT {
                self.escapes.push(Escape {
                    pixel: pixel as u32,
                    sample,
                    origin: ray.origin.as_vec3().to_array(),
                    direction: ray.direction.as_vec3().to_array(),
                });
            }
        }
    }

    /// Both, with the escapes of `self` first.
    fn and(mut self, other: Self) -> Self {
        self.escapes.extend(other.escapes);
        self.escapes.truncate(ESCAPES_KEPT);
        let (a, b) = (self.counters, other.counters);
        self.counters = Counters {
            paths: a.paths + b.paths,
            rays: a.rays + b.rays,
            nonfinite: a.nonfinite + b.nonfinite,
            escaped: a.escaped + b.escaped,
        };
        self
    }
}

/// `count` zeros, for a picture of `pixels` pixels.
fn zeroed<T: Clone + Default>(count: u64, pixels: u64) -> Result<Vec<T>, Error> {
    let out_of_memory = || Error::OutOfMemory(pixels);
    let count = usize::try_from(count).map_err(|_| out_of_memory())?;
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|_| out_of_memory())?;
    all.resize(count, T::default());
    Ok(all)
}
