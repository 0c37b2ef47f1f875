//! From pictures to figures.

use super::bias::{self, Pooled};
use super::measure::Snapshot;
use super::reference::Reference;
use super::result::{Budget, Curve, Point, Speedup};
use super::stats::{Estimate, between, mean_and_error, t_quantile};
use crate::metrics::{self, Metrics, NAMES};
use crate::picture::Picture;
use anyhow::{Result, anyhow};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// The metrics of `compare` that are told: all but the counts at the end.
pub(super) const TOLD: &[&str] = NAMES.split_at(8).0;

/// What was rendered for a curve: `runs[repeat][budget]`.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Estimator.
    pub estimator: String,
    /// How lights are chosen, or `-`.
    pub selection: String,
    /// See [`Curve::sees_all_light`].
    pub sees_all_light: bool,
    /// Independent repeats, each with a snapshot per budget.
    pub runs: Vec<Vec<Snapshot>>,
}

/// Measures all curves of a view against its reference.
///
/// # Errors
/// When pictures and reference differ in size.
pub fn curves(reference: &Reference, rendered: &[Rendered]) -> Result<Vec<Curve>> {
    let picture = reference.picture();
    let mut curves: Vec<Curve> = (rendered.iter())
        .map(|r| curve(reference, &picture, r))
        .collect::<Result<_>>()?;
    let naive = (curves.iter())
        .find(|c| c.estimator == "naive" && c.sees_all_light)
        .map(|c| c.points.clone());
    for curve in &mut curves {
        for point in &mut curve.points {
            if curve.estimator == "naive" && curve.sees_all_light {
                point.speedup = Some(Speedup {
                    factor: Estimate::alone(1.0),
                    beyond_curve: false,
                });
                continue;
            }
            point.speedup = (naive.as_deref())
                .filter(|_| curve.sees_all_light)
                .and_then(|naive| speedup(naive, point));
        }
    }
    Ok(curves)
}

fn curve(reference: &Reference, picture: &Picture, rendered: &Rendered) -> Result<Curve> {
    let compared = compare_all(picture, &rendered.runs)?;
    let budgets: Vec<Budget> =
        (rendered.runs.first()).map_or(Vec::new(), |run| run.iter().map(|s| s.budget).collect());
    let mut points = Vec::new();
    for b in 0..budgets.len() {
        let shots: Vec<&Snapshot> = rendered.runs.iter().map(|run| &run[b]).collect();
        let metrics: Vec<&Metrics> = compared.iter().map(|run| &run[b]).collect();
        points.push(point(reference, &shots, &metrics));
    }
    let spp = bias::sample_budgets(&budgets);
    let bias = (spp.last().filter(|_| rendered.sees_all_light)).map(|&last| {
        let pictures: Vec<&Snapshot> = rendered.runs.iter().map(|run| &run[last]).collect();
        let samples: Vec<f64> = spp.iter().map(|&b| points[b].samples).collect();
        let runs: Vec<Vec<f64>> = (0..rendered.runs.len())
            .map(|r| spp.iter().map(|&b| points[b].relmse_runs[r]).collect())
            .collect();
        let pooled = Pooled::new(picture.width, &pictures);
        bias::test(reference, &pooled, &samples, &runs)
    });
    Ok(Curve {
        estimator: rendered.estimator.clone(),
        selection: rendered.selection.clone(),
        sees_all_light: rendered.sees_all_light,
        points,
        bias,
    })
}

/// The metrics of every snapshot, on all cores: FLIP takes its time.
fn compare_all(picture: &Picture, runs: &[Vec<Snapshot>]) -> Result<Vec<Vec<Metrics>>> {
    let shots: Vec<&Snapshot> = runs.iter().flatten().collect();
    let next = Mutex::new(0..shots.len());
    let found: Mutex<Vec<Option<Result<Metrics, String>>>> = Mutex::new(vec![None; shots.len()]);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(shots.len()) {
            scope.spawn(|| {
                let take = || next.lock().ok()?.next();
                while let Some(i) = take() {
                    let image = Picture {
                        radiance: shots[i].beauty.clone(),
                        ..picture.clone()
                    };
                    let metrics = metrics::compare(picture, &image).map(|(m, _)| m);
                    if let Ok(mut found) = found.lock() {
                        found[i] = Some(metrics);
                    }
                }
            });
        }
    });
    let found = found.into_inner().unwrap_or_default();
    let mut all = Vec::new();
    for metrics in found {
        all.push(
            metrics
                .ok_or_else(|| anyhow!("a comparison failed"))?
                .map_err(|e| anyhow!(e))?,
        );
    }
    let mut all = all.into_iter();
    Ok((runs.iter())
        .map(|run| all.by_ref().take(run.len()).collect())
        .collect())
}

fn point(reference: &Reference, shots: &[&Snapshot], metrics: &[&Metrics]) -> Point {
    let of = |f: &dyn Fn(&Snapshot) -> f64| -> Vec<f64> { shots.iter().map(|s| f(s)).collect() };
    let mean = |f: &dyn Fn(&Snapshot) -> f64| mean_and_error(&of(f)).0;
    let seconds_runs = of(&|s| s.seconds);
    let rate = |count: fn(&Snapshot) -> u64| {
        Estimate::of_positive_runs(&of(&|s| count(s) as f64 / s.seconds.max(1e-9) / 1e6))
    };
    let mut told = BTreeMap::new();
    for &name in TOLD {
        let runs: Vec<f64> = metrics.iter().map(|m| value_of(m, name)).collect();
        let estimate = match metrics {
            [only] => over_pixels(only, name),
            _ => Estimate::of_positive_runs(&runs),
        };
        told.insert(name.to_owned(), estimate);
    }
    let less = |name: &str, own: f64| {
        let less = told[name].map(|v| v - own);
        Estimate {
            low: less.low.max(0.0),
            ..less
        }
    };
    let mse = less("mse", reference.mse());
    let relmse = less("relmse", reference.relmse());
    let relmse_runs: Vec<f64> = (metrics.iter())
        .map(|m| m.relmse - reference.relmse())
        .collect();
    let corrected = BTreeMap::from([
        ("mse".to_owned(), mse),
        ("rmse".to_owned(), mse.map(|v| v.max(0.0).sqrt())),
        ("relmse".to_owned(), relmse),
    ]);
    let seconds = Estimate::of_positive_runs(&seconds_runs);
    let costs: Vec<f64> = (relmse_runs.iter().zip(&seconds_runs))
        .map(|(e, s)| (e * s).ln())
        .collect();
    let efficiency = Estimate::of_log(
        1.0 / (relmse.value * seconds.value),
        t_quantile(0.975, costs.len() as f64 - 1.0) * mean_and_error(&costs).1,
    );
    let total = |count: fn(&Snapshot) -> u64| shots.iter().map(|s| count(s)).sum::<u64>();
    let escaped = total(|s| s.counters.escaped);
    let rays = total(|s| s.counters.rays);
    Point {
        budget: shots[0].budget,
        samples: mean(&|s| f64::from(s.samples)),
        seconds,
        paths: mean(&|s| s.counters.paths as f64),
        rays: mean(&|s| s.counters.rays as f64),
        mpaths_per_s: rate(|s| s.counters.paths),
        mrays_per_s: rate(|s| s.counters.rays),
        metrics: told,
        corrected,
        efficiency: if relmse.value > 0.0 {
            efficiency
        } else {
            Estimate::NONE
        },
        speedup: None,
        estimated_relmse: mean(&|s| s.estimated_relmse),
        nonfinite: total(|s| s.counters.nonfinite),
        escaped,
        escaped_per_1e9: escaped as f64 / rays.max(1) as f64 * 1e9,
        relmse_runs,
        seconds_runs,
    }
}

fn value_of(metrics: &Metrics, name: &str) -> f64 {
    let values = metrics.values();
    (values.iter().find(|(n, _)| *n == name)).map_or(f64::NAN, |v| v.1)
}

fn over_pixels(metrics: &Metrics, name: &str) -> Estimate {
    let interval = metrics.ci95.iter().find(|(n, _)| *n == name);
    Estimate {
        value: value_of(metrics, name),
        low: interval.map_or(f64::NAN, |i| i.1[0]),
        high: interval.map_or(f64::NAN, |i| i.1[1]),
    }
}

/// Logarithms of a point's error and seconds, and the standard error of the former.
fn place(point: &Point) -> Option<[f64; 3]> {
    let (value, seconds) = (point.relmse().value, point.seconds.value);
    let logs: Vec<f64> = point.relmse_runs.iter().map(|e| e.ln()).collect();
    let spread = mean_and_error(&logs).1;
    (value > 0.0 && seconds > 0.0).then(|| [value.ln(), seconds.ln(), spread])
}

/// Seconds of `naive` at the error of `point`, over the point's own; by straight lines between
/// the measured sample budgets in logarithms, continued as 1/N where they end.
fn speedup(naive: &[Point], point: &Point) -> Option<Speedup> {
    let [error, own_seconds, own_spread] = place(point)?;
    let curve: Vec<[f64; 3]> = (naive.iter())
        .filter(|p| matches!(p.budget, Budget::Samples(_)))
        .filter_map(place)
        .collect();
    let (first, last) = (curve.first()?, curve.last()?);
    let inside = error <= first[0] && error >= last[0];
    let found = between(&curve, error).filter(|_| inside);
    let [_, seconds, spread] = found.unwrap_or_else(|| {
        // A single point, met exactly, is its own end.
        let end = if error > first[0] { first } else { last };
        [error, end[1] + end[0] - error, end[2]]
    });
    // An error of the error moves the time by as much, where error falls as one over time.
    let spread = spread.hypot(own_spread);
    let df = 2.0 * (point.relmse_runs.len() as f64 - 1.0);
    Some(Speedup {
        factor: Estimate::of_log(
            (seconds - own_seconds).exp(),
            t_quantile(0.975, df) * spread,
        ),
        beyond_curve: found.is_none(),
    })
}

/// A point of a curve, for tests.
#[cfg(test)]
pub(super) fn plain_point(samples: u32, seconds: f64, relmse: f64) -> Point {
    let runs = vec![relmse * 0.99, relmse * 1.01];
    Point {
        budget: Budget::Samples(samples),
        samples: samples.into(),
        seconds: Estimate::alone(seconds),
        paths: 0.0,
        rays: 0.0,
        mpaths_per_s: Estimate::NONE,
        mrays_per_s: Estimate::NONE,
        metrics: BTreeMap::new(),
        corrected: BTreeMap::from([("relmse".to_owned(), Estimate::of_runs(&runs))]),
        efficiency: Estimate::NONE,
        speedup: None,
        estimated_relmse: relmse,
        nonfinite: 0,
        escaped: 0,
        escaped_per_1e9: 0.0,
        relmse_runs: runs,
        seconds_runs: vec![seconds; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_ups_are_read_along_the_curve_of_naive() {
        let naive = [
            plain_point(16, 1.0, 0.16),
            plain_point(64, 4.0, 0.04),
            plain_point(256, 16.0, 0.01),
        ];
        // At 0.02 naive needs 8 seconds.
        let found = speedup(&naive, &plain_point(16, 2.0, 0.02)).unwrap();
        assert!((found.factor.value - 4.0).abs() < 1e-9 && !found.beyond_curve);
        assert!(found.factor.low < 4.0 && found.factor.high > 4.0);
        for (error, factor) in [(0.32, 0.25), (0.001, 80.0)] {
            let found = speedup(&naive, &plain_point(16, 2.0, error)).unwrap();
            assert!((found.factor.value - factor).abs() < 1e-9 && found.beyond_curve);
        }
        let itself = speedup(&naive, &naive[1]).unwrap();
        assert!((itself.factor.value - 1.0).abs() < 1e-9 && !itself.beyond_curve);
        assert!(speedup(&naive, &plain_point(16, 2.0, -0.1)).is_none());
    }
}
