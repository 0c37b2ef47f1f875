//! What the options of a picture mean to the import, the renderer and the file; and what a picture's
//! maker should know of it.

use crate::cli::{ExrType, PictureArgs};
use crate::denoise::Denoise;
use crate::device::Device;
use crate::output::{Layer, Note, Screen, Style};
use crate::{Usage, escapes};
use anyhow::Result;
use scene::import::{ImportOptions, Lighting};
use scene::render::{Estimator, Film, Selection, Settings};
use scene::{Camera, Scene};

impl PictureArgs {
    /// Refuses options that exclude each other.
    ///
    /// # Errors
    /// The sentence says which and why.
    pub(crate) fn check(&self) -> Result<()> {
        if self.layers.0.contains(&Layer::Style)
            && Lighting::from(self.lighting) == Lighting::Lightmap
        {
            let why = "the level's baked light is not told apart by light style";
            return Err(Usage(format!("--layers style with --lighting lightmap: {why}")).into());
        }
        if self.clamp.is_some() && self.layers.0.contains(&Layer::Style) {
            let why = "light by light style is summed before a sample is whole";
            return Err(Usage(format!("--clamp with --layers style: {why}")).into());
        }
        Ok(())
    }

    /// What the import is told.
    ///
    /// # Errors
    /// When a file of materials cannot be read or is wrong.
    pub(crate) fn import_options(&self) -> Result<ImportOptions> {
        Ok(ImportOptions {
            light_lists: self.estimator().samples_lights()
                && Selection::from(self.selection) == Selection::Leaf,
            lighting: self.lighting.into(),
            styles_apart: self.layers.0.contains(&Layer::Style),
            ..self.scene.import_options()?
        })
    }

    /// How light is found: by looking for lights where nothing else shines.
    fn estimator(&self) -> Estimator {
        match Lighting::from(self.lighting) {
            Lighting::Physical => self.estimator.into(),
            Lighting::Compiler | Lighting::Lightmap | Lighting::Fullbright => Estimator::Nee,
        }
    }

    /// The deepest path vertex: no deeper than the light model means something.
    fn depth(&self) -> u32 {
        match (Lighting::from(self.lighting).max_depth(), self.depth) {
            (None, depth) => depth,
            (Some(most), 0) => most,
            (Some(most), depth) => depth.min(most),
        }
    }

    /// What the renderer is told, for the level's beginning.
    pub(crate) fn settings(&self, camera: Camera) -> Settings {
        Settings {
            width: self.view.size.0,
            height: self.view.size.1,
            camera,
            estimator: self.estimator(),
            selection: self.selection.into(),
            candidates: self.candidates,
            sampler: self.sampler.into(),
            depth: self.depth(),
            time: 0.0,
            seed: self.seed,
            aovs: self.denoise != Denoise::None || self.layers.0.iter().any(|l| l.is_aov()),
            clamp: self.clamp.map(|limit| limit as f32),
        }
    }

    /// How the picture is encoded, with its notes.
    pub(crate) fn style(&self, notes: Vec<(&'static str, Note)>) -> Style {
        let mut layers = self.layers.0.clone();
        if self.denoise != Denoise::None {
            layers.push(Layer::Denoised);
        }
        Style {
            layers,
            half: self.exr_type == ExrType::Half,
            exposure: self.exposure as f32,
            tonemap: self.tonemap,
            screen: Screen::default(),
            notes,
        }
    }

    /// All that the picture depends on, for the EXR.
    pub(crate) fn notes(
        &self,
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
            ("aperture", Note::Float(c.lens.map_or(0.0, |l| l.radius))),
            ("focus", Note::Float(c.lens.map_or(0.0, |l| l.focus))),
            ("time", Note::Float(settings.time)),
            ("denoise", text(self.denoise.name())),
            ("lighting", text(Lighting::from(self.lighting).name())),
            ("lights", text(self.scene.lights.name())),
            ("threshold", Note::Float(self.scene.threshold as f32)),
            (
                "emissionScale",
                Note::Float(self.scene.emission_scale as f32),
            ),
            ("styles", Note::Text(styles(film))),
            ("lightStyles", Note::Text(set_styles(&self.scene.styles))),
            ("fog", Note::Text(fog(scene))),
            (
                "materials",
                Note::Text(self.scene.surfaces.materials.join(" ")),
            ),
            (
                "replacements",
                Note::Int((!self.scene.surfaces.no_textures).into()),
            ),
            (
                "modelReplacements",
                Note::Int((!self.scene.surfaces.original_models).into()),
            ),
            (
                "smoothModels",
                Note::Int((!self.scene.surfaces.flat_models).into()),
            ),
            ("clamp", Note::Text(clamp(settings, film))),
            ("nonfinite", Note::Int(film.counters.nonfinite as i64)),
            ("escaped", Note::Int(film.counters.escaped as i64)),
        ]
    }
}

/// Oddities told in full; the rest is only counted.
const TOLD: usize = 5;

pub(crate) fn warn_of_oddities(scene: &Scene) {
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

pub(crate) fn warn_of_unseen_lights(scene: &Scene, settings: &Settings) {
    if scene.features.point_lights && !settings.estimator.samples_lights() {
        tracing::warn!(
            "--estimator {} finds light only by hitting it: the {} light entities stay dark",
            settings.estimator.name(),
            scene.lights.len()
        );
    }
}

pub(crate) fn warn_of_bad_samples(scene: &Scene, film: &Film) {
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

/// The light styles whose brightness was set, as `--light-style` takes them.
fn set_styles(set: &[(u16, f64)]) -> String {
    let words: Vec<String> = set.iter().map(|(n, b)| format!("{n}={b}")).collect();
    words.join(" ")
}

/// The brightness of each light style that has a layer, as `0 1, 10 0.9`.
fn styles(film: &Film) -> String {
    let pairs: Vec<String> = (film.styles.iter())
        .map(|s| format!("{} {}", s.number, s.brightness))
        .collect();
    pairs.join(", ")
}
