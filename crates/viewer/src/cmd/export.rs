//! `runelight export`.

use super::Context;
use crate::cli::{Export, ExportFormat};
use crate::export::{self, Exported, Job};
use crate::level::Source;
use crate::{Outcome, interrupt};
use anyhow::Result;
use scene::import::ImportOptions;
use scene::render::{CANDIDATES, Estimator, Sampler, Selection, Settings};
use serde_json::{Value, json};
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// When the level cannot be loaded, or the export cannot be written.
pub fn run(args: &Export, context: &Context) -> Result<Outcome> {
    interrupt::install()?;
    let source = Source::new(args.level.as_deref(), &context.global)?;
    let target = (args.output.clone())
        .unwrap_or_else(|| format!("{}-{}", source.name(), args.format.name()).into());
    let options = ImportOptions {
        light_lists: false,
        ..args.scene.import_options()?
    };
    let mut scene = source.load()?.import(&options)?;
    let settings = Settings {
        width: args.view.size.0,
        height: args.view.size.1,
        camera: args.view.camera_of(&scene, args.scene.at)?,
        estimator: Estimator::Mis,
        selection: Selection::default(),
        candidates: CANDIDATES,
        sampler: Sampler::Independent,
        depth: args.depth,
        time: args.scene.at as f32,
        seed: args.seed.into(),
        aovs: false,
        clamp: None,
    };
    scene.turn_sprites(&settings.camera);
    let job = Job {
        scene: &scene,
        settings: &settings,
        spp: args.spp,
    };
    let loaded = Instant::now();
    let exported = match args.format {
        ExportFormat::Mitsuba => export::mitsuba::write(&job, &target)?,
        ExportFormat::Gltf => export::gltf::write(&job, &target)?,
    };
    let seconds = [
        (loaded - context.start).as_secs_f64(),
        loaded.elapsed().as_secs_f64(),
    ];
    context.print(&if context.json {
        json_of(&exported, seconds).to_string()
    } else {
        text_of(&exported, seconds)
    })?;
    Ok(Outcome::Done)
}

/// The manifest, with where it is and how long it took.
fn json_of(exported: &Exported, [load, write]: [f64; 2]) -> Value {
    let mut value = exported.manifest.clone();
    if let Value::Object(map) = &mut value {
        map.insert("output".into(), json!(exported.path));
        map.insert("seconds".into(), json!({"load": load, "write": write}));
    }
    value
}

fn text_of(exported: &Exported, [load, write]: [f64; 2]) -> String {
    let m = &exported.manifest;
    let files = m["files"].as_array().map_or(&[][..], Vec::as_slice);
    let bytes: u64 = files.iter().filter_map(|f| f["bytes"].as_u64()).sum();
    let counts: Vec<String> = (m["counts"].as_object().into_iter().flatten())
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    let mut text = format!(
        "{}\n{} for {}: {}; {} files, {:.1} MB\nload {load:.2} s, write {write:.2} s",
        exported.path.display(),
        m["level"].as_str().unwrap_or_default(),
        m["format"].as_str().unwrap_or_default(),
        counts.join(", "),
        files.len(),
        bytes as f64 / 1e6,
    );
    for difference in m["differences"].as_array().into_iter().flatten() {
        let [what, why] = ["what", "why"].map(|key| difference[key].as_str().unwrap_or_default());
        text += &format!("\n{what}: {why}");
    }
    text
}
