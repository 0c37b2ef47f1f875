//! `runelight render`.

use super::Context;
use crate::adaptive::{self, Adaptive};
use crate::cli::{ExrType, Render};
use crate::device::Device;
use crate::escapes;
use crate::interrupt;
use crate::job::{self, Goal, Stopped};
use crate::level::Source;
use crate::output::{Format, Layer, Note, Outputs, Style};
use crate::progress::Progress;
use crate::{Outcome, Usage};
use anyhow::Result;
use scene::Scene;
use scene::import::{ImportOptions, Lighting};
use scene::render::{Estimator, Film, Selection, Settings};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Runs the command.
///
/// # Errors
/// When the level cannot be loaded, the device fails, or an output cannot be written.
pub fn run(args: &Render, context: &Context) -> Result<Outcome> {
    interrupt::install()?;
    for path in &args.output {
        Format::of(path).map_err(|e| Usage(format!("--output {e:#}")))?;
    }
    let source = Source::new(args.level.as_deref(), &context.global)?;
    let outputs = Outputs::open(&output_paths(args, &source.name()))?;
    let device = Device::choose(&context.global.device)?;
    let lighting = Lighting::from(args.lighting);
    if args.layers.0.contains(&Layer::Style) && lighting == Lighting::Lightmap {
        let why = "the level's baked light is not told apart by light style";
        return Err(Usage(format!("--layers style with --lighting lightmap: {why}")).into());
    }
    if args.clamp.is_some() && args.layers.0.contains(&Layer::Style) {
        let why = "light by light style is summed before a sample is whole";
        return Err(Usage(format!("--clamp with --layers style: {why}")).into());
    }
    let options = ImportOptions {
        light_lists: estimator(args).samples_lights()
            && Selection::from(args.selection) == Selection::Leaf,
        lighting,
        styles_apart: args.layers.0.contains(&Layer::Style),
        ..args.scene.import_options()?
    };
    let mut scene = source.load()?.import(&options)?;
    warn_of_oddities(&scene);
    let settings = settings(args, &scene)?;
    scene.turn_sprites(&settings.camera);
    let scene = Arc::new(scene);
    warn_of_unseen_lights(&scene, &settings);
    let loaded = Instant::now();

    let mut renderer = device.renderer(&scene, &settings)?;
    if args.adaptive {
        renderer = Box::new(Adaptive::new(renderer, adaptive::pilot(args.spp)));
    }
    let built = Instant::now();

    let goal = Goal {
        spp: args.spp,
        deadline: (args.time_limit).map(|s| context.start + Duration::from_secs_f64(s)),
        target_error: args.target_error,
    };
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let mut progress = Progress::new(!context.global.quiet, &goal, pixels);
    let stopped = job::run(&mut *renderer, &goal, &mut progress, &interrupt::asked)?;
    drop(progress);
    let film = renderer.film()?;
    let rendered = Instant::now();

    let style = Style {
        layers: args.layers.0.clone(),
        half: args.exr_type == ExrType::Half,
        exposure: args.exposure as f32,
        tonemap: args.tonemap,
        notes: notes(args, &scene, &settings, &device, &film),
    };
    let written = outputs.write(&film, &style)?;
    warn_of_bad_samples(&scene, &film);
    let result = Report {
        scene: &scene,
        settings: &settings,
        device: &device,
        film: &film,
        stopped,
        lighting,
        spp_asked: args.spp,
        seconds: [
            loaded - context.start,
            built - loaded,
            rendered - built,
            rendered.elapsed(),
        ]
        .map(|d| d.as_secs_f64()),
        written: &written,
    };
    context.print(&if context.json {
        result.json().to_string()
    } else {
        result.text()
    })?;
    Ok(Outcome::Done)
}

/// Where the picture goes.
fn output_paths(args: &Render, level: &str) -> Vec<PathBuf> {
    if args.output.is_empty() {
        vec![format!("{level}.exr").into(), format!("{level}.png").into()]
    } else {
        args.output.clone()
    }
}

/// How light is found: by looking for lights where nothing else shines.
fn estimator(args: &Render) -> Estimator {
    match Lighting::from(args.lighting) {
        Lighting::Physical => args.estimator.into(),
        Lighting::Compiler | Lighting::Lightmap | Lighting::Fullbright => Estimator::Nee,
    }
}

/// The deepest path vertex: no deeper than the light model means something.
fn depth(args: &Render) -> u32 {
    match (Lighting::from(args.lighting).max_depth(), args.depth) {
        (None, depth) => depth,
        (Some(most), 0) => most,
        (Some(most), depth) => depth.min(most),
    }
}

fn settings(args: &Render, scene: &Scene) -> Result<Settings> {
    Ok(Settings {
        width: args.view.size.0,
        height: args.view.size.1,
        camera: args.view.camera_of(scene)?,
        estimator: estimator(args),
        selection: args.selection.into(),
        candidates: args.candidates,
        sampler: args.sampler.into(),
        depth: depth(args),
        time: args.scene.at as f32,
        seed: args.seed,
        aovs: args.layers.0.iter().any(|l| l.is_aov()),
        clamp: args.clamp.map(|limit| limit as f32),
    })
}

/// Oddities told in full; the rest is only counted.
const TOLD: usize = 5;

fn warn_of_oddities(scene: &Scene) {
    let warnings = &scene.report.warnings;
    for warning in warnings.iter().take(TOLD) {
        tracing::warn!("{warning}");
    }
    if warnings.len() > TOLD {
        tracing::warn!(
            "{} more; `runelight info` lists them",
            warnings.len() - TOLD
        );
    }
}

fn warn_of_unseen_lights(scene: &Scene, settings: &Settings) {
    if scene.features.point_lights && !settings.estimator.samples_lights() {
        tracing::warn!(
            "--estimator {} finds light only by hitting it: the {} light entities stay dark",
            settings.estimator.name(),
            scene.lights.len()
        );
    }
}

fn warn_of_bad_samples(scene: &Scene, film: &Film) {
    let counters = &film.counters;
    if counters.nonfinite > 0 {
        tracing::warn!(
            "{} samples were not finite and were left out",
            counters.nonfinite
        );
    }
    if scene.report.sealed && counters.escaped > 0 {
        tracing::warn!(
            "{} rays left the sealed level without hitting it, {:.3} in 1e9",
            counters.escaped,
            escapes::per_billion(counters)
        );
        for left in escapes::left(film, scene) {
            tracing::info!("{left}");
        }
    }
}

/// All that the picture depends on, for the EXR.
fn notes(
    args: &Render,
    scene: &Scene,
    settings: &Settings,
    device: &Device,
    film: &Film,
) -> Vec<(&'static str, Note)> {
    let text = |t: &str| Note::Text(t.to_owned());
    let c = &settings.camera;
    let pose = [
        c.position.x,
        c.position.y,
        c.position.z,
        c.pitch_deg,
        c.yaw_deg,
        c.roll_deg,
    ]
    .map(|v| v.to_string())
    .join(" ");
    vec![
        ("version", text(env!("CARGO_PKG_VERSION"))),
        ("level", text(&scene.name)),
        ("title", text(&scene.title)),
        ("device", text(&device.name)),
        ("driver", text(&device.driver)),
        ("samples", Note::Int(film.samples.into())),
        ("seed", Note::Text(settings.seed.to_string())),
        ("estimator", text(settings.estimator.name())),
        ("selection", text(settings.selection.name())),
        ("depth", Note::Int(settings.depth.into())),
        ("camera", Note::Text(pose)),
        ("cameraName", text(&c.name)),
        ("fov", Note::Float(c.fov_deg)),
        ("time", Note::Float(settings.time)),
        ("lighting", text(Lighting::from(args.lighting).name())),
        ("lights", text(args.scene.lights.name())),
        ("threshold", Note::Float(args.scene.threshold as f32)),
        (
            "emissionScale",
            Note::Float(args.scene.emission_scale as f32),
        ),
        ("styles", Note::Text(styles(film))),
        ("fog", Note::Text(fog(scene))),
        (
            "materials",
            Note::Text(args.scene.surfaces.materials.join(" ")),
        ),
        (
            "replacements",
            Note::Int((!args.scene.surfaces.no_textures).into()),
        ),
        ("clamp", Note::Text(clamp(settings, film))),
        ("nonfinite", Note::Int(film.counters.nonfinite as i64)),
        ("escaped", Note::Int(film.counters.escaped as i64)),
    ]
}

/// The clamp and the share of the light that was lost to it; empty without.
fn clamp(settings: &Settings, film: &Film) -> String {
    settings.clamp.map_or(String::new(), |limit| {
        format!("{limit} {}", film.clamped_share())
    })
}

/// Extinction per unit and albedo of the fog; empty without.
fn fog(scene: &Scene) -> String {
    scene.fog.map_or(String::new(), |f| {
        let [r, g, b] = f.albedo.to_array();
        format!("{} {r} {g} {b}", f.extinction)
    })
}

/// The brightness of each light style that has a layer, as `0 1, 10 0.9`.
fn styles(film: &Film) -> String {
    let pairs: Vec<String> = (film.styles.iter())
        .map(|s| format!("{} {}", s.number, s.brightness))
        .collect();
    pairs.join(", ")
}

/// What is said when the picture is done.
struct Report<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    device: &'a Device,
    film: &'a Film,
    stopped: Stopped,
    lighting: Lighting,
    spp_asked: u32,
    /// Load, build, render, write.
    seconds: [f64; 4],
    written: &'a [PathBuf],
}

impl Report<'_> {
    fn per_second(&self, count: u64) -> f64 {
        count as f64 / self.seconds[2].max(1e-9) / 1e6
    }

    /// An error estimate that JSON can hold.
    fn error(&self) -> Option<f64> {
        Some(self.film.estimated_relmse()).filter(|e| e.is_finite())
    }

    /// The clamp and what it cost; null without.
    fn clamp(&self) -> Value {
        let limit = self.settings.clamp.zip(self.film.clamped);
        limit.map_or(Value::Null, |(limit, clamped)| {
            json!({
                "limit": limit,
                "samples": clamped.samples,
                "lost_radiance": clamped.lost,
                "lost_share": self.film.clamped_share(),
            })
        })
    }

    fn json(&self) -> Value {
        let (film, counters) = (self.film, &self.film.counters);
        let [load, build, render, write] = self.seconds;
        json!({
            "level": self.scene.name,
            "device": self.device.name,
            "driver": self.device.driver,
            "size": format!("{}x{}", film.width, film.height),
            "spp": film.samples,
            "depth": self.settings.depth,
            "lighting": self.lighting.name(),
            "estimator": self.settings.estimator.name(),
            "selection": self.settings.selection.name(),
            "candidates": self.settings.candidates,
            "sampler": self.settings.sampler.name(),
            "seed": self.settings.seed,
            "fog": self.scene.fog.map(|f| json!({
                "extinction": f.extinction,
                "albedo": f.albedo.to_array(),
            })),
            "triangles": self.scene.triangle_count(),
            "emitters": self.scene.emitters.list.len() + self.scene.lights.len(),
            "seconds": { "load": load, "build": build, "render": render, "write": write },
            "paths": counters.paths,
            "rays": counters.rays,
            "mpaths_per_s": self.per_second(counters.paths),
            "mrays_per_s": self.per_second(counters.rays),
            "mean_radiance": film.mean_radiance(),
            "estimated_relmse": self.error(),
            "clamp": self.clamp(),
            "nonfinite": counters.nonfinite,
            "escaped": counters.escaped,
            "escaped_per_1e9_rays": escapes::per_billion(counters),
            "sealed": self.scene.report.sealed,
            "escapes": escapes::left(film, self.scene),
            "stopped": self.stopped.name(),
            "spp_asked": self.spp_asked,
            "camera": self.settings.camera.name,
            "outputs": self.written,
        })
    }

    fn text(&self) -> String {
        let names: Vec<String> = self
            .written
            .iter()
            .map(|p| p.display().to_string())
            .collect();
        let [load, build, render, write] = self.seconds;
        let why = match self.stopped {
            Stopped::Complete => String::new(),
            stopped => format!(" of {} ({})", self.spp_asked, stopped.name()),
        };
        let error = self
            .error()
            .map_or(String::new(), |e| format!(", relMSE about {e:.2e}"));
        let clamped = self.settings.clamp.map_or(String::new(), |limit| {
            let lost = 100.0 * self.film.clamped_share();
            format!("\nsamples clamped to {limit}: {lost:.3} % of the light is lost")
        });
        format!(
            "{}\n{} from {}, {}x{}, {} samples{why}{error}\n\
             {} on {}: {:.2} Mrays/s; load {load:.2} s, build {build:.2} s, render {render:.2} s, \
             write {write:.2} s{clamped}",
            names.join(" "),
            self.scene.name,
            self.settings.camera.name,
            self.film.width,
            self.film.height,
            self.film.samples,
            self.settings.estimator.name(),
            self.device.name,
            self.per_second(self.film.counters.rays),
        )
    }
}
