//! What a renderer is asked, and what it answers.

use crate::camera::Camera;
use crate::frame::Frame;
use crate::light::LightStyle;

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
    Power,
    /// Every emitter and every point light alike.
    Uniform,
    /// By the tree over all lights ([`crate::emitter::LightTree`]): power, distance and the
    /// direction lights face, for very many lights in one place.
    Tree,
    /// By the lists of [`crate::LightCells`]: what may be seen from where, by power over squared
    /// distance, and in a tenth of the cases by power. By the tree where there is no list, or too
    /// much would be missing in it.
    #[default]
    Leaf,
}

impl Selection {
    /// All selections.
    pub const ALL: [Self; 4] = [Self::Power, Self::Uniform, Self::Tree, Self::Leaf];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Power => "power",
            Self::Uniform => "uniform",
            Self::Tree => "tree",
            Self::Leaf => "leaf",
        }
    }
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sampler {
    /// All independent: the spread of a pixel's samples tells the error of their mean.
    #[default]
    Independent,
    /// Owen-scrambled Sobol' points: a pixel's samples fill the space of paths evenly. The error is
    /// smaller than their spread tells.
    Sobol,
}

impl Sampler {
    /// All samplers.
    pub const ALL: [Self; 2] = [Self::Independent, Self::Sobol];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }
}

/// Everything a picture depends on besides the scene.
#[derive(Clone, Debug, PartialEq)]
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
    /// Light samples of which one is kept and looked at, 1 to [`MOST_CANDIDATES`]: in proportion to
    /// what each would add to the picture. See [`GUESSES_PER_CANDIDATE`], too.
    pub candidates: u32,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Path vertices after the camera: 1 is emission seen directly, 2 adds direct light on seen
    /// surfaces, and so on; 0 is unlimited with Russian roulette.
    pub depth: u32,
    /// Level time in seconds, for warped and scrolling textures.
    pub time: f32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether the layers besides beauty and variance are wanted.
    pub aovs: bool,
    /// Most that a path sample may add beyond what the camera sees shine, as its largest channel: a
    /// brighter one is darkened to it, and the film counts what is lost ([`Film::clamped`]). A number
    /// above 0. Without effect in scenes that tell light styles apart, whose light is summed by parts.
    pub clamp: Option<f32>,
}

/// On surfaces with a list of lights ([`crate::cells`]) so many times [`Settings::candidates`] lights are
/// weighed by what each may add ([`crate::emitter::LightBounds`]), and a point is sampled on one of them only: one
/// of them from the table over all, the others from the list. Not with 1 candidate, which is plain choice.
pub const GUESSES_PER_CANDIDATE: u32 = 4;
/// Most [`Settings::candidates`].
pub const MOST_CANDIDATES: u32 = 32;
/// [`Settings::candidates`] where nothing says otherwise.
pub const CANDIDATES: u32 = 4;

/// Where lights are sampled, a path goes on with this many times the largest component of its throughput
/// as probability, at most 1: what it would find after dark surfaces is not worth the way. In levels
/// of dark textures a path has two vertices instead of eight.
pub const ROULETTE_GAIN: f64 = 4.0;
/// From this path vertex on any path of unlimited depth may end.
pub const ROULETTE_START: u32 = 3;
/// Largest probability to survive then: a path always ends.
pub const ROULETTE_MAX_SURVIVAL: f64 = 0.95;

/// What a picture lost to [`Settings::clamp`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamped {
    /// Radiance that was taken off: with the picture's mean it makes that of the same samples
    /// without a clamp. Mean over the pixels, linear RGB.
    pub lost: [f64; 3],
    /// Samples that were darkened.
    pub samples: u64,
}

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
    /// The picture without its noise, for looking at: what a filter made of the other layers. Empty unless one did;
    /// renderers have none.
    pub denoised: Vec<[f32; 3]>,
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
    /// Where the first hit was in the picture before, less where it is, in pixels to the right and down
    /// ([`Frame::before`]). Without a picture before, and where there is no such place, 0.
    pub motion: Vec<[f32; 2]>,
    /// 1 + number of the level's face hit by the pixel's first sample; 0 where it hit nothing.
    /// Faces of instances are numbered like the file's.
    pub id: Vec<u32>,
    /// Light of each light style as it were at brightness 1, if the scene tells them apart
    /// (`Scene::styles`): the sum over brightness times layer is the beauty.
    pub styles: Vec<StyleLayer>,
    /// What was lost to a clamp, if there is one.
    pub clamped: Option<Clamped>,
    /// What was counted.
    pub counters: Counters,
    /// The first escapes, at most [`ESCAPES_KEPT`], in order of pixel and sample. Which ones are
    /// first where there are more is up to the device.
    pub escapes: Vec<Escape>,
}

/// Share of the light that sums in single precision may lose.
const ROUNDING: f64 = 1e-5;

/// The light of one light style.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StyleLayer {
    /// Number of the style.
    pub number: u16,
    /// Its brightness in the beauty.
    pub brightness: f32,
    /// Radiance at brightness 1.
    pub radiance: Vec<[f32; 3]>,
}

impl StyleLayer {
    /// The layers of all `styles` from those of all but the first, whose layer is what they leave of
    /// the beauty, or nothing where that is no more than rounding.
    #[must_use]
    pub fn all(
        styles: &[LightStyle],
        beauty: &[[f32; 3]],
        but_first: impl IntoIterator<Item = Vec<[f32; 3]>>,
    ) -> Vec<Self> {
        let Some((first, others)) = styles.split_first() else {
            return Vec::new();
        };
        let others: Vec<Self> = (others.iter().zip(but_first))
            .map(|(style, radiance)| Self {
                number: style.number,
                brightness: style.brightness,
                radiance,
            })
            .collect();
        let rest = |i: usize, c: usize| {
            let styled: f64 = (others.iter())
                .map(|s| f64::from(s.brightness) * f64::from(s.radiance[i][c]))
                .sum();
            let beauty = f64::from(beauty[i][c]);
            let rest = beauty - styled;
            let is_rounding = rest.abs() <= ROUNDING * beauty.abs().max(styled.abs());
            if is_rounding { 0.0 } else { rest as f32 }
        };
        let steady = Self {
            number: first.number,
            brightness: first.brightness,
            radiance: (0..beauty.len())
                .map(|i| [0, 1, 2].map(|c| rest(i, c)))
                .collect(),
        };
        std::iter::once(steady).chain(others).collect()
    }
}

impl Film {
    /// What is looked at: the picture without its noise if there is one, else the beauty.
    #[must_use]
    pub fn picture(&self) -> &[[f32; 3]] {
        if self.denoised.is_empty() {
            &self.beauty
        } else {
            &self.denoised
        }
    }

    /// Mean radiance of the picture, linear RGB.
    #[must_use]
    pub fn mean_radiance(&self) -> [f64; 3] {
        let n = self.beauty.len().max(1) as f64;
        [0, 1, 2].map(|c| self.beauty.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
    }

    /// Share of the light, as luminance, that was lost to a clamp; 0 without one. This is the bias of
    /// the picture's mean, but for the noise of its samples.
    #[must_use]
    pub fn clamped_share(&self) -> f64 {
        let Some(Clamped { lost, .. }) = self.clamped else {
            return 0.0;
        };
        let luminance = |[r, g, b]: [f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let lost = luminance(lost);
        let all = lost + luminance(self.mean_radiance());
        if all > 0.0 { lost / all } else { 0.0 }
    }

    /// Estimated relMSE of the picture against the truth: the mean over pixels and channels of
    /// `variance / (mean^2 + 0.01)`. Infinite while a pixel has fewer than two samples.
    ///
    /// A pixel's own mean would not do: where its samples happened to find much light, variance
    /// and mean are large together, where they found none both are 0, and the quotient reads low
    /// (by two thirds at 4 samples, a quarter at 16). So the mean is drawn towards that of the
    /// eight neighbours by as much as noise can explain their difference, as James and Stein (1961)
    /// do: all the way where the neighbours vary less among themselves than this pixel's noise,
    /// not at all where its own mean differs from theirs by more than its noise. With few samples
    /// it reads high where bright lines are a pixel wide.
    #[must_use]
    pub fn estimated_relmse(&self) -> f64 {
        let (width, height) = (self.width as usize, self.height as usize);
        let is_unsure = self.samples < 2 || self.sample_counts.iter().any(|&n| n < 2);
        if is_unsure || self.variance.is_empty() {
            return f64::INFINITY;
        }
        let mut sum = 0.0;
        for y in 0..height {
            for x in 0..width {
                for c in 0..3 {
                    let variance = f64::from(self.variance[y * width + x][c]);
                    if variance > 0.0 {
                        let mean = self.likely_mean(x, y, c, variance);
                        sum += variance / (mean * mean + RELMSE_EPSILON);
                    }
                }
            }
        }
        sum / (3 * width * height) as f64
    }

    /// A pixel's mean in one channel, drawn towards its neighbours' as [`Self::estimated_relmse`]
    /// says; `variance` is its own.
    fn likely_mean(&self, x: usize, y: usize, c: usize, variance: f64) -> f64 {
        let (width, height) = (self.width as usize, self.height as usize);
        let (mut n, mut mean, mut squares, mut noise) = (0.0, 0.0, 0.0, 0.0);
        for j in y.saturating_sub(1)..(y + 2).min(height) {
            for i in x.saturating_sub(1)..(x + 2).min(width) {
                if (i, j) != (x, y) {
                    let value = f64::from(self.beauty[j * width + i][c]);
                    n += 1.0;
                    mean += value;
                    squares += value * value;
                    noise += f64::from(self.variance[j * width + i][c]);
                }
            }
        }
        let own = f64::from(self.beauty[y * width + x][c]);
        let n = f64::max(n, 1.0);
        let mean = mean / n;
        if (own - mean).powi(2) > 2.0 * variance {
            return own;
        }
        let spread = (squares / n - mean * mean - noise / n).max(0.0);
        mean + spread / (spread + variance) * (own - mean)
    }
}

/// Added to the squared reference in relMSE, so that black pixels do not decide it.
pub const RELMSE_EPSILON: f64 = 1e-2;

/// A renderer that adds samples to a picture. The film is valid after every call.
pub trait Renderer {
    /// What carries the error; for people.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Adds `samples` samples to every pixel. It may return before the device has taken the last of them
    /// ([`Renderer::finish`]).
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

    /// Shows another moment: samples taken from now on see it, with its camera and its time. Those
    /// taken before stay in the picture, so that moments within a shutter's interval add up to motion
    /// blur; for a new picture, [`Renderer::restart`]. Of a scene made by [`crate::Scene::for_frames`].
    ///
    /// # Errors
    /// When the frame contradicts the scene, or the device fails.
    fn show(&mut self, frame: &Frame) -> Result<(), Self::Error>;

    /// Begins a new picture of the moment shown last: an empty film, and the seed of its samples.
    ///
    /// # Errors
    /// When the device fails.
    fn restart(&mut self, seed: u64) -> Result<(), Self::Error>;

    /// Waits until all samples asked for are taken: for whoever reads a clock.
    ///
    /// # Errors
    /// When the device fails.
    fn finish(&mut self) -> Result<(), Self::Error>;

    /// The picture so far.
    ///
    /// # Errors
    /// When the device fails.
    fn film(&mut self) -> Result<Film, Self::Error>;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of 48 x 48 pixels whose samples are `a`, and `51 a` once in 50: half the light comes
    /// from rare samples. `a` is 0.05 on the left and 1 on the right. Also the true mean.
    fn rare(samples: u32) -> (Film, Vec<f64>) {
        let size = 48;
        let base = |i: u32| if i % size >= 20 { 1.0 } else { 0.05 };
        let mut state = 1u64;
        let mut uniform = || {
            state = (state.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let n = samples as f32;
        let (beauty, variance) = (0..size * size)
            .map(|i| {
                let rare = (0..samples).filter(|_| uniform() < 0.02).count() as f32;
                let (mean, jump) = (base(i) * (1.0 + 50.0 * rare / n), 50.0 * base(i));
                let squares = rare * (1.0 - rare / n) * jump * jump;
                ([mean; 3], [squares / (n * (n - 1.0)); 3])
            })
            .unzip();
        let film = Film {
            width: size,
            height: size,
            samples,
            beauty,
            variance,
            ..Film::default()
        };
        let truth = (0..size * size).map(|i| 2.0 * f64::from(base(i)));
        (film, truth.collect())
    }

    #[test]
    fn the_estimated_error_is_the_error_before_every_pixel_has_found_its_light() {
        for samples in [16, 64] {
            let (film, truth) = rare(samples);
            let n = truth.len() as f64;
            let error: f64 = (film.beauty.iter().zip(&truth))
                .map(|(b, t)| (f64::from(b[0]) - t).powi(2) / (t * t + RELMSE_EPSILON))
                .sum();
            let ratio = film.estimated_relmse() / (error / n);
            assert!((0.7..1.4).contains(&ratio), "{ratio} at {samples} samples");
            // Each pixel's own mean as the judge of its own variance says too little.
            let own: f64 = (film.beauty.iter().zip(&film.variance))
                .map(|(b, v)| f64::from(v[0]) / (f64::from(b[0]).powi(2) + RELMSE_EPSILON))
                .sum();
            assert!(own < 0.8 * error, "{own} for {error} at {samples} samples");
        }
        let mut film = rare(4).0;
        film.samples = 1;
        assert_eq!(film.estimated_relmse(), f64::INFINITY);
        film.samples = 4;
        film.sample_counts = vec![4; 48 * 48];
        film.sample_counts[7] = 1;
        assert_eq!(film.estimated_relmse(), f64::INFINITY);
    }
}
