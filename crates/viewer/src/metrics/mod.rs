//! How far a picture is from its reference.

pub mod flip;

use crate::bench::stats::{mean_and_error, t_quantile};
use crate::picture::Picture;
use crate::tonemap::{Tonemap, display};
use flip::PIXELS_PER_DEGREE;

/// Added to denominators, so that black pixels do not decide a relative error.
pub const EPSILON: f64 = scene::render::RELMSE_EPSILON;

/// Errors of an image against a reference, over linear radiance.
///
/// Means run over pixels and channels; pixels where either picture is not finite are left out and
/// counted. With no pixel left every mean is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Metrics {
    /// Mean of `(I - R)^2`.
    pub mse: f64,
    /// Square root of `mse`.
    pub rmse: f64,
    /// Mean of `(I - R)^2 / (R^2 + 1e-2)`.
    pub relmse: f64,
    /// Mean of `|I - R| / (|R| + 1e-2)`.
    pub mape: f64,
    /// Mean of `|I - R| / (|I| + |R| + 1e-2)`, 0..=1.
    pub smape: f64,
    /// Mean LDR-FLIP error after the default tone mapping, at 67 pixels per degree.
    pub flip: f64,
    /// Mean of `I` divided by the mean of `R`.
    pub mean_ratio: f64,
    /// Largest `|I - R|`.
    pub max_abs: f64,
    /// Pixels where a channel of either picture is NaN or infinite.
    pub nonfinite: u64,
    /// Pixels of the picture.
    pub pixels: u64,
    /// 95 % confidence intervals of the means above, by name; see [`compare`].
    pub ci95: Vec<(&'static str, [f64; 2])>,
}

/// The names of the metrics, as in JSON.
pub const NAMES: [&str; 10] = [
    "mse",
    "rmse",
    "relmse",
    "mape",
    "smape",
    "flip",
    "mean_ratio",
    "max_abs",
    "nonfinite",
    "pixels",
];

impl Metrics {
    /// All metrics in the order of [`NAMES`].
    #[must_use]
    pub fn values(&self) -> [(&'static str, f64); 10] {
        let values = [
            self.mse,
            self.rmse,
            self.relmse,
            self.mape,
            self.smape,
            self.flip,
            self.mean_ratio,
            self.max_abs,
            self.nonfinite as f64,
            self.pixels as f64,
        ];
        std::array::from_fn(|i| (NAMES[i], values[i]))
    }
}

/// Compares `image` with `reference` and returns the errors and the FLIP error of every pixel.
///
/// The confidence intervals are `mean +- 1.96 standard errors`, taking pixels as independent
/// draws (a pixel's three channels are one draw). They say how well the mean over these pixels is
/// known when noise is the error; `rmse` and `mean_ratio` by the delta method. FLIP's filters tie
/// neighbouring pixels together: its interval is Student's over the means of tiles that are wider
/// than the filters reach, and pictures with fewer than 9 such tiles have none.
///
/// # Errors
/// When the sizes differ; the sentence gives both.
pub fn compare(reference: &Picture, image: &Picture) -> Result<(Metrics, Vec<f32>), String> {
    let (width, height) = (reference.width, reference.height);
    if (width, height) != (image.width, image.height) {
        return Err(format!(
            "the reference is {width}x{height} pixels and the image {}x{}",
            image.width, image.height
        ));
    }
    let mut sums: [Moments; 4] = Default::default();
    let mut ratio = RatioMoments::default();
    let (mut max_abs, mut nonfinite) = (0.0f64, 0u64);
    for (r, i) in reference.radiance.iter().zip(&image.radiance) {
        if !r.iter().chain(i).all(|v| v.is_finite()) {
            nonfinite += 1;
            continue;
        }
        let mut pixel = [0.0; 4];
        let (mut r_mean, mut i_mean) = (0.0, 0.0);
        for (r, i) in r.iter().zip(i).map(|(r, i)| (f64::from(*r), f64::from(*i))) {
            let error = (i - r).abs();
            pixel[0] += error * error / 3.0;
            pixel[1] += error * error / (r * r + EPSILON) / 3.0;
            pixel[2] += error / (r.abs() + EPSILON) / 3.0;
            pixel[3] += error / (i.abs() + r.abs() + EPSILON) / 3.0;
            max_abs = max_abs.max(error);
            r_mean += r / 3.0;
            i_mean += i / 3.0;
        }
        sums.iter_mut().zip(pixel).for_each(|(s, v)| s.add(v));
        ratio.add(r_mean, i_mean);
    }
    let errors = flip::flip(
        &display_codes(reference),
        &display_codes(image),
        width,
        height,
        PIXELS_PER_DEGREE,
    );
    let [mse, relmse, mape, smape] = &sums;
    let interval = |m: &Moments| {
        let half = 1.96 * m.standard_error();
        [(m.mean() - half).max(0.0), m.mean() + half]
    };
    let spread = 1.96 * ratio.standard_error();
    let ci95 = vec![
        ("mse", interval(mse)),
        ("rmse", interval(mse).map(f64::sqrt)),
        ("relmse", interval(relmse)),
        ("mape", interval(mape)),
        ("smape", interval(smape)),
        (
            "mean_ratio",
            [ratio.ratio() - spread, ratio.ratio() + spread],
        ),
        ("flip", flip_interval(&errors, width, height)),
    ];
    let metrics = Metrics {
        mse: mse.mean(),
        rmse: mse.mean().sqrt(),
        relmse: relmse.mean(),
        mape: mape.mean(),
        smape: smape.mean(),
        flip: errors.iter().map(|e| f64::from(*e)).sum::<f64>() / errors.len() as f64,
        mean_ratio: ratio.ratio(),
        max_abs: if mse.count == 0 { f64::NAN } else { max_abs },
        nonfinite,
        pixels: reference.radiance.len() as u64,
        ci95,
    };
    Ok((metrics, errors))
}

/// Side of the tiles that FLIP's interval is taken over: its widest filter reaches 10 pixels to
/// each side.
const TILE: usize = 32;

/// 95 % confidence interval of the mean of FLIP errors; NaN for small pictures.
fn flip_interval(errors: &[f32], width: usize, height: usize) -> [f64; 2] {
    let (across, down) = (width / TILE, height / TILE);
    if across * down < 9 {
        return [f64::NAN; 2];
    }
    let mut sums = vec![(0.0, 0.0); across * down];
    for (i, error) in errors.iter().enumerate() {
        let tile = (i / width) * down / height * across + (i % width) * across / width;
        sums[tile].0 += f64::from(*error);
        sums[tile].1 += 1.0;
    }
    let means: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let half = t_quantile(0.975, means.len() as f64 - 1.0) * mean_and_error(&means).1;
    let mean = errors.iter().map(|e| f64::from(*e)).sum::<f64>() / errors.len() as f64;
    [(mean - half).max(0.0), mean + half]
}

/// What a display would show: stored codes as they are, radiance after the default tone mapping.
fn display_codes(picture: &Picture) -> Vec<[f32; 3]> {
    match &picture.codes {
        Some(codes) => codes.clone(),
        None => (picture.radiance.iter())
            .map(|p| display(*p, 0.0, Tonemap::default()))
            .collect(),
    }
}

/// Running mean and variance (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    fn mean(&self) -> f64 {
        if self.count == 0 { f64::NAN } else { self.mean }
    }

    fn standard_error(&self) -> f64 {
        let n = self.count as f64;
        (self.squares / (n - 1.0) / n).sqrt()
    }
}

/// Ratio of two means over the same pixels.
#[derive(Clone, Copy, Debug, Default)]
struct RatioMoments {
    reference: Moments,
    image: Moments,
    product: f64,
}

impl RatioMoments {
    fn add(&mut self, reference: f64, image: f64) {
        let before = reference - self.reference.mean;
        self.reference.add(reference);
        self.image.add(image);
        self.product += before * (image - self.image.mean);
    }

    fn ratio(&self) -> f64 {
        self.image.mean() / self.reference.mean()
    }

    fn standard_error(&self) -> f64 {
        let n = self.reference.count as f64;
        let q = self.ratio();
        let residual = self.image.squares - 2.0 * q * self.product + q * q * self.reference.squares;
        (residual.max(0.0) / (n - 1.0) / n).sqrt() / self.reference.mean().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(radiance: Vec<[f32; 3]>) -> Picture {
        Picture {
            width: radiance.len(),
            height: 1,
            radiance,
            codes: None,
        }
    }

    #[test]
    fn known_vectors() {
        let r = picture(vec![[1.0, 0.0, 0.5], [0.2, 0.4, 0.0]]);
        let i = picture(vec![[1.5, 0.1, 0.5], [0.0, 0.4, 0.3]]);
        let (m, _) = compare(&r, &i).unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * b.max(1e-3), "{a} != {b}");
        let (e, n) = (1e-2, 6.0);
        near(m.mse, (0.25 + 0.01 + 0.04 + 0.09) / n);
        near(m.rmse, (0.39f64 / n).sqrt());
        near(
            m.relmse,
            (0.25 / (1.0 + e) + 0.01 / e + 0.04 / (0.04 + e) + 0.09 / e) / n,
        );
        near(
            m.mape,
            (0.5 / (1.0 + e) + 0.1 / e + 0.2 / (0.2 + e) + 0.3 / e) / n,
        );
        near(
            m.smape,
            (0.5 / (2.5 + e) + 0.1 / (0.1 + e) + 0.2 / (0.2 + e) + 0.3 / (0.3 + e)) / n,
        );
        near(m.mean_ratio, 2.8 / 2.1);
        near(m.max_abs, 0.5);
        assert_eq!((m.nonfinite, m.pixels), (0, 2));
        // Two pixels with squared errors 0.26/3 and 0.13/3: standard error is half the distance.
        let (_, [low, high]) = m.ci95[0];
        near(high - m.mse, 1.96 * 0.13 / 6.0);
        near(low, m.mse - 1.96 * 0.13 / 6.0);
    }

    #[test]
    fn the_confidence_interval_of_the_ratio_holds_the_truth_nineteen_times_in_twenty() {
        let mut state = 7u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let inside = (0..400)
            .filter(|_| {
                let r: Vec<[f32; 3]> = (0..64).map(|_| [0.5 + uniform(); 3]).collect();
                let i = r
                    .iter()
                    .map(|p| [p[0] * 1.2 + uniform() - 0.5; 3])
                    .collect();
                let (m, _) = compare(&picture(r), &picture(i)).unwrap();
                let (name, [low, high]) = m.ci95[5];
                assert_eq!(name, "mean_ratio");
                (low..=high).contains(&1.2)
            })
            .count();
        assert!((365..=392).contains(&inside), "{inside} of 400");
    }

    #[test]
    fn the_interval_of_flip_holds_the_truth_nineteen_times_in_twenty() {
        let mut state = 3u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let square = |radiance| Picture {
            width: 96,
            height: 96,
            radiance,
            codes: None,
        };
        let reference = square(vec![[0.3; 3]; 96 * 96]);
        let found: Vec<(f64, [f64; 2])> = (0..40)
            .map(|_| {
                let noisy = (0..96 * 96).map(|_| [0.6 * uniform(); 3]).collect();
                let (m, _) = compare(&reference, &square(noisy)).unwrap();
                let (name, interval) = m.ci95[6];
                assert_eq!(name, "flip");
                (m.flip, interval)
            })
            .collect();
        let truth = found.iter().map(|f| f.0).sum::<f64>() / found.len() as f64;
        let inside = (found.iter())
            .filter(|(_, [low, high])| (*low..=*high).contains(&truth))
            .count();
        assert!((34..=40).contains(&inside), "{inside} of 40");
        let wide = (found.iter()).all(|(_, [low, high])| high - low < 0.2 * truth);
        assert!(wide, "{found:?}");
        let small = picture(vec![[1.0; 3]; 64]);
        assert!(compare(&small, &small).unwrap().0.ci95[6].1[0].is_nan());
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let r = picture(vec![[1.0; 3], [f32::NAN; 3], [1.0; 3]]);
        let i = picture(vec![[1.0; 3], [1.0; 3], [1.0, f32::INFINITY, 1.0]]);
        let (m, flip) = compare(&r, &i).unwrap();
        assert_eq!((m.nonfinite, m.pixels, m.mse), (2, 3, 0.0));
        assert!(m.flip.is_finite() && flip.len() == 3);
        let nothing = picture(vec![[f32::NAN; 3]]);
        assert!(compare(&nothing, &nothing).unwrap().0.mse.is_nan());
    }

    #[test]
    fn sizes_must_agree() {
        let (a, b) = (picture(vec![[0.0; 3]; 2]), picture(vec![[0.0; 3]; 3]));
        let error = compare(&a, &b).unwrap_err();
        assert!(error.contains("2x1") && error.contains("3x1"), "{error}");
    }
}
