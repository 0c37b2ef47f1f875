//! What another estimator makes of the time that `naive` takes.

use super::result::{Budget, Curve, Point, View};
use super::stats::between;

/// A curve read at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Samples per pixel taken by then.
    pub samples: f64,
    /// relMSE by then.
    pub relmse: f64,
    /// Whether the time is outside of what was measured, and the curve was continued as 1/N.
    pub beyond_curve: bool,
}

/// The point of a view's `naive` curve with the most samples, whether or not it finds all light.
#[must_use]
pub fn of_naive(view: &View) -> Option<&Point> {
    let naive = view.curves.iter().find(|c| c.estimator == "naive")?;
    naive.points.iter().rev().find(|p| is_of_samples(p))
}

fn is_of_samples(point: &Point) -> bool {
    matches!(point.budget, Budget::Samples(_))
}

/// A curve after `seconds`: by straight lines between its sample budgets in logarithms. `None` if it has
/// no point with an error above 0.
#[must_use]
pub fn read(curve: &Curve, seconds: f64) -> Option<Reading> {
    // Logarithms of seconds, samples and error.
    let places: Vec<[f64; 3]> = (curve.points.iter())
        .filter(|p| is_of_samples(p) && p.relmse().value > 0.0 && p.seconds.value > 0.0)
        .map(|p| [p.seconds.value, p.samples, p.relmse().value].map(f64::ln))
        .collect();
    let (first, last) = (places.first()?, places.last()?);
    let t = seconds.ln();
    let between = between(&places, t);
    let [_, samples, error] = between.unwrap_or_else(|| {
        let end = if t < first[0] { first } else { last };
        let later = t - end[0];
        [t, end[1] + later, end[2] - later]
    });
    Some(Reading {
        samples: samples.exp(),
        relmse: error.exp(),
        beyond_curve: between.is_none(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::evaluate::plain_point;
    use super::*;

    #[test]
    fn a_curve_is_read_between_its_points_and_beyond_them() {
        let curve = Curve {
            estimator: "mis".into(),
            selection: "leaf".into(),
            sees_all_light: true,
            points: vec![plain_point(16, 1.0, 0.16), plain_point(64, 4.0, 0.04)],
            bias: None,
        };
        for (seconds, samples, relmse, beyond_curve) in [
            (2.0, 32.0, 0.08, false),
            (4.0, 64.0, 0.04, false),
            (8.0, 128.0, 0.02, true),
            (0.5, 8.0, 0.32, true),
        ] {
            let found = read(&curve, seconds).unwrap();
            assert!((found.samples / samples - 1.0).abs() < 1e-9, "{found:?}");
            assert!((found.relmse / relmse - 1.0).abs() < 1e-9, "{found:?}");
            assert_eq!(found.beyond_curve, beyond_curve);
        }
    }
}
