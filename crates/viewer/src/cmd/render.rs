//! `runelight render`.

use super::Context;
use crate::adaptive::{self, Adaptive};
use crate::cli::Render;
use crate::denoise::Denoise;
use crate::device::Device;
use crate::interrupt;
use crate::job::{self, Goal, Stopped};
use crate::level::Source;
use crate::output::{Format, Note, Outputs};
use crate::progress::Progress;
use crate::view::look::noted_command;
use crate::view::save::COMMAND;
use crate::{Outcome, Usage, escapes, shot};
use anyhow::Result;
use scene::Scene;
use scene::import::Lighting;
use scene::render::{Film, Settings};
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
    let picture = &args.picture;
    picture.check()?;
    let mut scene = source.load()?.import(&picture.import_options()?)?;
    shot::warn_of_oddities(&scene);
    let settings = Settings {
        time: picture.scene.at as f32,
        ..picture.settings(picture.view.camera_of(&scene, picture.scene.at)?)
    };
    scene.turn_sprites(&settings.camera);
    let scene = Arc::new(scene);
    shot::warn_of_unseen_lights(&scene, &settings);
    let loaded = Instant::now();

    let mut renderer = device.renderer(&scene, &settings)?;
    if picture.adaptive {
        renderer = Box::new(Adaptive::new(renderer, adaptive::pilot(picture.spp)));
    }
    let built = Instant::now();

    let goal = Goal {
        spp: picture.spp,
        deadline: (picture.time_limit).map(|s| context.start + Duration::from_secs_f64(s)),
        target_error: picture.target_error,
    };
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let mut progress = Progress::new(!context.global.quiet, &goal, pixels);
    let stopped = job::run(&mut *renderer, &goal, &mut progress, &interrupt::asked)?;
    drop(progress);
    let mut film = renderer.film()?;
    let rendered = Instant::now();

    picture.denoise.apply(&mut film);
    let mut notes = picture.notes(&scene, &settings, &device, &film);
    let made = noted_command(args, &context.global, &settings, film.samples);
    notes.push((COMMAND, Note::Text(made)));
    let style = picture.style(notes);
    let written = outputs.write(&film, &style)?;
    shot::warn_of_bad_samples(&scene, &film);
    let result = Report {
        scene: &scene,
        settings: &settings,
        device: &device,
        film: &film,
        stopped,
        lighting: picture.lighting.into(),
        denoise: picture.denoise,
        spp_asked: picture.spp,
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

/// What is said when the picture is done.
struct Report<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    device: &'a Device,
    film: &'a Film,
    stopped: Stopped,
    lighting: Lighting,
    denoise: Denoise,
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
            "denoise": self.denoise.name(),
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
            "lens": self.settings.camera.lens.map(|l| json!({"radius": l.radius, "focus": l.focus})),
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
