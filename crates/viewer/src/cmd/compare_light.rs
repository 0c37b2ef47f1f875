//! `runelight compare-light`.

use super::Context;
use super::compare::heat;
use crate::cli::CompareLight;
use crate::level::Source;
use crate::luxels::atlas::{Atlas, Layer};
use crate::luxels::compare::{self, Comparison, Figures, Luxel, Pair};
use crate::output::{Format, PartFile, write_rgb_layers, write_rgb8};
use crate::{Outcome, Usage};
use anyhow::{Result, bail};
use bsp::Limits;
use scene::import::compiler_lights;
use serde_json::{Value, json};
use std::path::Path;

/// Difference that a heat map shows brightest, in lightmap bytes.
const HOTTEST: f32 = 16.0;
/// Luxels that are not compared, in a heat map.
const LEFT_OUT: [f32; 3] = [0.0, 0.35, 0.0];

/// Runs the command.
///
/// # Errors
/// When the level cannot be loaded or has no lightmaps, or an output cannot be written.
pub fn run(args: &CompareLight, context: &Context) -> Result<Outcome> {
    let mut outputs = Vec::new();
    for path in &args.output {
        let format = Format::of(path).map_err(|e| Usage(format!("--output {e:#}")))?;
        outputs.push((format, PartFile::create(path)?));
    }
    let level = Source::new(Some(&args.level), &context.global)?
        .load()?
        .level;
    if level.bsp.lighting.is_empty() && level.light == bsp::bsp::LightSamples::Lump {
        bail!("{}: the level has no lightmaps to compare with", level.name);
    }
    let (lights, remarks) = compiler_lights(&level, args.sun_samples);
    for remark in remarks {
        tracing::warn!("{remark}");
    }
    let comparison = compare::compare(&level, &lights, args.extra, &Limits::default());
    let Some(all) = Figures::over(comparison.pairs()) else {
        bail!("{}: no luxel of the level gets light", level.name);
    };
    for (format, part) in &mut outputs {
        write(*format, part, &comparison)?;
    }
    for (_, part) in outputs {
        part.commit()?;
    }
    let report = Report {
        level: &level.name,
        lights: lights.lights.len() + lights.least.len(),
        comparison: &comparison,
        all: &all,
        written: args.output.iter().map(AsRef::as_ref).collect(),
    };
    context.print(&if context.json {
        report.json().to_string()
    } else {
        report.text()
    })?;
    let mut outcome = Outcome::Done;
    for (name, value, limit) in [
        ("median", all.median, args.max_median),
        ("99th percentile", all.p99, args.max_p99),
    ] {
        if let Some(limit) = limit.filter(|&limit| value > limit) {
            eprintln!(
                "{}: the {name} is {value}, more than the {limit} allowed",
                level.name
            );
            outcome = Outcome::LimitExceeded;
        }
    }
    Ok(outcome)
}

/// Sum over styles of one side of a luxel's pairs, where 1 shows a texture as it is stored.
fn sum(luxel: &Luxel, side: fn(&Pair) -> [f32; 3]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    if let Luxel::Compared(pairs) = luxel {
        for pair in pairs {
            for (sum, v) in sum.iter_mut().zip(side(pair)) {
                *sum += v / 128.0;
            }
        }
    }
    sum
}

fn write(format: Format, part: &mut PartFile, comparison: &Comparison) -> Result<()> {
    let Some(atlas) = Atlas::new(comparison) else {
        bail!(
            "{}: the luxels do not fit into a picture",
            part.path().display()
        );
    };
    let size = [atlas.width, atlas.height];
    match format {
        Format::Png => {
            let layer = atlas.layer(comparison, [0.0; 3], |luxel| match luxel {
                Luxel::Compared(pairs) => {
                    let most = pairs.iter().map(Pair::difference).fold(0.0, f32::max);
                    heat(most / HOTTEST).map(|c| f32::from(c) / 255.0)
                }
                Luxel::Outside | Luxel::BehindGlass => LEFT_OUT,
            });
            let bytes: Vec<u8> = (layer.as_flattened().iter())
                .map(|c| (c * 255.0 + 0.5) as u8)
                .collect();
            write_rgb8(part.file(), &bytes, size[0], size[1])
        }
        Format::Exr => {
            let layer = |value: &dyn Fn(&Luxel) -> [f32; 3]| -> Layer {
                atlas.layer(comparison, [0.0; 3], value)
            };
            let traced = layer(&|l| sum(l, |p| p.traced));
            let baked = layer(&|l| sum(l, |p| p.baked));
            let difference =
                layer(&|l| sum(l, |p| std::array::from_fn(|c| p.traced[c] - p.baked[c])));
            let layers: [(&str, &[[f32; 3]]); 3] = [
                ("", &traced),
                ("baked", &baked),
                ("difference", &difference),
            ];
            write_rgb_layers(part.file(), size, &layers)
        }
    }
}

/// What is said in the end.
struct Report<'a> {
    level: &'a str,
    lights: usize,
    comparison: &'a Comparison,
    all: &'a Figures,
    written: Vec<&'a Path>,
}

impl Report<'_> {
    /// Luxels beyond faces and in solid, and those behind glass.
    fn left_out(&self) -> [usize; 2] {
        let count = |test: fn(&Luxel) -> bool| self.comparison.luxels().filter(|l| test(l)).count();
        [
            count(|l| matches!(l, Luxel::Outside)),
            count(|l| matches!(l, Luxel::BehindGlass)),
        ]
    }

    fn json(&self) -> Value {
        let figures = |f: &Figures| {
            json!({
                "luxels": f.count, "median": f.median, "p90": f.p90, "p99": f.p99, "max": f.max,
                "mean_excess": f.excess,
            })
        };
        let styles: Vec<Value> = (self.comparison.by_style().iter())
            .map(|(style, f)| {
                let mut told = figures(f);
                told["style"] = json!(style);
                told
            })
            .collect();
        let [outside, glass] = self.left_out();
        let mut told = figures(self.all);
        told["level"] = json!(self.level);
        told["lights"] = json!(self.lights);
        told["faces"] = json!(self.comparison.faces.len());
        told["unlit_faces"] = json!(self.comparison.unlit_faces);
        told["left_out"] = json!({ "outside_or_solid": outside, "behind_glass": glass });
        told["styles"] = json!(styles);
        told["outputs"] = json!(self.written);
        told
    }

    fn text(&self) -> String {
        let row = |name: &str, f: &Figures| {
            format!(
                "{name:<10}{:>9}{:>9.2}{:>9.2}{:>9.2}{:>9.2}{:>+10.2}\n",
                f.count, f.median, f.p90, f.p99, f.max, f.excess
            )
        };
        let mut text = format!(
            "{}: {} faces with lightmaps, {} without, {} lights; differences in 1/255\n\
             {:<10}{:>9}{:>9}{:>9}{:>9}{:>9}{:>10}\n",
            self.level,
            self.comparison.faces.len(),
            self.comparison.unlit_faces,
            self.lights,
            "style",
            "luxels",
            "median",
            "p90",
            "p99",
            "max",
            "mean t-b",
        );
        for (style, figures) in self.comparison.by_style() {
            text += &row(&style.to_string(), &figures);
        }
        text += &row("all", self.all);
        let [outside, glass] = self.left_out();
        text +=
            &format!("left out: {outside} luxels beyond faces or in solid, {glass} behind glass");
        text
    }
}
