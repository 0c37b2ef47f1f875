//! How the picture is made. Each setting is an option of `runelight render`, with its range there.

use super::App;
use crate::cli::{EstimatorName, LightingName, Lights, SamplerName, SelectionName};
use crate::denoise::Denoise;
use crate::tonemap::Tonemap;
use crate::view::look::{Preset, defaults};
use clap::ValueEnum;
use egui::{ComboBox, DragValue, Grid, Slider, Ui, Widget};
use scene::camera::DEFAULT_FOV_DEG;
use scene::import::{FogKeys, MAX_FOG_DENSITY};
use scene::render::MOST_CANDIDATES;

/// A row: name, the setting, and a button that takes it back to `usual` where it is something else.
fn row<T: PartialEq + Clone>(
    ui: &mut Ui,
    (name, hint): (&str, &str),
    value: &mut T,
    usual: &T,
    edit: impl FnOnce(&mut Ui, &mut T),
) {
    ui.label(name).on_hover_text(hint);
    ui.horizontal(|ui| {
        edit(ui, value);
    });
    let changed = value != usual;
    let reset = ui.add_enabled(changed, egui::Button::new("\u{21ba}").small());
    if reset.on_hover_text("back to the usual").clicked() {
        value.clone_from(usual);
    }
    ui.end_row();
}

/// One of several, each with the help of the command line.
fn choice<T: ValueEnum + PartialEq>(ui: &mut Ui, id: &str, value: &mut T) {
    let name = |v: &T| {
        v.to_possible_value()
            .map(|p| p.get_name().to_owned())
            .unwrap_or_default()
    };
    ComboBox::from_id_salt(id)
        .selected_text(name(value))
        .show_ui(ui, |ui| {
            for one in T::value_variants() {
                let possible = one.to_possible_value();
                let help = possible.and_then(|p| p.get_help().map(ToString::to_string));
                let entry = ui.selectable_label(one == value, name(one));
                if entry.on_hover_text(help.unwrap_or_default()).clicked() {
                    *value = one.clone();
                }
            }
        });
}

/// Something that may be off: a box to tick, and its value.
fn optional(
    ui: &mut Ui,
    value: &mut Option<f64>,
    first: f64,
    edit: impl FnOnce(&mut Ui, &mut f64),
) {
    let mut on = value.is_some();
    ui.checkbox(&mut on, "");
    *value = on.then(|| value.unwrap_or(first));
    if let Some(value) = value {
        edit(ui, value);
    }
}

fn slider(
    range: std::ops::RangeInclusive<f64>,
    suffix: &'static str,
) -> impl FnOnce(&mut Ui, &mut f64) {
    move |ui, value| {
        Slider::new(value, range).suffix(suffix).ui(ui);
    }
}

/// Where a lens is focused at first, in units.
const FOCUS: f64 = 256.0;

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    let usual = defaults().picture;
    let picture = &mut app.args.picture;
    let mut focuses = false;
    ui.checkbox(&mut app.auto_exposure.on, "exposure by itself")
        .on_hover_text(
            "so that the middle of the picture is grey; what it has found stays when it is off",
        );
    ui.horizontal(|ui| {
        for (preset, name, hint) in Preset::ALL {
            if ui.button(name).on_hover_text(hint).clicked() {
                preset.apply(picture);
            }
        }
    });
    egui::CollapsingHeader::new("Shown")
        .default_open(true)
        .show(ui, |ui| {
            Grid::new("shown").num_columns(3).show(ui, |ui| {
                let hint = ("Exposure", "stops by which the picture is brightened, -8 to 8");
                row(
                    ui,
                    hint,
                    &mut picture.exposure,
                    &usual.exposure,
                    slider(-8.0..=8.0, " EV"),
                );
                let hint = ("Tone curve", "from radiance to the display");
                row(
                    ui,
                    hint,
                    &mut picture.tonemap,
                    &usual.tonemap,
                    |ui, v: &mut Tonemap| {
                        choice(ui, "tonemap", v);
                    },
                );
                let hint = (
                    "Denoiser",
                    "what becomes of noise where the picture is looked at; what is traced stays as it is",
                );
                row(
                    ui,
                    hint,
                    &mut picture.denoise,
                    &usual.denoise,
                    |ui, v: &mut Denoise| {
                        choice(ui, "denoise", v);
                    },
                );
                let hint = (
                    "Field of view",
                    "degrees across at 4:3, 10 to 170; wider windows show more at the sides",
                );
                let mut fov = picture.view.fov.unwrap_or(f64::from(DEFAULT_FOV_DEG));
                row(
                    ui,
                    hint,
                    &mut fov,
                    &f64::from(DEFAULT_FOV_DEG),
                    slider(10.0..=170.0, "\u{b0}"),
                );
                picture.view.fov = Some(fov);
                let hint = (
                    "Aperture",
                    "radius of the lens in units, 0 to 32: what is not in focus blurs; 0 is a pinhole",
                );
                let mut aperture = picture.view.aperture.unwrap_or(0.0);
                row(ui, hint, &mut aperture, &0.0, slider(0.0..=32.0, " u"));
                if aperture > 0.0 {
                    let hint = ("Focus", "distance of what is sharp, along the view, in units, 1 to 1000000");
                    let mut focus = picture.view.focus.unwrap_or(FOCUS);
                    row(ui, hint, &mut focus, &FOCUS, |ui, v| {
                        DragValue::new(v).range(1.0..=1e6).suffix(" u").ui(ui);
                        let button = ui.small_button("middle");
                        focuses = button.on_hover_text("on what is in the middle").clicked();
                        ui.toggle_value(&mut app.focus_by_click, "click")
                            .on_hover_text("on what is clicked on next");
                    });
                    picture.view.focus = Some(focus);
                    picture.view.aperture = Some(aperture);
                } else {
                    (picture.view.aperture, picture.view.focus) = (None, None);
                }
                let hint = (
                    "Level time",
                    "seconds, 0 to 1000000: animated and scrolling textures, light styles",
                );
                row(ui, hint, &mut picture.scene.at, &usual.scene.at, |ui, v| {
                    DragValue::new(v)
                        .range(0.0..=1e6)
                        .speed(0.05)
                        .suffix(" s")
                        .ui(ui);
                });
                let hint = (
                    "Size",
                    "of the picture, in percent of the window's, 10 to 100: smaller is faster",
                );
                row(ui, hint, &mut app.panels.percent, &100, |ui, v| {
                    Slider::new(v, 10..=100).suffix(" %").ui(ui);
                });
            });
        });
    egui::CollapsingHeader::new("Quality").default_open(true).show(ui, |ui| {
        Grid::new("quality").num_columns(3).show(ui, |ui| {
            let hint = ("Samples", "per pixel, at which the picture is done, 1 to 16777216");
            row(ui, hint, &mut picture.spp, &super::super::SAMPLES, |ui, v| {
                DragValue::new(v).range(1..=1 << 24).speed(8).ui(ui);
            });
            let hint = ("Target error", "estimated relMSE below which the picture is done, 0.000001 to 1");
            row(ui, hint, &mut picture.target_error, &usual.target_error, |ui, v| {
                optional(ui, v, 0.01, |ui, v| {
                    Slider::new(v, 1e-6..=1.0).logarithmic(true).ui(ui);
                });
            });
            let hint = ("Time limit", "seconds of work after which the picture is done, 0.1 to 10000000");
            row(ui, hint, &mut picture.time_limit, &usual.time_limit, |ui, v| {
                optional(ui, v, 60.0, |ui, v| {
                    DragValue::new(v).range(0.1..=1e7).suffix(" s").ui(ui);
                });
            });
            let hint = ("Samples per frame", "at most, 1 to 256; fewer where a frame would take too long");
            row(ui, hint, &mut app.pace.most_samples, &16, |ui, v| {
                Slider::new(v, 1..=256).logarithmic(true).ui(ui);
            });
            let hint = ("Frame budget", "milliseconds of tracing in a frame, 2 to 250: more is faster, less is livelier");
            row(ui, hint, &mut app.panels.budget_ms, &super::BUDGET_MS, slider(2.0..=250.0, " ms"));
            let hint = (
                "Depth",
                "path vertices after the camera, 0 to 1000: 1 shows what emits, 2 adds direct light; 0 is without limit",
            );
            row(ui, hint, &mut picture.depth, &usual.depth, |ui, v| {
                Slider::new(v, 0..=32).clamping(egui::SliderClamping::Never).ui(ui);
                *v = (*v).min(1000);
            });
            let hint = ("Estimator", "how light is found");
            row(ui, hint, &mut picture.estimator, &usual.estimator, |ui, v: &mut EstimatorName| {
                choice(ui, "estimator", v);
            });
            let hint = ("Selection", "how a light is chosen");
            row(ui, hint, &mut picture.selection, &usual.selection, |ui, v: &mut SelectionName| {
                choice(ui, "selection", v);
            });
            let hint = ("Candidates", "light samples of which one is kept and looked at, 1 to 32");
            row(ui, hint, &mut picture.candidates, &usual.candidates, |ui, v| {
                Slider::new(v, 1..=MOST_CANDIDATES).ui(ui);
            });
            let hint = ("Sampler", "where random numbers come from");
            row(ui, hint, &mut picture.sampler, &usual.sampler, |ui, v: &mut SamplerName| {
                choice(ui, "sampler", v);
            });
            let hint = ("Clamp", "radiance at which samples are cut off, 0.001 to 1000000: fewer bright dots, some light lost");
            row(ui, hint, &mut picture.clamp, &usual.clamp, |ui, v| {
                optional(ui, v, 10.0, |ui, v| {
                    DragValue::new(v).range(1e-3..=1e6).speed(0.1).ui(ui);
                });
            });
            let hint = ("Seed", "of all random numbers, 0 to 18446744073709551615");
            row(ui, hint, &mut picture.seed, &usual.seed, |ui, v| {
                DragValue::new(v).ui(ui);
            });
        });
    });
    egui::CollapsingHeader::new("Light")
        .default_open(true)
        .show(ui, |ui| {
            Grid::new("light").num_columns(3).show(ui, |ui| {
                let scene = &mut picture.scene;
                let plain = &usual.scene;
                let hint = (
                    "Threshold",
                    "relative luminance from which a fullbright texel emits, 0 to 1",
                );
                row(
                    ui,
                    hint,
                    &mut scene.threshold,
                    &plain.threshold,
                    slider(0.0..=1.0, ""),
                );
                let hint = ("Emission", "radiance of a white emitting texel, 0 to 100");
                row(
                    ui,
                    hint,
                    &mut scene.emission_scale,
                    &plain.emission_scale,
                    |ui, v| {
                        Slider::new(v, 0.0..=100.0).logarithmic(true).ui(ui);
                    },
                );
                let hint = ("Lamps", "which of them shine");
                row(
                    ui,
                    hint,
                    &mut scene.lights,
                    &plain.lights,
                    |ui, v: &mut Lights| {
                        choice(ui, "lights", v);
                    },
                );
                let hint = ("Lighting", "what lights the level");
                row(
                    ui,
                    hint,
                    &mut picture.lighting,
                    &usual.lighting,
                    |ui, v: &mut LightingName| {
                        choice(ui, "lighting", v);
                    },
                );
                let hint = (
                    "Fog",
                    "density in place of the level's, 0 to 100; 0 is none",
                );
                let mut fog = scene.fog.map(|keys| f64::from(keys.density));
                row(ui, hint, &mut fog, &None, |ui, v| {
                    optional(ui, v, 0.05, |ui, v| {
                        let most = f64::from(MAX_FOG_DENSITY);
                        DragValue::new(v).range(0.0..=most).speed(0.002).ui(ui);
                    });
                });
                scene.fog = fog.map(|density| FogKeys {
                    density: density as f32,
                    ..scene.fog.unwrap_or(FogKeys::OFF)
                });
                if let Some(keys) = &mut scene.fog {
                    let hint = ("Fog colour", "as it is shown");
                    row(ui, hint, &mut keys.color, &FogKeys::OFF.color, |ui, v| {
                        ui.color_edit_button_rgb(v);
                    });
                }
                let hint = ("Sky fog", "share of the sky that the fog veils, 0 to 1");
                row(ui, hint, &mut scene.skyfog, &plain.skyfog, |ui, v| {
                    optional(ui, v, 0.5, slider(0.0..=1.0, ""));
                });
            });
        });
    egui::CollapsingHeader::new("Level").show(ui, |ui| {
        let entities = &mut picture.scene.entities;
        let mut shown = !entities.no_entities;
        ui.checkbox(&mut shown, "monsters, items and flames")
            .on_hover_text("the point entities of a game of this skill");
        entities.no_entities = !shown;
        ui.add_enabled(
            shown && !entities.deathmatch,
            Slider::new(&mut entities.skill, 0..=3).text("skill"),
        )
        .on_hover_text("0 easy, 1 normal, 2 hard, 3 nightmare: which monsters and items there are");
        ui.add_enabled(
            shown,
            egui::Checkbox::new(&mut entities.deathmatch, "a game of deathmatch"),
        )
        .on_hover_text("with its items, and without monsters");
        let surfaces = &mut picture.scene.surfaces;
        let mut replaced = !surfaces.no_textures;
        ui.checkbox(&mut replaced, "replacement textures")
            .on_hover_text("pictures in textures/ in place of the level's");
        surfaces.no_textures = !replaced;
        let mut replaced = !surfaces.original_models;
        ui.checkbox(&mut replaced, "replacement models")
            .on_hover_text("MD3 and MD5 models in place of alias models");
        surfaces.original_models = !replaced;
        let mut smooth = !surfaces.flat_models;
        ui.checkbox(&mut smooth, "smooth models")
            .on_hover_text("facets of models are shaded as parts of a round surface");
        surfaces.flat_models = !smooth;
        let mut families = surfaces.materials.iter().any(|m| m == "default");
        if ui
            .checkbox(&mut families, "materials of common textures")
            .on_hover_text("metal, water and the like by texture name")
            .changed()
        {
            surfaces.materials.retain(|m| m != "default");
            if families {
                surfaces.materials.insert(0, "default".into());
            }
        }
        let mut all = picture.layers.0.len() > 1;
        if ui
            .checkbox(&mut all, "all layers")
            .on_hover_text("keep what an EXR can hold besides the picture; a little slower")
            .changed()
        {
            picture.layers = super::super::look::layers(all);
        }
        let (scene, plain) = (&mut picture.scene, &usual.scene);
        let changed = scene.entities != plain.entities || scene.surfaces != plain.surfaces;
        let reset = ui.add_enabled(changed, egui::Button::new("\u{21ba} level").small());
        if reset
            .on_hover_text("all of the level back to the usual")
            .clicked()
        {
            scene.entities.clone_from(&plain.entities);
            scene.surfaces.clone_from(&plain.surfaces);
        }
    });
    if focuses {
        app.focus_on_middle();
    }
}
