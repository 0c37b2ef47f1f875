//! `bench.csv`: a line for every point.

use super::evaluate::TOLD;
use super::result::{Bench, Budget};
use super::stats::Estimate;

/// The file: comma-separated, a head line, one line a point. What is not known is empty.
#[must_use]
pub fn text(bench: &Bench) -> String {
    let mut head: Vec<String> = [
        "level",
        "camera",
        "width",
        "height",
        "depth",
        "lights",
        "estimator",
        "selection",
        "budget_spp",
        "budget_s",
        "samples",
        "paths",
        "rays",
        "nonfinite",
        "escaped",
        "escaped_per_1e9_rays",
        "estimated_relmse",
        "speedup_beyond_curve",
        "bias_p",
        "biased",
    ]
    .map(str::to_owned)
    .to_vec();
    let mut estimates: Vec<String> = ["seconds", "mpaths_per_s", "mrays_per_s"]
        .map(str::to_owned)
        .to_vec();
    estimates.extend(TOLD.iter().map(ToString::to_string));
    estimates.extend(["mse", "rmse", "relmse"].map(|m| format!("{m}_corrected")));
    estimates.extend(["efficiency", "speedup"].map(str::to_owned));
    for name in &estimates {
        head.extend(["", "_low", "_high"].map(|end| format!("{name}{end}")));
    }
    let mut lines = vec![head.join(",")];
    for view in &bench.views {
        for curve in &view.curves {
            for point in &curve.points {
                let (spp, seconds) = match point.budget {
                    Budget::Samples(n) => (n.to_string(), String::new()),
                    Budget::Seconds(s) => (String::new(), s.to_string()),
                };
                let bias = curve.bias.as_ref();
                let beyond = point.speedup.as_ref().map(|s| s.beyond_curve.to_string());
                let mut fields = vec![
                    quoted(&view.level),
                    quoted(&view.camera),
                    view.width.to_string(),
                    view.height.to_string(),
                    view.depth.to_string(),
                    view.lights.clone(),
                    curve.estimator.clone(),
                    curve.selection.clone(),
                    spp,
                    seconds,
                    number(point.samples),
                    number(point.paths),
                    number(point.rays),
                    point.nonfinite.to_string(),
                    point.escaped.to_string(),
                    number(point.escaped_per_1e9),
                    number(point.estimated_relmse),
                    beyond.unwrap_or_default(),
                    bias.map_or(String::new(), |b| number(b.p)),
                    bias.map_or(String::new(), |b| b.biased.to_string()),
                ];
                let mut add = |e: Estimate| fields.extend([e.value, e.low, e.high].map(number));
                for e in [point.seconds, point.mpaths_per_s, point.mrays_per_s] {
                    add(e);
                }
                let of = |map: &std::collections::BTreeMap<String, Estimate>, name: &str| {
                    map.get(name).copied().unwrap_or(Estimate::NONE)
                };
                for &name in TOLD {
                    add(of(&point.metrics, name));
                }
                for name in ["mse", "rmse", "relmse"] {
                    add(of(&point.corrected, name));
                }
                add(point.efficiency);
                add(point.speedup.as_ref().map_or(Estimate::NONE, |s| s.factor));
                lines.push(fields.join(","));
            }
        }
    }
    lines.join("\n") + "\n"
}

fn number(value: f64) -> String {
    if value.is_finite() {
        value.to_string()
    } else {
        String::new()
    }
}

/// A field as RFC 4180 has it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
