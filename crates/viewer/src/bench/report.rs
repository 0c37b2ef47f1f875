//! What a bench prints.

use super::equal_time;
use super::result::{Bench, Bias, Budget, Curve, View};
use super::stats::Estimate;

/// The tables: one for each view, and one for the tests for bias.
#[must_use]
pub fn text(bench: &Bench) -> String {
    let mut text = format!(
        "{} ({}), {} x {}, runelight {}\n",
        bench.device, bench.driver, bench.machine.threads, bench.machine.cpu, bench.program
    );
    for view in &bench.views {
        text += "\n";
        text += &head(view);
        text += &points(view);
    }
    let equal = equal_times(bench);
    if !equal.is_empty() {
        text += "\nAt equal time: after what naive takes for the most samples it was given\n";
        text += &table(&equal, 2);
    }
    if bench
        .views
        .iter()
        .any(|v| v.curves.iter().any(|c| c.bias.is_some()))
    {
        text += "\nIs it biased?\n";
        text += &biases(bench);
    }
    if !bench.complete {
        text += "\nNot everything that was planned was measured.\n";
    }
    text += &format!("\n{:.0} s in all", bench.seconds);
    text
}

fn head(view: &View) -> String {
    let r = &view.reference;
    let sealed = if view.sealed { ", sealed" } else { "" };
    format!(
        "{} from {}, {}x{}, depth {}, lights {}, {} triangles, {} emitters{sealed}\n\
         reference: {} samples in {} batches of {} on {}, relMSE {:.1e}{}\n",
        view.level,
        name_and_pose(view),
        view.width,
        view.height,
        view.depth,
        view.lights,
        view.triangles,
        view.emitters,
        r.samples,
        r.batches,
        r.estimator,
        r.device,
        r.relmse,
        if r.is_good() {
            String::new()
        } else {
            format!(" ({:.1e} wanted)", r.wanted)
        },
    )
}

/// A camera's name does not tell intermission from intermission.
fn name_and_pose(view: &View) -> String {
    let pose: Vec<String> = view.pose.iter().map(|v| format!("{v:.0}")).collect();
    format!("{} ({})", view.camera, pose.join(" "))
}

fn points(view: &View) -> String {
    let mut rows = vec![
        [
            "curve",
            "budget",
            "samples",
            "seconds",
            "Mpaths/s",
            "Mrays/s",
            "relMSE",
            "95 %",
            "FLIP",
            "1/(relMSE s)",
            "speed-up",
            "95 %",
            "escaped/1e9",
            "not finite",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for curve in &view.curves {
        for point in &curve.points {
            let speedup = point.speedup.as_ref();
            let beyond = speedup.is_some_and(|s| s.beyond_curve);
            let flip = point.metrics.get("flip").map_or(f64::NAN, |f| f.value);
            rows.push(vec![
                curve.name(),
                point.budget.to_string(),
                match point.budget {
                    Budget::Samples(_) => String::new(),
                    Budget::Seconds(_) => format!("{:.0}", point.samples),
                },
                three(point.seconds.value),
                three(point.mpaths_per_s.value),
                three(point.mrays_per_s.value),
                error(point.relmse().value),
                interval(point.relmse(), error),
                three(flip),
                three(point.efficiency.value),
                speedup.map_or("-".to_owned(), |s| {
                    format!("{}{}", if beyond { "~" } else { "" }, three(s.factor.value))
                }),
                speedup.map_or(String::new(), |s| interval(s.factor, three)),
                three(point.escaped_per_1e9),
                point.nonfinite.to_string(),
            ]);
        }
    }
    let mut text = table(&rows, 1);
    let blind = |c: &&Curve| !c.sees_all_light;
    let blind: Vec<String> = view.curves.iter().filter(blind).map(Curve::name).collect();
    if !blind.is_empty() {
        text += &format!(
            "{}: light entities are not found, so the error is also what is missing\n",
            blind.join(", ")
        );
    }
    text
}

/// By view and curve the error in the time of `naive`, with a head; nothing if that was not measured.
fn equal_times(bench: &Bench) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for view in &bench.views {
        let Some(naive) = equal_time::of_naive(view) else {
            continue;
        };
        for curve in view.curves.iter().filter(|c| c.estimator != "naive") {
            let Some(found) = equal_time::read(curve, naive.seconds.value) else {
                continue;
            };
            rows.push(vec![
                format!("{} {}", view.level, view.camera),
                curve.name(),
                three(naive.seconds.value),
                naive.budget.to_string(),
                error(naive.relmse().value),
                format!(
                    "{}{}",
                    if found.beyond_curve { "~" } else { "" },
                    three(found.samples)
                ),
                error(found.relmse),
                three(naive.relmse().value / found.relmse),
            ]);
        }
    }
    if !rows.is_empty() {
        let head = [
            "view",
            "curve",
            "seconds",
            "naive",
            "relMSE of naive",
            "samples",
            "relMSE",
            "ratio",
        ];
        rows.insert(0, head.map(str::to_owned).to_vec());
    }
    rows
}

fn biases(bench: &Bench) -> String {
    let mut rows = vec![
        [
            "view",
            "curve",
            "slope",
            "95 %",
            "p",
            "N relMSE per decade",
            "p",
            "mean ratio",
            "95 %",
            "p",
            "p of tiles",
            "pixels within",
            "finds",
            "verdict",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for view in &bench.views {
        for curve in &view.curves {
            let mut row = vec![format!("{} {}", view.level, view.camera), curve.name()];
            match &curve.bias {
                Some(bias) => row.extend(verdict(bias)),
                None => row.extend(std::iter::once("not asked: not the same light".to_owned())),
            }
            rows.push(row);
        }
    }
    table(&rows, 2)
}

fn verdict(bias: &Bias) -> [String; 12] {
    [
        fixed(bias.slope.value, 3),
        interval(bias.slope, |v| fixed(v, 3)),
        probability(bias.slope_p),
        percent(bias.growth.value),
        probability(bias.growth_p),
        fixed(bias.mean_ratio.value, 5),
        interval(bias.mean_ratio, |v| fixed(v, 5)),
        probability(bias.mean_p),
        probability(bias.tile_p),
        format!("{:.2} %", bias.pixels_within * 100.0),
        format!("{:.2} %", bias.detects * 100.0),
        if bias.biased {
            "BIASED"
        } else {
            "unbiased within noise"
        }
        .to_owned(),
    ]
}

/// Columns as wide as their widest field; the first `left` to the left, the others to the right.
pub(super) fn table(rows: &[Vec<String>], left: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    // Rows that end early say something instead of figures; it does not widen a column.
    let widths: Vec<usize> = (0..columns)
        .map(|c| {
            (rows.iter())
                .filter(|row| row.len() == columns)
                .map(|row| row[c].chars().count())
                .max()
                .unwrap_or(0)
        })
        .collect();
    let mut text = String::new();
    for row in rows {
        let fields: Vec<String> = (row.iter().zip(&widths).enumerate())
            .map(|(c, (field, &width))| {
                if c < left || row.len() < columns {
                    format!("{field:<width$}")
                } else {
                    format!("{field:>width$}")
                }
            })
            .collect();
        text += fields.join("  ").trim_end();
        text += "\n";
    }
    text
}

fn interval(e: Estimate, show: impl Fn(f64) -> String) -> String {
    if e.low.is_finite() && e.high.is_finite() {
        format!("{}..{}", show(e.low), show(e.high))
    } else {
        String::new()
    }
}

/// Three digits.
fn three(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "-".to_owned()
    } else if size == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.2e}")
    } else {
        let digits = 2 - size.log10().floor() as i32;
        fixed(value, digits.max(0) as usize)
    }
}

fn error(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.2e}")
    } else {
        "-".to_owned()
    }
}

fn fixed(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:.digits$}")
    } else {
        "-".to_owned()
    }
}

fn percent(value: f64) -> String {
    if value.is_finite() {
        format!("{:+.1} %", value * 100.0)
    } else {
        "-".to_owned()
    }
}

fn probability(p: f64) -> String {
    if !p.is_finite() {
        "-".to_owned()
    } else if p < 1e-3 {
        format!("{p:.0e}")
    } else {
        format!("{p:.3}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1234.5, "1234"),
            (12.345, "12.3"),
            (0.012_345, "0.0123"),
            (1e-7, "1.00e-7"),
            (f64::NAN, "-"),
        ] {
            assert_eq!(three(value), text);
        }
        assert_eq!(probability(2e-9), "2e-9");
    }

    #[test]
    fn columns_line_up() {
        let rows = [["a", "b"], ["long", "1"]].map(|r| r.map(str::to_owned).to_vec());
        assert_eq!(table(&rows, 1), "a     b\nlong  1\n");
    }
}
