//! What a renderer is asked, and what it answers.

use crate::camera::Camera;

/// How light is found. All converge to the same picture, except that `naive` and `uniform` can't
/// find light entities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Estimator {
    /// Cosine-distributed directions (normal plus a point on the unit sphere), light by hitting it.
    Naive,
    /// Uniform directions over the hemisphere, light by hitting it.
    Uniform,
    /// Light sampling alone; emission counts only where the camera sees it directly.
    Nee,
    /// Light sampling and direction sampling, weighted by the balance heuristic (Veach 1997).
    Mis,
}

impl Estimator {
    /// All estimators, in order of sophistication.
    pub const ALL: [Self; 4] = [Self::Naive, Self::Uniform, Self::Nee, Self::Mis];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Naive => "naive",
            Self::Uniform => "uniform",
            Self::Nee => "nee",
            Self::Mis => "mis",
        }
    }

    /// Whether lights are sampled, so that light entities are found.
    #[must_use]
    pub fn samples_lights(self) -> bool {
        matches!(self, Self::Nee | Self::Mis)
    }
}

/// How a light is chosen where light is sampled. All have the same expectation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Selection {
    /// In proportion to the estimated power, by one alias table over the level.
    #[default]
    Power,
    /// Every emissive triangle and every point light alike.
    Uniform,
}

impl Selection {
    /// All selections.
    pub const ALL: [Self; 2] = [Self::Power, Self::Uniform];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Power => "power",
            Self::Uniform => "uniform",
        }
    }
}

/// Everything a picture depends on besides the scene.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels across, > 0.
    pub width: u32,
    /// Pixels down, > 0.
    pub height: u32,
    /// Where from.
    pub camera: Camera,
    /// How light is found.
    pub estimator: Estimator,
    /// How lights are chosen by the estimators that sample them.
    pub selection: Selection,
    /// Path vertices after the camera: 1 is emission seen directly, 2 adds direct light on seen
    /// surfaces, and so on; 0 is unlimited with Russian roulette.
    pub depth: u32,
    /// Level time in seconds, for warped and scrolling textures.
    pub time: f32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether the layers besides beauty and variance are wanted.
    pub aovs: bool,
}

/// Russian roulette starts after this many path vertices when the depth is unlimited.
pub const ROULETTE_START: u32 = 3;
/// Largest probability to survive Russian roulette: a path always ends.
pub const ROULETTE_MAX_SURVIVAL: f64 = 0.95;

/// What was counted while rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Paths begun at the camera.
    pub paths: u64,
    /// Rays traced: camera, bounce and shadow rays.
    pub rays: u64,
    /// Path samples whose radiance was not finite; they add nothing to the picture.
    pub nonfinite: u64,
    /// Camera and bounce rays that hit nothing at all.
    pub escaped: u64,
}

/// A camera or bounce ray that left the scene without hitting anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Escape {
    /// The pixel's number, rows from the top.
    pub pixel: u32,
    /// Which of the pixel's samples it belongs to, from 0.
    pub sample: u32,
    /// Where the ray began, world space.
    pub origin: [f32; 3],
    /// Its direction, a unit vector.
    pub direction: [f32; 3],
    /// The level's number of the face it began on; `None` for a camera ray.
    pub face: Option<u32>,
}

/// Escapes that a renderer keeps; it counts them all.
pub const ESCAPES_KEPT: usize = 100;

/// A finished or partial picture, as means over the samples taken so far.
///
/// Every plane has `width * height` entries, rows from the top. Planes that were not asked for are
/// empty. Where a camera ray hit nothing, first-hit planes hold 0.
#[derive(Clone, Debug, Default)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples per pixel behind these means; their rounded mean if pixels differ.
    pub samples: u32,
    /// Samples of each pixel; empty if all have [`Film::samples`].
    pub sample_counts: Vec<u32>,
    /// Radiance; `emission + direct + indirect` up to rounding.
    pub beauty: Vec<[f32; 3]>,
    /// Variance of the mean radiance (sample variance divided by the number of samples).
    pub variance: Vec<[f32; 3]>,
    /// Radiance emitted towards the camera by what it sees (path vertex 1).
    pub emission: Vec<[f32; 3]>,
    /// Light that was reflected once (emitters at path vertex 2, and light entities).
    pub direct: Vec<[f32; 3]>,
    /// Light that was reflected more than once.
    pub indirect: Vec<[f32; 3]>,
    /// Albedo at the first hit.
    pub albedo: Vec<[f32; 3]>,
    /// Normal at the first hit towards the camera, world space; a mean, not normalised.
    pub normal: Vec<[f32; 3]>,
    /// First hit, world space.
    pub position: Vec<[f32; 3]>,
    /// Distance along the view direction to the first hit, world units.
    pub depth: Vec<f32>,
    /// 1 + number of the level's face hit by the pixel's first sample; 0 where it hit nothing.
    /// Faces of instances are numbered like the file's.
    pub id: Vec<u32>,
    /// What was counted.
    pub counters: Counters,
    /// The first escapes, at most [`ESCAPES_KEPT`], in order of pixel and sample. Which ones are
    /// first where there are more is up to the device.
    pub escapes: Vec<Escape>,
}

impl Film {
    /// Mean radiance of the picture, linear RGB.
    #[must_use]
    pub fn mean_radiance(&self) -> [f64; 3] {
        let n = self.beauty.len().max(1) as f64;
        [0, 1, 2].map(|c| self.beauty.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
    }

    /// Estimated relMSE of the picture against the truth: the mean over pixels and channels of
    /// `variance / (mean^2 + 0.01)`. Infinite with fewer than two samples.
    #[must_use]
    pub fn estimated_relmse(&self) -> f64 {
        if self.samples < 2 || self.variance.is_empty() {
            return f64::INFINITY;
        }
        let sum: f64 = self
            .beauty
            .iter()
            .zip(&self.variance)
            .flat_map(|(b, v)| (0..3).map(move |c| (f64::from(b[c]), f64::from(v[c]))))
            .map(|(mean, variance)| variance / (mean * mean + 1e-2))
            .sum();
        sum / (3 * self.beauty.len()) as f64
    }
}

/// A renderer that adds samples to a picture. The film is valid after every call.
pub trait Renderer {
    /// What carries the error; for people.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Adds `samples` samples to every pixel.
    ///
    /// The same scene, settings and total give the same picture bit for bit on the same device,
    /// however the total is split into calls that do not change between runs.
    ///
    /// # Errors
    /// When the device fails.
    fn accumulate(&mut self, samples: u32) -> Result<(), Self::Error>;

    /// Adds `samples[i]` samples to pixel `i`, rows from the top: `width * height` numbers.
    ///
    /// A pixel's samples are numbered in the order they are taken, whichever call takes them: a
    /// pixel that gets as many by one way as by the other gets the same mean.
    ///
    /// # Errors
    /// When the device fails.
    ///
    /// # Panics
    /// When there are not as many numbers as pixels.
    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<(), Self::Error>;

    /// The picture so far.
    ///
    /// # Errors
    /// When the device fails.
    fn film(&mut self) -> Result<Film, Self::Error>;

    /// Estimated relMSE so far, without reading back more than it needs; see
    /// [`Film::estimated_relmse`].
    ///
    /// # Errors
    /// When the device fails.
    fn estimated_relmse(&mut self) -> Result<f64, Self::Error> {
        Ok(self.film()?.estimated_relmse())
    }
}
