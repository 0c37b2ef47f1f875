//! A filter for noisy pictures that are looked at: the spatial half of SVGF.
//!
//! Schied et al., "Spatiotemporal Variance-Guided Filtering" (2017): light is parted from what it falls on, and
//! averaged with that of its neighbours, five times over wider and wider gaps (an "à-trous" wavelet, Dammertz et al. 2010), where
//! they lie in the same surface and differ by no more than noise explains. A picture is filtered by itself, without those before
//! it: whatever order frames are made in, they are the same.
//!
//! The result is biased and for looking: it is a layer of its own, and no error is measured on it. The GPU's twin is
//! `shaders/denoise_*.comp`, function for function; in the window it remembers, too, what the picture before knew
//! (`denoise_recall.comp`), where a picture has few samples.

use glam::Vec3;
use rayon::prelude::*;
use scene::material::luminance;
use scene::render::Film;

/// Whether a picture is filtered for looking at it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Denoise {
    /// As it was traced
    #[default]
    None,
    /// Light averaged within surfaces as far as noise reaches (variance-guided à-trous wavelet)
    Svgf,
}

impl Denoise {
    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Svgf => "svgf",
        }
    }

    /// Fills [`Film::denoised`] where that is asked for. The film has its layers then (`Settings::aovs`).
    pub fn apply(self, film: &mut Film) {
        film.denoised = match self {
            Self::None => Vec::new(),
            Self::Svgf => svgf(film),
        };
    }
}

/// Times that light is averaged, each over gaps twice as wide as the time before: 62 pixels to each side in all.
const LEVELS: u32 = 5;
/// Weights of a pixel, its neighbour and the next but one, of the cubic B-spline.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Differences of light, in standard deviations of its noise, at which a neighbour counts `1 / e`: the first number, and the
/// second divided by the square root of the samples, for the noise of few samples is not well known.
const SIGMA_LIGHT: [f32; 2] = [1.5, 2.5];
/// Power of the cosine between normals that a neighbour counts by.
const NORMAL_POWER: i32 = 128;
/// Light is that of a surface of at least this albedo: what black surfaces show is not blown up.
const LEAST_ALBEDO: f32 = 0.02;
/// From so many samples on a pixel's own samples tell its noise; with fewer its neighbours say more.
const SAMPLES_THAT_TELL: f32 = 4.0;
/// Pixels to each side that noise is looked for in.
const NOISE_REACH: i32 = 3;

/// What is seen in a pixel.
#[derive(Clone, Copy)]
struct Guide {
    /// Unit normal; 0 where nothing is.
    normal: Vec3,
    /// World space.
    position: Vec3,
    /// Units to the nearest of what the pixels beside it see.
    spacing: f32,
    /// Samples behind it.
    samples: f32,
}

/// Light on a surface of albedo 1 (radiance), and the variance of its luminance.
type Light = ([f32; 3], f32);

struct Picture<T> {
    width: i32,
    height: i32,
    at: Vec<T>,
}

impl<T: Copy + Send> Picture<T> {
    /// Made pixel by pixel, from its place.
    fn make(size: [u32; 2], pixel: impl Fn(i32, i32) -> T + Sync) -> Self {
        let [width, height] = size.map(|n| n as i32);
        let at = |i: i32| pixel(i % width, i / width);
        Self {
            width,
            height,
            at: (0..width * height).into_par_iter().map(at).collect(),
        }
    }

    fn get(&self, x: i32, y: i32) -> Option<T> {
        let inside = x >= 0 && y >= 0 && x < self.width && y < self.height;
        inside.then(|| self.at[(y * self.width + x) as usize])
    }
}

fn svgf(film: &Film) -> Vec<[f32; 3]> {
    let size = [film.width, film.height];
    let index = |x: i32, y: i32| y as usize * film.width as usize + x as usize;
    let albedo = |i: usize| film.albedo[i].map(|a| a.max(LEAST_ALBEDO));
    let guides = Picture::make(size, |x, y| guide(film, x, y));
    let parted = Picture::make(size, |x, y| {
        let (i, mut light, mut deviation) = (index(x, y), [0.0; 3], [0.0; 3]);
        for c in 0..3 {
            light[c] = (film.beauty[i][c] - film.emission[i][c]).max(0.0) / albedo(i)[c];
            deviation[c] = film.variance[i][c].max(0.0).sqrt() / albedo(i)[c];
        }
        // Noise is in all channels alike: lights are mostly white.
        (light, luminance(deviation).powi(2))
    });
    let mut lights = Picture::make(size, |x, y| {
        let (light, _) = parted.at[index(x, y)];
        let noise = noise(&parted, &guides, x, y);
        (light, noise)
    });
    for level in 0..LEVELS {
        lights = Picture::make(size, |x, y| average(&lights, &guides, 1 << level, x, y));
    }
    let whole = |i: usize| {
        let (light, _) = lights.at[i];
        [0, 1, 2].map(|c| film.emission[i][c] + light[c] * albedo(i)[c])
    };
    (0..film.beauty.len()).into_par_iter().map(whole).collect()
}

fn guide(film: &Film, x: i32, y: i32) -> Guide {
    let (width, height) = (film.width as i32, film.height as i32);
    let position = |x: i32, y: i32| Vec3::from(film.position[(y * width + x) as usize]);
    let (i, here) = ((y * width + x) as usize, position(x, y));
    let mut spacing = f32::INFINITY;
    for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
        let (x, y) = (x + dx, y + dy);
        if x >= 0 && y >= 0 && x < width && y < height {
            spacing = spacing.min(position(x, y).distance(here));
        }
    }
    Guide {
        normal: Vec3::from(film.normal[i]).normalize_or_zero(),
        position: here,
        spacing,
        samples: (film.sample_counts.get(i)).map_or(film.samples, |&n| n) as f32,
    }
}

/// How far `there` belongs to the surface of `here`, 0 to 1: alike in direction, and no farther off its plane than its pixels
/// are apart.
fn alike(here: &Guide, there: &Guide) -> f32 {
    let cos = here.normal.dot(there.normal).max(0.0);
    let off = here.normal.dot(there.position - here.position).abs();
    cos.powi(NORMAL_POWER) * (-off / (here.spacing + 1e-6)).exp()
}

/// Variance of a pixel's luminance: that of its neighbours' samples where there are many, the spread of its neighbours
/// where there are few.
fn noise(parted: &Picture<Light>, guides: &Picture<Guide>, x: i32, y: i32) -> f32 {
    let here = guides.at[(y * guides.width + x) as usize];
    let (mut weights, mut sum, mut squares, mut variances) = (0.0, 0.0, 0.0, 0.0);
    for dy in -NOISE_REACH..=NOISE_REACH {
        for dx in -NOISE_REACH..=NOISE_REACH {
            let place = (x + dx, y + dy);
            let there = guides
                .get(place.0, place.1)
                .zip(parted.get(place.0, place.1));
            let Some((guide, (light, variance))) = there else {
                continue;
            };
            let is_here = dx == 0 && dy == 0;
            let weight = if is_here { 1.0 } else { alike(&here, &guide) };
            let l = luminance(light);
            weights += weight;
            sum += weight * l;
            squares += weight * l * l;
            variances += weight * variance;
        }
    }
    let mean = sum / weights;
    let spread = (squares / weights - mean * mean).max(0.0);
    let told = ((here.samples - 1.0) / (SAMPLES_THAT_TELL - 1.0)).clamp(0.0, 1.0);
    spread + told * (variances / weights - spread)
}

/// Light averaged with that of the pixels so many apart, and its variance then.
fn average(lights: &Picture<Light>, guides: &Picture<Guide>, gap: i32, x: i32, y: i32) -> Light {
    let i = (y * guides.width + x) as usize;
    let (here, (light, variance)) = (guides.at[i], lights.at[i]);
    let own = luminance(light);
    let sigmas = SIGMA_LIGHT[0] + SIGMA_LIGHT[1] / here.samples.max(1.0).sqrt();
    let deviation = sigmas * variance_about(lights, x, y).sqrt() + 1e-6;
    let weight = KERNEL[0] * KERNEL[0];
    let mut weights = weight;
    let mut sum = light.map(|c| weight * c);
    let mut variances = weight * weight * variance;
    for dy in -2..=2_i32 {
        for dx in -2..=2_i32 {
            let place = (x + gap * dx, y + gap * dy);
            let there = guides
                .get(place.0, place.1)
                .zip(lights.get(place.0, place.1));
            let Some((guide, (light, variance))) = there.filter(|_| dx != 0 || dy != 0) else {
                continue;
            };
            let differs = (luminance(light) - own).abs() / deviation;
            let near = KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize];
            let weight = near * alike(&here, &guide) * (-differs).exp();
            weights += weight;
            (0..3).for_each(|c| sum[c] += weight * light[c]);
            variances += weight * weight * variance;
        }
    }
    (sum.map(|c| c / weights), variances / (weights * weights))
}

/// Variance about a pixel, by a binomial filter: that of one pixel is too noisy itself.
fn variance_about(lights: &Picture<Light>, x: i32, y: i32) -> f32 {
    let (mut weights, mut sum) = (0.0, 0.0);
    for dy in -1..=1_i32 {
        for dx in -1..=1_i32 {
            if let Some((_, variance)) = lights.get(x + dx, y + dy) {
                let weight = (2 - dx.abs()) as f32 * (2 - dy.abs()) as f32;
                weights += weight;
                sum += weight * variance;
            }
        }
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: u32 = 64;

    /// A floor on the left and a wall on the right, both textured, in light that `light` gives by the pixel's number; with lamps
    /// in a corner. `samples` of a standard deviation of `noise` times the light are behind each pixel.
    fn film(samples: u32, noise: f32, light: impl Fn(u32, u32) -> f32) -> (Film, Vec<[f32; 3]>) {
        let mut state = 7_u64;
        // About normal: the sum of twelve uniform numbers.
        let mut normal = || {
            let mut uniform = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 40) as f32 / (1 << 24) as f32
            };
            (0..12).map(|_| uniform()).sum::<f32>() - 6.0
        };
        let mut film = Film {
            width: SIZE,
            height: SIZE,
            samples,
            ..Film::default()
        };
        let mut truth = Vec::new();
        for (y, x) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (y, x))) {
            let is_floor = x < SIZE / 2;
            let along = x as f32 - SIZE as f32 / 2.0;
            let [z, depth] = if is_floor { [0.0, along] } else { [along, 0.0] };
            film.position.push([depth, y as f32, z]);
            film.normal.push(if is_floor {
                [0.0, 0.0, 1.0]
            } else {
                [-1.0, 0.0, 0.0]
            });
            let texel = [0.1, 0.3, 0.8][((x / 3 + y / 5) % 3) as usize];
            film.albedo.push([texel, 0.5 * texel, 0.25]);
            let shines = x > 56 && y < 8;
            film.emission
                .push(if shines { [9.0, 5.0, 1.0] } else { [0.0; 3] });
            let (light, albedo) = (light(x, y), film.albedo[truth.len()]);
            let emission = film.emission[truth.len()];
            truth.push([0, 1, 2].map(|c| emission[c] + light * albedo[c]));
            let deviation = noise * light / (samples as f32).sqrt();
            let seen = light + deviation * normal();
            film.beauty
                .push([0, 1, 2].map(|c| emission[c] + seen * albedo[c]));
            film.variance.push(albedo.map(|a| (a * deviation).powi(2)));
        }
        (film, truth)
    }

    fn error(picture: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
        let of = |(p, t): (&[f32; 3], &[f32; 3])| {
            let square = |c: usize| f64::from(p[c] - t[c]).powi(2);
            (0..3).map(square).sum::<f64>()
        };
        picture.iter().zip(truth).map(of).sum::<f64>() / truth.len() as f64
    }

    #[test]
    fn a_picture_without_noise_stays_as_it_is() {
        // With steps and slopes, as shadows have.
        let light =
            |x: u32, y: u32| 0.5 + y as f32 / 20.0 + if (x + y) % 32 < 11 { 2.0 } else { 0.0 };
        let (mut film, truth) = film(64, 0.0, light);
        let traced = film.beauty.clone();
        Denoise::Svgf.apply(&mut film);
        for (p, t) in film.picture().iter().zip(&truth) {
            assert!(
                (0..3).all(|c| (p[c] - t[c]).abs() < 1e-4 * (1.0 + t[c])),
                "{p:?}, not {t:?}"
            );
        }
        assert_eq!(film.beauty, traced, "what was traced is not touched");
        Denoise::None.apply(&mut film);
        assert_eq!(film.picture(), traced);
    }

    #[test]
    fn noise_goes_and_surfaces_textures_and_lamps_stay() {
        for (samples, better) in [(1, 40.0), (4, 40.0), (64, 15.0)] {
            let light = |x: u32, _| if x < SIZE / 2 { 0.5 } else { 2.0 };
            let (mut film, truth) = film(samples, 0.5, light);
            Denoise::Svgf.apply(&mut film);
            let [before, after] = [&film.beauty, &film.denoised].map(|p| error(p, &truth));
            assert!(after * better < before, "{samples}: {before} to {after}");
            let mean = |p: &[[f32; 3]]| p.iter().map(|c| f64::from(c[1])).sum::<f64>();
            let kept = mean(&film.denoised) / mean(&truth);
            assert!((kept - 1.0).abs() < 0.01, "{samples}: {kept} of the light");
        }
    }

    #[test]
    fn what_is_not_there_takes_and_gives_no_light() {
        let (mut film, _) = film(1, 0.5, |_, _| 1.0);
        for i in 0..10 * SIZE as usize {
            film.normal[i] = [0.0; 3];
            film.position[i] = [0.0; 3];
            film.emission[i] = film.beauty[i];
        }
        Denoise::Svgf.apply(&mut film);
        let count = 10 * SIZE as usize;
        for (p, b) in film.denoised[..count].iter().zip(&film.beauty) {
            assert!(
                (0..3).all(|c| (p[c] - b[c]).abs() < 1e-6),
                "{p:?}, not {b:?}"
            );
        }
        assert!(film.denoised.iter().flatten().all(|c| c.is_finite()));
    }
}
