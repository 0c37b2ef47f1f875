//! `runelight compare`.

use super::Context;
use crate::cli::Compare;
use crate::metrics::{self, Metrics};
use crate::output::{Format, PartFile, write_rgb8};
use crate::picture;
use crate::{Outcome, Usage};
use anyhow::{Result, anyhow};
use serde_json::{Map, Value, json};

/// Runs the command.
///
/// # Errors
/// When a picture cannot be read, the sizes differ, or the heat map cannot be written.
pub fn run(args: &Compare, context: &Context) -> Result<Outcome> {
    let mut heatmap = match &args.heatmap {
        Some(path) if Format::of(path).ok() != Some(Format::Png) => {
            return Err(Usage(format!(
                "--heatmap {}: a heat map ends in .png",
                path.display()
            ))
            .into());
        }
        Some(path) => Some(PartFile::create(path)?),
        None => None,
    };
    let reference_layer = args.reference_layer.as_ref().unwrap_or(&args.layer);
    let reference = picture::read(&args.reference, reference_layer)?;
    let image = picture::read(&args.image, &args.layer)?;
    if reference.codes.is_some() != image.codes.is_some() {
        tracing::warn!(
            "a PNG holds display codes, not radiance: only its brightness below 1 can agree"
        );
    }
    let (metrics, errors) = metrics::compare(&reference, &image).map_err(|e| {
        anyhow!(
            "{} and {}: {e}",
            args.reference.display(),
            args.image.display()
        )
    })?;
    if let Some(part) = &mut heatmap {
        let bytes: Vec<u8> = errors.iter().flat_map(|e| heat(*e)).collect();
        write_rgb8(
            part.file(),
            &bytes,
            reference.width as u32,
            reference.height as u32,
        )?;
    }
    if let Some(part) = heatmap {
        part.commit()?;
    }
    context.print(&if context.json {
        json_of(&metrics).to_string()
    } else {
        table(&metrics)
    })?;
    let values = metrics.values();
    let mut exceeded = false;
    for (name, limit) in args.limits.given() {
        let value = values
            .iter()
            .find(|(n, _)| *n == name)
            .map_or(f64::NAN, |v| v.1);
        // Written so that a value that is not a number exceeds every limit.
        let within = value <= limit;
        if !within {
            eprintln!(
                "{}: {name} is {value:.6}, more than the {limit} allowed",
                args.image.display()
            );
            exceeded = true;
        }
    }
    Ok(if exceeded {
        Outcome::LimitExceeded
    } else {
        Outcome::Done
    })
}

fn json_of(metrics: &Metrics) -> Value {
    let mut object = Map::new();
    for (name, value) in metrics.values() {
        let whole = matches!(name, "nonfinite" | "pixels");
        object.insert(
            name.into(),
            if whole {
                json!(value as u64)
            } else {
                json!(value)
            },
        );
    }
    let intervals: Map<String, Value> = (metrics.ci95.iter())
        .map(|(name, interval)| ((*name).into(), json!(interval)))
        .collect();
    object.insert("ci95".into(), intervals.into());
    object.into()
}

fn table(metrics: &Metrics) -> String {
    let mut text = String::new();
    for (name, value) in metrics.values() {
        let interval = metrics.ci95.iter().find(|(n, _)| *n == name);
        text += &match interval {
            Some((_, [low, high])) if low.is_finite() => {
                format!("{name:<11}{value:<14.6}95% {low:.6} .. {high:.6}\n")
            }
            _ if value.fract() == 0.0 && value >= 1.0 => format!("{name:<11}{value}\n"),
            _ => format!("{name:<11}{value:.6}\n"),
        };
    }
    text.trim_end().to_owned()
}

/// Colours of the heat map at even distances: nine points of matplotlib's `magma`.
const HEAT: [[u8; 3]; 9] = [
    [0, 0, 4],
    [28, 16, 68],
    [79, 18, 123],
    [129, 37, 129],
    [181, 54, 122],
    [229, 89, 100],
    [251, 135, 97],
    [254, 194, 135],
    [252, 253, 191],
];

/// Colour of an error of 0..=1.
pub(super) fn heat(error: f32) -> [u8; 3] {
    let place = error.clamp(0.0, 1.0) * (HEAT.len() - 1) as f32;
    let at = (place as usize).min(HEAT.len() - 2);
    let t = place - at as f32;
    std::array::from_fn(|c| {
        let (a, b) = (f32::from(HEAT[at][c]), f32::from(HEAT[at + 1][c]));
        (a + (b - a) * t + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_runs_from_dark_to_bright() {
        assert_eq!(heat(0.0), HEAT[0]);
        assert_eq!(heat(1.0), HEAT[8]);
        assert_eq!(heat(0.25), HEAT[2]);
        let sum = |e: f32| heat(e).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!((0..100).all(|i| sum(i as f32 / 100.0) <= sum((i + 1) as f32 / 100.0)));
    }
}
