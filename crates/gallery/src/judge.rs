//! What to think of a case's picture.

use crate::case::{Case, Escapes, Truth};
use scene::render::Film;

/// Standard errors that noise may explain. Every picture of the gallery on every device together
/// are some 300 numbers: by chance one is off by more than 4.5 in 500 runs.
pub const SIGMAS: f64 = 4.5;

/// What a picture is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// The case's truth as it stands.
    Truth,
    /// For [`Truth::Same`] and [`Truth::Judge`]: the other picture.
    Film(&'a Film),
}

/// A picture of a case, judged.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// Mean radiance of the picture, linear RGB.
    pub mean: [f64; 3],
    /// Expected mean radiance.
    pub expected: [f64; 3],
    /// Error of the mean, `mean - expected`, of the worst channel.
    pub error: f64,
    /// Half the width of the error's 95 % interval: 1.96 standard errors, those of a judge
    /// included.
    pub interval: f64,
    /// `error / expected`; 0 where both are.
    pub relative: f64,
    /// The error in standard errors; `None` where rounding outweighs the noise.
    pub z: Option<f64>,
    /// Rays per 10^9 that left the scene.
    pub escaped_per_billion: f64,
    /// What is wrong, a sentence each; empty if the case passed.
    pub failures: Vec<String>,
    /// What is wrong by no more than [`Line::astray`](crate::case::Line::astray) allows, a sentence each.
    pub allowed: Vec<String>,
}

impl Verdict {
    /// Whether nothing is wrong.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

impl Case {
    /// Judges a picture of the case, of any size and number of samples.
    #[must_use]
    pub fn judge(&self, film: &Film, target: Target<'_>) -> Verdict {
        let mut failures = Vec::new();
        let (mean, variance) = moments(film);
        let (expected, other_variance) = match (&self.truth, target) {
            (Truth::Radiance(rgb), _) => (*rgb, [0.0; 3]),
            (Truth::Black, _) => ([0.0; 3], [0.0; 3]),
            (Truth::Same(_), Target::Film(other)) => {
                compare_bits(film, other, &mut failures);
                (moments(other).0, [0.0; 3])
            }
            (Truth::Judge(_), Target::Film(other)) => moments(other),
            (Truth::Same(_) | Truth::Judge(_), Target::Truth) => {
                failures.push("there is no other picture to compare with".to_owned());
                ([f64::NAN; 3], [0.0; 3])
            }
        };
        let error = |c: usize| mean[c] - expected[c];
        let sigma = |c: usize| (variance[c] + other_variance[c]).sqrt();
        // Compared by how far beyond its allowance each channel is.
        let excess =
            |c: usize| error(c).abs() - self.line.relative * expected[c].abs() - SIGMAS * sigma(c);
        let worst = (0..3).fold(0, |w, c| if excess(c) > excess(w) { c } else { w });
        let relative = ratio(error(worst), expected[worst].abs());
        let interval = 1.96 * sigma(worst);
        // Not the complement: nothing must pass if it is not a number.
        let meets = excess(worst) <= 0.0;
        if !meets {
            failures.push(format!(
                "the mean is off by {relative:.2e} of {:.3e}, where noise explains {:.1e} and the \
                 line is {:.1e}",
                expected[worst],
                ratio(SIGMAS * sigma(worst), expected[worst].abs()),
                self.line.relative
            ));
        }
        let mut allowed = Vec::new();
        self.check_interval(film, interval, expected[worst], &mut failures);
        self.check_counters(film, &mut failures);
        let astray =
            (self.wrong_pixels(film, expected).into_iter()).chain(self.wrong_escapes(film));
        for (number, sentence) in astray {
            if number as f64 <= self.line.astray * 1e-9 * film.counters.rays as f64 {
                allowed.push(sentence);
            } else {
                failures.push(sentence);
            }
        }
        Verdict {
            mean,
            expected,
            error: error(worst),
            interval,
            relative,
            z: (sigma(worst) > 0.1 * self.line.relative * expected[worst].abs())
                .then(|| error(worst) / sigma(worst)),
            escaped_per_billion: 1e9 * film.counters.escaped as f64
                / film.counters.rays.max(1) as f64,
            failures,
            allowed,
        }
    }

    /// How many pixels are not what they must be, and a sentence about them.
    fn wrong_pixels(&self, film: &Film, expected: [f64; 3]) -> Option<(u64, String)> {
        let is_wrong = |pixel: &[f32; 3]| match self.truth {
            Truth::Black => *pixel != [0.0; 3],
            _ => (0..3).any(|c| {
                let off = (f64::from(pixel[c]) - expected[c]).abs();
                off.is_nan() || off > self.line.relative * expected[c].abs()
            }),
        };
        if !(self.line.every_pixel || matches!(self.truth, Truth::Black)) {
            return None;
        }
        let wrong = film.beauty.iter().filter(|p| is_wrong(p)).count();
        let first = film.beauty.iter().position(is_wrong)?;
        let sentence = format!(
            "{wrong} of {} pixels are wrong: pixel {first} is {:?}, not {expected:?}",
            film.beauty.len(),
            film.beauty[first]
        );
        Some((wrong as u64, sentence))
    }

    fn check_interval(
        &self,
        film: &Film,
        interval: f64,
        expected: f64,
        failures: &mut Vec<String>,
    ) {
        // Noise is beside the point where every sample must be right.
        if matches!(self.truth, Truth::Black | Truth::Same(_)) {
            return;
        }
        let fewer = (self.paths() as f64 / film.counters.paths.max(1) as f64).max(1.0);
        let allowed = self.line.interval * fewer.sqrt() * expected.abs();
        if interval > allowed {
            failures.push(format!(
                "the 95 % interval of {interval:.2e} is too wide to tell anything: {allowed:.2e} \
                 at most"
            ));
        }
    }

    fn check_counters(&self, film: &Film, failures: &mut Vec<String>) {
        let counters = film.counters;
        if counters.nonfinite > 0 {
            failures.push(format!("{} samples were not finite", counters.nonfinite));
        }
        let escaped = counters.escaped;
        let wrong = match self.escapes {
            Escapes::Some if escaped == 0 => "some must",
            Escapes::Always if escaped != counters.paths => "one of each path must",
            _ => return,
        };
        failures.push(format!(
            "{escaped} of {} rays left the scene, {wrong}",
            counters.rays
        ));
    }

    /// How many rays left a sealed scene, and a sentence about them.
    fn wrong_escapes(&self, film: &Film) -> Option<(u64, String)> {
        let counters = film.counters;
        let wrong = self.escapes == Escapes::Never && counters.escaped > 0;
        let sentence = || {
            format!(
                "{} of {} rays left the scene, none may",
                counters.escaped, counters.rays
            )
        };
        wrong.then(|| (counters.escaped, sentence()))
    }
}

/// `a / b`, and 0 where there is nothing to divide.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 && b == 0.0 { 0.0 } else { a / b }
}

/// Mean radiance of a picture and the variance of that mean.
fn moments(film: &Film) -> ([f64; 3], [f64; 3]) {
    let n = film.beauty.len().max(1) as f64;
    let variance = [0, 1, 2].map(|c| {
        let sum: f64 = film.variance.iter().map(|v| f64::from(v[c])).sum();
        sum / (n * n)
    });
    (film.mean_radiance(), variance)
}

fn compare_bits(film: &Film, other: &Film, failures: &mut Vec<String>) {
    let differ = (film.beauty.iter().zip(&other.beauty))
        .filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits))
        .count();
    if film.beauty.len() != other.beauty.len() || differ > 0 {
        failures.push(format!(
            "{differ} of {} pixels differ from those of the other level",
            film.beauty.len()
        ));
    }
    if film.beauty.iter().all(|p| *p == [0.0; 3]) {
        failures.push("the picture is black: any two black pictures are alike".to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder;
    use glam::Vec3;
    use scene::render::Counters;

    fn case(truth: Truth) -> Case {
        let camera = builder::camera(Vec3::ZERO, 0.0, 0.0, 90.0);
        Case::new("a", "b", truth, camera, || builder::Builder::new().build()).samples(2, 100)
    }

    fn film(value: f32, variance: f32) -> Film {
        Film {
            beauty: vec![[value; 3]; 4],
            variance: vec![[variance; 3]; 4],
            counters: Counters {
                paths: 400,
                rays: 1000,
                ..Counters::default()
            },
            ..Film::default()
        }
    }

    #[test]
    fn noise_is_forgiven_and_error_is_not() {
        let case = case(Truth::Radiance([2.0; 3]));
        // The mean of four pixels with a variance of 1e-4 has a standard error of 0.005.
        let verdict = case.judge(&film(2.02, 1e-4), Target::Truth);
        assert!(verdict.passed(), "{:?}", verdict.failures);
        let z = verdict.z.expect("noise");
        assert!((z - 4.0).abs() < 1e-3 && (verdict.relative - 0.01).abs() < 1e-6);
        assert!((verdict.interval - 0.0098).abs() < 1e-6);
        assert!(!case.judge(&film(2.03, 1e-4), Target::Truth).passed());
        // Rounding alone.
        let verdict = case.judge(&film(2.000_01, 0.0), Target::Truth);
        assert!(verdict.passed() && verdict.z.is_none());
        assert!(!case.judge(&film(2.0001, 0.0), Target::Truth).passed());
        // Too noisy to tell.
        assert!(!case.judge(&film(2.0, 1.0), Target::Truth).passed());
        assert!(!case.judge(&film(f32::NAN, 0.0), Target::Truth).passed());
    }

    #[test]
    fn black_is_black_in_every_pixel() {
        let case = case(Truth::Black);
        assert!(case.judge(&film(0.0, 0.0), Target::Truth).passed());
        let mut spot = film(0.0, 0.0);
        spot.beauty[3] = [0.0, 1e-30, 0.0];
        assert!(!case.judge(&spot, Target::Truth).passed());
    }

    #[test]
    fn the_same_is_the_same_bit_for_bit_and_not_black() {
        let case = case(Truth::Same(Box::new(|| builder::Builder::new().build())));
        let (a, b) = (
            film(1.0, 0.0),
            film(f32::from_bits(1.0_f32.to_bits() + 1), 0.0),
        );
        assert!(case.judge(&a, Target::Film(&a)).passed());
        assert!(!case.judge(&a, Target::Film(&b)).passed());
        let black = film(0.0, 0.0);
        assert!(!case.judge(&black, Target::Film(&black)).passed());
        assert!(!case.judge(&a, Target::Truth).passed());
    }

    #[test]
    fn a_judge_has_noise_of_its_own() {
        let case = case(Truth::Judge(1));
        let noisy = film(2.03, 3e-4);
        let close = film(2.0, 0.0);
        assert!(case.judge(&noisy, Target::Film(&close)).passed());
        assert!(!case.judge(&film(2.04, 0.0), Target::Film(&close)).passed());
        assert!(case.judge(&close, Target::Film(&noisy)).passed());
    }

    #[test]
    fn escapes_and_lost_samples_fail() {
        for (escapes, escaped, passes) in [
            (Escapes::Never, 0, true),
            (Escapes::Never, 1, false),
            (Escapes::Some, 0, false),
            (Escapes::Some, 1, true),
            (Escapes::Always, 399, false),
            (Escapes::Always, 400, true),
            (Escapes::Free, 7, true),
        ] {
            let case = case(Truth::Radiance([2.0; 3])).escapes(escapes);
            let mut film = film(2.0, 0.0);
            film.counters.escaped = escaped;
            let verdict = case.judge(&film, Target::Truth);
            assert_eq!(verdict.passed(), passes, "{escapes:?} {escaped}");
            assert!((verdict.escaped_per_billion - 1e6 * escaped as f64).abs() < 1e-3);
        }
        let mut film = film(2.0, 0.0);
        film.counters.nonfinite = 1;
        let case = case(Truth::Radiance([2.0; 3]));
        assert!(!case.judge(&film, Target::Truth).passed());
    }

    #[test]
    fn as_many_rays_as_a_case_says_may_go_astray() {
        let case = case(Truth::Radiance([2.0; 3]))
            .every_pixel()
            .astray(1.0, "it is hard");
        let mut lost = film(2.0, 0.0);
        lost.beauty[1] = [1.999_93; 3]; // more than the line for a pixel, less for the mean
        (lost.counters.escaped, lost.counters.rays) = (5, 4_000_000_000);
        let verdict = case.judge(&lost, Target::Truth);
        assert_eq!((verdict.failures.len(), verdict.allowed.len()), (1, 1));
        assert!(verdict.failures[0].contains("left the scene"));
        lost.counters.rays = 5_000_000_000;
        assert!(case.judge(&lost, Target::Truth).passed());
    }
}
