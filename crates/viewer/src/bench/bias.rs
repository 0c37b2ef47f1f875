//! Is the expectation of a renderer the reference's?
//!
//! Two questions, three tests; each has a p-value, and noise alone gives a small one as rarely as
//! it says.
//!
//! **Does the error fall as 1/N?** With the reference's own error subtracted, the expectation of
//! relMSE is `variance / N + bias^2`, so relMSE times N is constant without bias and grows with
//! it. The regression of relMSE times N over log N is taken for every repeat, over the budgets whose
//! error is at least the reference's own; its slopes are independent and have the expectation 0,
//! whatever the budgets of a repeat share, and Student's test over the repeats decides. (The slope
//! of log relMSE over log N is told as well. It is not decided by: a logarithm of a noisy number is
//! biased itself.)
//!
//! **Does the mean differ?** Over all repeats at the largest number of samples, the mean radiance
//! of the picture by channel, and that of 8x8 tiles, against the reference's, in standard errors
//! of the difference (the variance of the pictures' means plus that of the reference). These
//! variances are estimates, and poor ones where few pixels make up most of them, as with rare
//! bright paths: the difference is compared with Student's t, whose degrees of freedom are the
//! effective number of pixels, `(sum v)^2 / sum v^2` (Satterthwaite, "An approximate distribution
//! of estimates of variance components", Biometrics Bulletin 1946).
//!
//! The p-values of a curve become one by Sidak's correction, and a curve is called biased where
//! that is significant at [`ALPHA`] over all curves of the run, again by Sidak: an unbiased program
//! is called biased in one run of a hundred, however many curves it has.

use super::measure::Snapshot;
use super::reference::Reference;
use super::result::{Bias, Budget};
use super::stats::{Estimate, normal_limit, normal_two_sided, sidak, sidak_level};
use super::stats::{mean_and_error, slope, t_quantile, t_two_sided};

/// Significance over all curves of a run.
pub const ALPHA: f64 = 0.01;

/// Tiles of a picture along each side.
const TILES: usize = 8;

/// Fewest pixels of a tile: a sum of fewer is not close to normal.
const TILE_PIXELS: usize = 16;

/// A picture's mean and the variance of it, as the mean of several independent pictures.
#[derive(Clone, Debug)]
pub struct Pooled {
    width: usize,
    mean: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
}

impl Pooled {
    /// Pools pictures of the same number of samples, `width` pixels across.
    #[must_use]
    pub fn new(width: usize, pictures: &[&Snapshot]) -> Self {
        let pixels = pictures.first().map_or(0, |p| p.beauty.len());
        let count = pictures.len() as f64;
        let (mut mean, mut variance) = (vec![[0.0; 3]; pixels], vec![[0.0; 3]; pixels]);
        for picture in pictures {
            for i in 0..pixels {
                for c in 0..3 {
                    mean[i][c] += f64::from(picture.beauty[i][c]) / count;
                    variance[i][c] += f64::from(picture.variance[i][c]) / (count * count);
                }
            }
        }
        Self {
            width,
            mean,
            variance,
        }
    }
}

/// Sums over pixels of what the tests need, one channel.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    difference: f64,
    variance: f64,
    /// Of the pixels' variances.
    squares: f64,
    reference: f64,
}

impl Sums {
    /// Difference in standard errors.
    fn z(&self) -> f64 {
        // What is exact in both differs by rounding alone.
        let floor = 1e-6 * self.reference.abs() + 1e-12;
        self.difference / (self.variance + floor * floor).sqrt()
    }

    /// Probability of such a difference by noise alone.
    fn p(&self) -> f64 {
        if self.squares == 0.0 {
            return normal_two_sided(self.z());
        }
        t_two_sided(self.z(), self.variance * self.variance / self.squares)
    }
}

/// What the means say.
struct Means {
    z: [f64; 3],
    /// Smallest of the channels.
    p: f64,
    ratio: Estimate,
    error: f64,
    tiles: usize,
    tile_z: f64,
    /// Smallest of tiles and channels.
    tile_p: f64,
    within: f64,
}

fn compare_means(reference: &Reference, pooled: &Pooled) -> Means {
    let comparisons = 3 * pooled.mean.len();
    let limit = normal_limit(sidak_level(ALPHA, comparisons));
    let height = pooled.mean.len() / pooled.width.max(1);
    let per_side = |side: usize| {
        TILES
            .min(side / (TILE_PIXELS as f64).sqrt() as usize)
            .max(1)
    };
    let (across, down) = (per_side(pooled.width), per_side(height));
    let mut tiles = vec![[Sums::default(); 3]; across * down];
    let mut within = 0;
    for i in 0..pooled.mean.len() {
        let tile = (i / pooled.width) * down / height.max(1) * across
            + (i % pooled.width) * across / pooled.width;
        let (r, r_variance) = (reference.mean()[i], reference.variance_of(i));
        for c in 0..3 {
            let difference = pooled.mean[i][c] - r[c];
            let variance = pooled.variance[i][c] + r_variance[c];
            // A floor for what is exact in both but for rounding.
            let error = variance.sqrt().max(1e-5 * r[c].abs());
            within += usize::from(difference.abs() <= limit * error);
            let sums = &mut tiles[tile][c];
            sums.difference += difference;
            sums.variance += variance;
            sums.squares += variance * variance;
            sums.reference += r[c];
        }
    }
    let whole = [0, 1, 2].map(|c| {
        tiles.iter().fold(Sums::default(), |s, t| Sums {
            difference: s.difference + t[c].difference,
            variance: s.variance + t[c].variance,
            squares: s.squares + t[c].squares,
            reference: s.reference + t[c].reference,
        })
    });
    let total: f64 = whole.iter().map(|s| s.reference).sum();
    let difference: f64 = whole.iter().map(|s| s.difference).sum();
    // A sample's channels go up and down together: at worst their errors add.
    let error: f64 = whole.iter().map(|s| s.variance.sqrt()).sum();
    let relative = |v: f64| if total > 0.0 { v / total } else { f64::NAN };
    let ratio = 1.0 + relative(difference);
    let half = 1.96 * relative(error);
    Means {
        z: whole.map(|s| s.z()),
        p: whole.map(|s| s.p()).into_iter().fold(1.0, f64::min),
        ratio: Estimate {
            value: ratio,
            low: ratio - half,
            high: ratio + half,
        },
        error: relative(error),
        tiles: tiles.len(),
        tile_z: (tiles.iter().flatten()).fold(0.0, |worst: f64, s| worst.max(s.z().abs())),
        tile_p: tiles.iter().flatten().map(Sums::p).fold(1.0, f64::min),
        within: within as f64 / comparisons.max(1) as f64,
    }
}

/// Whether the error falls as 1/N: the corrected relMSE of every repeat at every number of samples,
/// `runs[repeat][budget]`.
struct Fall {
    slope: Estimate,
    slope_p: f64,
    growth: Estimate,
    growth_p: f64,
}

fn fall(samples: &[f64], runs: &[Vec<f64>], reference_error: f64) -> Fall {
    let logs: Vec<f64> = samples.iter().map(|n| n.ln()).collect();
    let line = |run: &Vec<f64>, f: &dyn Fn(f64, f64) -> f64| -> f64 {
        let points = (logs.iter().zip(run).zip(samples)).map(|((x, e), n)| (*x, f(*e, *n)));
        slope(&points.collect::<Vec<_>>())
    };
    let slopes: Vec<f64> = runs.iter().map(|r| line(r, &|e, _| e.ln())).collect();
    let df = runs.len() as f64 - 1.0;
    let (mean, error) = mean_and_error(&slopes);
    let slope_p = t_two_sided((mean + 1.0) / error, df);

    let all: Vec<f64> = (runs.iter())
        .flat_map(|r| r.iter().zip(samples).map(|(e, n)| e * n))
        .collect();
    let level = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let growths: Vec<f64> = (runs.iter())
        .map(|r| line(r, &|e, n| e * n) / level * std::f64::consts::LN_10)
        .collect();
    // What is subtracted for the reference is uncertain, and the same for all repeats.
    let shared = vec![reference_error; samples.len()];
    let shared = line(&shared, &|e, n| e * n) / level * std::f64::consts::LN_10;
    let (growth, growth_error) = mean_and_error(&growths);
    let growth_error = growth_error.hypot(shared);
    let half = t_quantile(0.975, df) * growth_error;
    Fall {
        slope: Estimate::of_runs(&slopes),
        slope_p,
        growth: Estimate {
            value: growth,
            low: growth - half,
            high: growth + half,
        },
        growth_p: t_two_sided(growth / growth_error, df),
    }
}

/// Tests a curve.
///
/// `pooled` are the pictures of all repeats at the largest number of samples, `runs` the corrected
/// relMSE as `[repeat][budget]` at the numbers of `samples` per pixel. Whether the result is
/// significant is left to [`judge`].
#[must_use]
pub fn test(reference: &Reference, pooled: &Pooled, samples: &[f64], runs: &[Vec<f64>]) -> Bias {
    let means = compare_means(reference, pooled);
    // An error smaller than the reference's own is a small difference of large numbers: no line is
    // drawn through it.
    let own = reference.relmse();
    let is_known = |budget: &usize| {
        let sum: f64 = runs.iter().map(|run| run[*budget]).sum();
        sum >= own * runs.len() as f64
    };
    let known = (0..samples.len()).take_while(is_known).count();
    let fall = if known >= 3 && runs.len() >= 2 {
        let runs: Vec<Vec<f64>> = runs.iter().map(|run| run[..known].to_vec()).collect();
        fall(&samples[..known], &runs, reference.relmse_error())
    } else {
        Fall {
            slope: Estimate::NONE,
            slope_p: f64::NAN,
            growth: Estimate::NONE,
            growth_p: f64::NAN,
        }
    };
    let mean_p = sidak(means.p, 3);
    let tile_p = sidak(means.tile_p, 3 * means.tiles);
    let tests: Vec<f64> = [mean_p, tile_p, fall.growth_p]
        .into_iter()
        .filter(|p| !p.is_nan())
        .collect();
    let p = sidak(tests.iter().copied().fold(1.0, f64::min), tests.len());
    // The limit of the mean's test, were this curve alone, and the 90 % point beyond it.
    let power = normal_limit(sidak_level(ALPHA, 9)) + 1.2816;
    Bias {
        slope: fall.slope,
        slope_p: fall.slope_p,
        growth: fall.growth,
        growth_p: fall.growth_p,
        mean_z: means.z,
        mean_p,
        mean_ratio: means.ratio,
        tiles: means.tiles,
        tile_z: means.tile_z,
        tile_p,
        pixels_within: means.within,
        detects: power * means.error,
        p,
        biased: false,
    }
}

/// Calls biased what is significant over all curves of a run.
pub fn judge<'a>(all: impl IntoIterator<Item = &'a mut Bias>) {
    let mut all: Vec<&mut Bias> = all.into_iter().collect();
    let level = sidak_level(ALPHA, all.len());
    for bias in &mut all {
        // Written so that a p-value that is not a number is none to rely on.
        let explained = bias.p >= level;
        bias.biased = !explained;
    }
}

/// The numbers of samples among `budgets`.
#[must_use]
pub fn sample_budgets(budgets: &[Budget]) -> Vec<usize> {
    (0..budgets.len())
        .filter(|i| matches!(budgets[*i], Budget::Samples(_)))
        .collect()
}
