//! The statistics of the measurements: distributions, intervals, straight lines.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number with its 95 % confidence interval. Without an interval `low` and `high` are NaN; in
/// JSON what is not finite is `null`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    #[serde(with = "finite")]
    pub value: f64,
    /// Lower end of the interval.
    #[serde(with = "finite")]
    pub low: f64,
    /// Upper end of the interval.
    #[serde(with = "finite")]
    pub high: f64,
}

impl Estimate {
    /// Nothing is known.
    pub const NONE: Self = Self {
        value: f64::NAN,
        low: f64::NAN,
        high: f64::NAN,
    };

    /// A number without an interval.
    #[must_use]
    pub fn alone(value: f64) -> Self {
        Self {
            value,
            ..Self::NONE
        }
    }

    /// The mean of independent runs with Student's interval; no interval for a single run.
    #[must_use]
    pub fn of_runs(runs: &[f64]) -> Self {
        let (mean, error) = mean_and_error(runs);
        let half = t_quantile(0.975, runs.len() as f64 - 1.0) * error;
        Self {
            value: mean,
            low: mean - half,
            high: mean + half,
        }
    }

    /// `of_runs` for what cannot be negative.
    #[must_use]
    pub fn of_positive_runs(runs: &[f64]) -> Self {
        let mut estimate = Self::of_runs(runs);
        estimate.low = estimate.low.max(0.0);
        estimate
    }

    /// A positive number known through its logarithm: `exp(ln +- half)`.
    #[must_use]
    pub fn of_log(value: f64, half: f64) -> Self {
        Self {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        }
    }

    /// All three through a rising function.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            low: f(self.low),
            high: f(self.high),
        }
    }
}

/// Numbers that JSON may lack: what is not finite is `null`.
pub mod finite {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes a number, or `null`.
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(*value).serialize(serializer)
    }

    /// Reads a number; `null` is NaN.
    ///
    /// # Errors
    /// The deserializer's.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
    }
}

/// Mean of `runs` and the standard error of the mean; NaN where there are too few.
#[must_use]
pub fn mean_and_error(runs: &[f64]) -> (f64, f64) {
    let n = runs.len() as f64;
    let mean = runs.iter().sum::<f64>() / n;
    if runs.len() < 2 {
        return (mean, f64::NAN);
    }
    let squares: f64 = runs.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

/// The place on the straight lines through `places`, in their order, whose first number is `at`; `None` beyond
/// their ends.
#[must_use]
pub fn between<const N: usize>(places: &[[f64; N]], at: f64) -> Option<[f64; N]> {
    (places.iter().zip(places.get(1..)?)).find_map(|(a, b)| {
        let share = (at - a[0]) / (b[0] - a[0]);
        let mixed = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share);
        (0.0..=1.0).contains(&share).then_some(mixed)
    })
}

/// Slope of the line of least squares through `points` (x, y); NaN unless two x differ.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let x_mean = points.iter().map(|p| p.0).sum::<f64>() / n;
    let spread: f64 = points.iter().map(|p| (p.0 - x_mean).powi(2)).sum();
    let product: f64 = points.iter().map(|p| (p.0 - x_mean) * p.1).sum();
    if spread > 0.0 {
        product / spread
    } else {
        f64::NAN
    }
}

/// Probability that a standard normal number is at least as far from 0 as `z`.
#[must_use]
pub fn normal_two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// Probability that Student's t with `df` degrees of freedom is at least as far from 0 as `t`;
/// NaN without a degree of freedom.
#[must_use]
pub fn t_two_sided(t: f64, df: f64) -> f64 {
    if t.is_nan() || df.is_nan() || df <= 0.0 {
        return f64::NAN;
    }
    if t.is_infinite() {
        return 0.0;
    }
    incomplete_beta(df / 2.0, 0.5, df / (df + t * t))
}

/// The value that Student's t with `df` degrees of freedom stays below with probability `p`,
/// 0.5 <= p < 1; NaN without a degree of freedom.
#[must_use]
pub fn t_quantile(p: f64, df: f64) -> f64 {
    if df.is_nan() || df <= 0.0 {
        return f64::NAN;
    }
    quantile(2.0 * (1.0 - p), |t| t_two_sided(t, df))
}

/// The distance from 0 that a standard normal number exceeds with probability `two_sided`.
#[must_use]
pub fn normal_limit(two_sided: f64) -> f64 {
    quantile(two_sided, normal_two_sided)
}

/// Where the falling function `tail` reaches `wanted`, by bisection.
fn quantile(wanted: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > wanted && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if tail(middle) > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of at least one p-value this small among `count` independent tests (Sidak 1967).
/// Exact in the far tail, where `1 - (1 - p)^count` would cancel.
#[must_use]
pub fn sidak(p: f64, count: usize) -> f64 {
    -(count as f64 * (-p).ln_1p()).exp_m1()
}

/// The p-value below which one of `count` independent tests is significant at `alpha` over all.
#[must_use]
pub fn sidak_level(alpha: f64, count: usize) -> f64 {
    -((-alpha).ln_1p() / count.max(1) as f64).exp_m1()
}

/// Regularized incomplete beta function by its continued fraction (Numerical Recipes 6.4; the
/// modified Lentz method).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front =
        (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p())
            .exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut result = d;
    for m in 1..1000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut step = 1.0;
        for term in [even, odd] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            step = d * c;
            result *= step;
        }
        if (step - 1.0).abs() < 1e-15 {
            break;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_tails_are_those_of_the_tables() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 2e-4 * b, "{a} != {b}");
        near(t_quantile(0.975, 1.0), 12.7062);
        near(t_quantile(0.975, 3.0), 3.18245);
        near(t_quantile(0.995, 10.0), 3.16927);
        near(t_quantile(0.975, 1e6), 1.95996);
        near(t_two_sided(2.0, 5.0), 0.101_939);
        near(normal_two_sided(1.959_964), 0.05);
        near(normal_two_sided(8.0), 1.244_192e-15);
        near(normal_limit(0.01), 2.575_829);
        near(sidak(0.01, 2), 0.0199);
        near(sidak(1e-18, 1000), 1e-15);
        near(sidak_level(0.01, 10), 1.004_5e-3);
        assert!(t_quantile(0.975, 0.0).is_nan());
    }

    #[test]
    fn an_interval_of_runs_is_students() {
        let e = Estimate::of_runs(&[1.0, 2.0, 3.0]);
        // Standard error 1/sqrt(3), t of two degrees of freedom 4.3027.
        assert!((e.value - 2.0).abs() < 1e-12);
        assert!((e.high - 2.0 - 4.3027 / 3f64.sqrt()).abs() < 1e-3, "{e:?}");
        assert!(Estimate::of_runs(&[1.0]).low.is_nan());
    }

    #[test]
    fn a_line_is_found_again() {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|i| (f64::from(i), 3.0 - 2.0 * f64::from(i)))
            .collect();
        assert!((slope(&points) + 2.0).abs() < 1e-12);
        assert!(slope(&points[..1]).is_nan());
    }

    #[test]
    fn json_holds_null_for_what_is_not_finite() {
        let text = serde_json::to_string(&Estimate::alone(2.5)).unwrap();
        assert_eq!(text, r#"{"value":2.5,"low":null,"high":null}"#);
        let back: Estimate = serde_json::from_str(&text).unwrap();
        assert!(back.value == 2.5 && back.low.is_nan());
    }
}
