//! What an export says about itself.

use super::{Folder, Job, MANIFEST};
use anyhow::Result;
use serde_json::{Map, Value, json};
use std::io::Write as _;
use std::path::PathBuf;

/// Something that another renderer shows otherwise than Runelight does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason {
    /// What it is about: `spotlights`, `sky`, ...
    pub what: &'static str,
    /// A sentence.
    pub why: String,
    /// Whether it can be told from noise: `false` is for differences that are bounded far below
    /// what a picture shows, or that only some pixels have, as the sentence says.
    pub visible: bool,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The directory, or the file.
    pub path: PathBuf,
    /// The manifest, as it stands in the directory.
    pub manifest: Value,
}

/// The manifest of an export into `folder`, without the files.
pub(super) fn describe(
    job: &Job<'_>,
    format: &str,
    reasons: &[Reason],
    counts: Map<String, Value>,
) -> Map<String, Value> {
    let camera = &job.settings.camera;
    let position = camera.position.to_array();
    let reasons: Vec<Value> = (reasons.iter())
        .map(|r| json!({"what": r.what, "why": r.why, "visible": r.visible}))
        .collect();
    let exact = reasons.iter().all(|r| r["visible"] == false);
    let object = json!({
        "runelight": env!("CARGO_PKG_VERSION"),
        "format": format,
        "level": job.scene.name,
        "title": job.scene.title,
        "exact": exact,
        "differences": reasons,
        "size": [job.settings.width, job.settings.height],
        "spp": job.spp,
        "depth": job.settings.depth,
        "seed": job.settings.seed,
        "time": job.settings.time,
        "camera": {
            "name": camera.name,
            "position": position,
            "angles_deg": [camera.pitch_deg, camera.yaw_deg, camera.roll_deg],
            "fov_deg": camera.fov_deg,
            "lens": camera.lens.map(|l| json!({"radius": l.radius, "focus": l.focus})),
        },
        "sealed": job.scene.report.sealed,
        "counts": counts,
    });
    match object {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// Writes the manifest as the last file, and moves the directory into place.
pub(super) fn finish(mut folder: Folder, mut manifest: Map<String, Value>) -> Result<Exported> {
    let files: Vec<Value> = (folder.files().iter())
        .map(|(path, bytes)| json!({"path": path, "bytes": bytes}))
        .collect();
    manifest.insert("files".into(), files.into());
    let manifest = Value::Object(manifest);
    let mut text = serde_json::to_string_pretty(&manifest)?;
    text.push('\n');
    folder.write(MANIFEST, |file| Ok(file.write_all(text.as_bytes())?))?;
    let path = folder.target().to_owned();
    folder.commit()?;
    Ok(Exported { path, manifest })
}
