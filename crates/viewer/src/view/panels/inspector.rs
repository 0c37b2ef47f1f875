//! What is at the pixel that was clicked.

use super::App;
use crate::view::inspect::Report;
use egui::{Color32, Grid, ScrollArea, Sense, Stroke, TextureHandle, Ui, vec2};

/// Largest side of a texture's picture, in points.
const PICTURE: f32 = 96.0;

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_width(320.0);
    if app.is_inspecting() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label("sending rays");
        });
    }
    let Some(report) = &app.inspected else {
        ui.label("click on the picture: what is there, and where its light comes from");
        return;
    };
    let goes = facts(report, ui);
    textures(report, &app.inspected_pictures, ui);
    entity(report, ui);
    lights(report, ui);
    if let Some(number) = goes {
        app.go_to_entity(number);
    }
}

/// What is there; a number if one wants to go to that entity.
fn facts(report: &Report, ui: &mut Ui) -> Option<usize> {
    let seen = &report.seen;
    let mut goes = None;
    Grid::new("facts").num_columns(2).show(ui, |ui| {
        let mut line = |name: &str, hint: &str, text: String| {
            ui.label(name).on_hover_text(hint);
            ui.label(text);
            ui.end_row();
        };
        let three = |v: glam::DVec3| {
            // No minus before a zero.
            let [x, y, z] = v.to_array().map(|c| (c * 100.0).round() / 100.0 + 0.0);
            format!("{x:.2} {y:.2} {z:.2}")
        };
        line("Position", "world space, units", three(seen.position));
        line("Normal", "of the face, towards the eye", three(seen.normal));
        line(
            "Distance",
            "from the eye",
            format!("{:.2} units", seen.distance),
        );
        line("Face", "its number in the file", seen.face.to_string());
        let [u, v] = seen.texel;
        line(
            "Texture",
            "and the texel, from the left and from the top",
            format!("{} at {u} {v}", report.texture),
        );
        let leaf = report.leaf.map_or("none".into(), |l| l.to_string());
        line(
            "Leaf",
            "in front of it, and what fills that",
            format!("{leaf}, {}", report.contents),
        );
        line(
            "Albedo",
            "share of light that is reflected",
            three(seen.albedo),
        );
        line("Emitted", "radiance by itself", three(seen.emitted));
    });
    if let Some((number, keys)) = &report.entity {
        let class = keys
            .iter()
            .find(|(k, _)| k == "classname")
            .map_or("", |(_, v)| v);
        ui.horizontal(|ui| {
            ui.label(format!("Entity {number}: {class}"));
            // The world is everywhere.
            if *number > 0 && ui.small_button("go there").clicked() {
                goes = Some(*number);
            }
        });
    }
    goes
}

fn textures(report: &Report, pictures: &[Option<TextureHandle>; 2], ui: &mut Ui) {
    ui.horizontal(|ui| {
        for (picture, hint) in pictures.iter().zip([
            "the texture".to_owned(),
            format!(
                "its emitting texels, {:.1} % of all",
                report.emitting * 100.0
            ),
        ]) {
            let Some(picture) = picture else { continue };
            let size = picture.size_vec2();
            let shown = size * (PICTURE / size.max_elem());
            let image = egui::Image::from_texture((picture.id(), shown)).sense(Sense::hover());
            let response = ui.add(image).on_hover_text(hint);
            // Where on it the pixel is.
            let [u, v] = report.seen.texel.map(|t| t as f32 + 0.5);
            let at = response.rect.min + vec2(u, v) * (shown.x / size.x);
            ui.painter()
                .circle_stroke(at, 3.0, Stroke::new(1.5, Color32::from_rgb(255, 60, 60)));
        }
    });
}

fn entity(report: &Report, ui: &mut Ui) {
    let Some((_, keys)) = &report.entity else {
        return;
    };
    ui.collapsing("Keys", |ui| {
        ScrollArea::vertical().max_height(120.0).show(ui, |ui| {
            Grid::new("entity keys").num_columns(2).show(ui, |ui| {
                for (key, value) in keys {
                    ui.label(key);
                    ui.monospace(value);
                    ui.end_row();
                }
            });
        });
    });
}

fn lights(report: &Report, ui: &mut Ui) {
    ui.separator();
    let [total, error] = report.total;
    ui.label(format!(
        "Light that reaches it directly: {total:.4} \u{b1} {error:.4}"
    ))
    .on_hover_text("luminance that a white surface would show there, with its standard error");
    if report.lights.is_empty() {
        ui.weak("no light was found");
        return;
    }
    // What is left below, so that the panel ends above the window's edge.
    let below = ui.ctx().viewport_rect().bottom() - ui.cursor().top() - 48.0;
    let height = below.clamp(64.0, 320.0);
    ScrollArea::vertical()
        .max_height(height)
        .min_scrolled_height(height)
        .auto_shrink([false, true])
        .show(ui, |ui| {
            Grid::new("lights")
                .num_columns(3)
                .striped(true)
                .show(ui, |ui| {
                    ui.weak("share");
                    ui.weak("style")
                        .on_hover_text("number of the light style; 0 is steady");
                    ui.weak("light");
                    ui.end_row();
                    for light in &report.lights {
                        let [share, error] = light.share.map(|s| s * 100.0);
                        ui.monospace(format!("{share:5.1} \u{b1} {error:.1} %"));
                        ui.label(light.style.to_string());
                        let [r, g, b] = light.light;
                        let at = light
                            .at
                            .map_or("far away, or in many places".into(), |[x, y, z]| {
                                format!("at {x:.0} {y:.0} {z:.0}")
                            });
                        let hint = format!("{at}; light {r:.4} {g:.4} {b:.4} (irradiance over pi)");
                        ui.add(egui::Label::new(&light.name).truncate())
                            .on_hover_text(hint);
                        ui.end_row();
                    }
                });
            if report.more > 0 {
                ui.weak(format!("and {} weaker ones", report.more));
            }
        });
}
