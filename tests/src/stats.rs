//! Do two noisy pictures show the same thing?

use scene::render::Film;

/// What a z-test found.
#[derive(Clone, Copy, Debug)]
pub struct ZTest {
    /// Share of pixel channels whose difference noise explains.
    pub passed: f64,
    /// Difference of the means of the two pictures in standard errors, the worst channel.
    pub mean_z: f64,
    /// Ratio of the mean radiances.
    pub mean_ratio: f64,
}

impl ZTest {
    /// Compares two pictures pixel by pixel at a significance of 0.01 with Sidak's correction for
    /// the number of comparisons.
    #[must_use]
    pub fn new(a: &Film, b: &Film) -> Self {
        let comparisons = 3 * a.beauty.len();
        let alpha = 1.0 - (1.0f64 - 0.01).powf(1.0 / comparisons as f64);
        let limit = normal_quantile(1.0 - alpha / 2.0);
        let mut passed = 0;
        // Per channel: sums of a and b, variance of the difference of the sums.
        let mut sums = [[0.0f64; 3]; 3];
        for i in 0..a.beauty.len() {
            for (c, sums) in sums.iter_mut().enumerate() {
                let (x, y) = (f64::from(a.beauty[i][c]), f64::from(b.beauty[i][c]));
                let variance = f64::from(a.variance[i][c]) + f64::from(b.variance[i][c]);
                // A floor for what is exact in both but for rounding.
                let error = variance.sqrt().max(1e-5 * x.abs().max(y.abs()));
                passed += usize::from((x - y).abs() <= limit * error);
                for (sum, value) in sums.iter_mut().zip([x, y, variance]) {
                    *sum += value;
                }
            }
        }
        let z = |[x, y, variance]: [f64; 3]| {
            let scale = x.abs().max(y.abs());
            (x - y).abs() / variance.sqrt().max(1e-5 * scale).max(1e-30)
        };
        let total = |which: usize| sums.iter().map(|s| s[which]).sum::<f64>();
        Self {
            passed: passed as f64 / comparisons as f64,
            mean_z: sums.map(z).into_iter().fold(0.0, f64::max),
            mean_ratio: total(0) / total(1),
        }
    }

    /// Asserts that at least 99.75 % of the pixel channels agree, and the means within 4.5
    /// standard errors.
    ///
    /// # Panics
    /// When they do not.
    #[track_caller]
    pub fn assert(self, what: &str) {
        assert!(self.passed >= 0.9975, "{what}: {self:?}");
        assert!(self.mean_z <= 4.5, "{what}: {self:?}");
    }
}

/// Quantile of the standard normal distribution (Acklam's rational approximation, relative error
/// below 1.2e-9).
fn normal_quantile(p: f64) -> f64 {
    // Upper tail only: p is close to 1 here.
    let q = (-2.0 * (1.0 - p).ln()).sqrt();
    const C: [f64; 6] = [
        -7.784_894_002_430_293e-3,
        -3.223_964_580_411_365e-1,
        -2.400_758_277_161_838,
        -2.549_732_539_343_734,
        4.374_664_141_464_968,
        2.938_163_982_698_783,
    ];
    const D: [f64; 4] = [
        7.784_695_709_041_462e-3,
        3.224_671_290_700_398e-1,
        2.445_134_137_142_996,
        3.754_408_661_907_416,
    ];
    let top = C.iter().fold(0.0, |sum, c| sum * q + c);
    let bottom = D.iter().fold(0.0, |sum, d| sum * q + d) * q + 1.0;
    -top / bottom
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_tables() {
        assert!((normal_quantile(0.99) - 2.326_347_874).abs() < 1e-6);
        assert!((normal_quantile(1.0 - 1e-7) - 5.199_337_582).abs() < 1e-6);
    }

    #[test]
    fn a_bias_is_caught_and_noise_is_not() {
        let film = |bias: f32| {
            let noise = |i: usize| ((i * 7919 % 1000) as f32 / 1000.0 - 0.5) * 3.4 * 0.01;
            Film {
                beauty: (0..1000).map(|i| [1.0 + bias + noise(i); 3]).collect(),
                variance: vec![[1e-4; 3]; 1000],
                ..Film::default()
            }
        };
        let quiet = film(0.0);
        ZTest::new(&quiet, &film(0.0)).assert("equal");
        assert!(ZTest::new(&quiet, &film(0.003)).mean_z > 4.5);
        assert!(ZTest::new(&quiet, &film(0.1)).passed < 0.5);
    }
}
