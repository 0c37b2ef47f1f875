//! What is shown instead of the picture, or beside it.

use super::App;
use crate::output::Layer;
use crate::view::look::layers;
use crate::view::looking::layer::values_at;
use crate::view::looking::survey::NONE;
use crate::view::looking::zoom::MOST;
use crate::view::looking::{Legend, Shown, Zoom, color};
use egui::{Color32, ComboBox, DragValue, Grid, Rect, Sense, Slider, Ui, pos2, vec2};
use std::path::PathBuf;

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_width(300.0);
    choose(app, ui);
    wants(app, ui);
    legend(app, ui);
    range(app, ui);
    zoom(app, ui);
    ui.separator();
    split(app, ui);
    ui.separator();
    values(app, ui);
}

fn reset(ui: &mut Ui, is_changed: bool) -> bool {
    let button = ui.add_enabled(is_changed, egui::Button::new("\u{21ba}").small());
    button.on_hover_text("back to the usual").clicked()
}

fn choose(app: &mut App, ui: &mut Ui) {
    let looking = &mut app.looking;
    ui.horizontal(|ui| {
        ui.label("Layer")
            .on_hover_text("what is shown when the eye rests; no part of the picture's command");
        ComboBox::from_id_salt("layer")
            .selected_text(looking.shown.name())
            .height(420.0)
            .show_ui(ui, |ui| {
                for (shown, name, hint) in Shown::ALL {
                    ui.selectable_value(&mut looking.shown, shown, name)
                        .on_hover_text(hint);
                }
            });
        if reset(ui, looking.shown != Shown::Picture) {
            looking.shown = Shown::Picture;
        }
    });
    if looking.shown == Shown::Style {
        ui.horizontal(|ui| {
            ui.label("Style").on_hover_text(
                "number of the light style; 0 is steady light and all that is no lamp",
            );
            let styles: Vec<u16> = (looking.film().iter())
                .flat_map(|film| film.styles.iter().map(|s| s.number))
                .collect();
            for number in styles {
                ui.selectable_value(&mut looking.style, number, number.to_string());
            }
        });
    }
}

/// What the layer needs that is not kept.
fn wants(app: &mut App, ui: &mut Ui) {
    let kept = &mut app.args.picture.layers;
    let shown = app.looking.shown;
    if shown.needs_layers() && !kept.0.iter().any(|l| l.is_aov()) {
        let button = ui.button("Keep all layers");
        if button
            .on_hover_text("the picture was made without them; its samples begin anew")
            .clicked()
        {
            *kept = layers(true);
        }
    }
    if shown == Shown::Style && !kept.0.contains(&Layer::Style) {
        let button = ui.button("Keep light styles apart");
        if button
            .on_hover_text("the level is imported anew, with lights of each style by themselves")
            .clicked()
        {
            kept.0.push(Layer::Style);
            kept.0.sort_unstable();
        }
    }
}

fn legend(app: &App, ui: &mut Ui) {
    match app.looking.legend() {
        None if app.looking.shown != Shown::Picture => {
            ui.weak("shown when the eye rests");
        }
        None | Some(Legend::Colours) => {}
        Some(Legend::Nothing(why)) => _ = ui.weak(*why),
        Some(Legend::Numbers(count)) => {
            _ = ui.label(format!("{count} in view, each in its own colour"))
        }
        Some(Legend::Names(names)) => {
            ui.horizontal(|ui| {
                for ([r, g, b], name) in names {
                    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
                    ui.painter()
                        .rect_filled(rect, 2.0, Color32::from_rgb(*r, *g, *b));
                    ui.label(*name);
                }
            });
        }
        Some(Legend::Range([low, high], unit)) => {
            let (rect, response) = ui.allocate_exact_size(vec2(290.0, 14.0), Sense::hover());
            const STEPS: u32 = 64;
            let painter = ui.painter();
            for i in 0..STEPS {
                let x = |i: u32| rect.left() + rect.width() * i as f32 / STEPS as f32;
                let [r, g, b] = color::viridis((i as f32 + 0.5) / STEPS as f32);
                let part =
                    Rect::from_min_max(pos2(x(i), rect.top()), pos2(x(i + 1), rect.bottom()));
                painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
            }
            response.on_hover_text("viridis: equal steps of the number are equal steps to the eye");
            ui.horizontal(|ui| {
                ui.label(format!("{low:.3}"));
                ui.weak(*unit);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.label(format!("{high:.3}"));
                });
            });
        }
    }
}

fn range(app: &mut App, ui: &mut Ui) {
    if !app.looking.shown.is_scalar() {
        return;
    }
    let found = match app.looking.legend() {
        Some(Legend::Range(range, _)) => *range,
        _ => [0.0, 1.0],
    };
    let set = &mut app.looking.range;
    ui.horizontal(|ui| {
        let mut auto = set.is_none();
        ui.checkbox(&mut auto, "range by itself")
            .on_hover_text("from the 1st to the 99th percentile of the pixels");
        *set = if auto {
            None
        } else {
            Some(set.unwrap_or(found))
        };
        if let Some([low, high]) = set {
            let speed = ((*high - *low).abs() * 0.01).max(1e-4);
            ui.add(DragValue::new(low).speed(speed))
                .on_hover_text("dark violet");
            ui.add(DragValue::new(high).speed(speed))
                .on_hover_text("yellow");
        }
    });
}

fn zoom(app: &mut App, ui: &mut Ui) {
    let zoom = &mut app.looking.zoom;
    ui.horizontal(|ui| {
        ui.label("Zoom").on_hover_text(
            "Ctrl and the wheel go nearer to what is under the pointer, Ctrl and drag moves it",
        );
        let mut scale = zoom.scale;
        ui.add(
            Slider::new(&mut scale, 1.0..=MOST)
                .logarithmic(true)
                .prefix("x ")
                .max_decimals(1),
        );
        zoom.approach(scale / zoom.scale, vec2(0.5, 0.5));
        if reset(ui, *zoom != Zoom::default()) {
            *zoom = Zoom::default();
        }
    });
}

fn split(app: &mut App, ui: &mut Ui) {
    let samples = app.samples();
    ui.horizontal(|ui| {
        let keep = ui.add_enabled(samples > 0, egui::Button::new("Keep as A"));
        let hint = "keep the picture as it is, to compare it with what comes";
        if keep.on_hover_text(hint).clicked()
            && let Err(why) = app.keep(format!("A, {samples} samples"))
        {
            app.notices.error(format!("{why:#}"));
        }
        let looking = &mut app.looking;
        if let Some(kept) = &looking.kept {
            ui.label(&kept.name);
            if ui.small_button("x").on_hover_text("forget it").clicked() {
                looking.kept = None;
            }
        }
    });
    let looking = &mut app.looking;
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut looking.file)
            .hint_text("an EXR or PNG to compare with");
        let typed = ui.add(field.desired_width(210.0));
        let entered = typed.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        if (ui.button("Open").clicked() || entered) && !looking.file.is_empty() {
            looking.open(PathBuf::from(looking.file.trim()));
        }
    });
    if looking.kept.is_some() {
        ui.horizontal(|ui| {
            ui.label("Split").on_hover_text(
                "left of it is what was kept; its handle in the picture can be dragged",
            );
            let mut percent = looking.split * 100.0;
            ui.add(
                Slider::new(&mut percent, 0.0..=100.0)
                    .suffix(" %")
                    .max_decimals(0),
            );
            looking.split = percent / 100.0;
            if reset(ui, looking.split != 0.5) {
                looking.split = 0.5;
            }
        });
    }
}

/// What is under the pointer.
fn values(app: &App, ui: &mut Ui) {
    let Some(film) = app.looking.film() else {
        ui.weak("the pixel's values are here when the eye rests");
        return;
    };
    let (window, at) = (ui.ctx().viewport_rect(), ui.ctx().pointer_latest_pos());
    let size = [film.width, film.height];
    let over = at.filter(|_| !ui.ctx().is_pointer_over_area());
    let pixel = over.and_then(|at| app.looking.zoom.pixel(at, window, size));
    Grid::new("values").num_columns(2).show(ui, |ui| {
        // The panel keeps its size while nothing is under the pointer.
        let lines = values_at(film, pixel.unwrap_or_default());
        for (name, value) in lines {
            ui.label(name);
            ui.monospace(if pixel.is_some() { value } else { "-".into() });
            ui.end_row();
        }
        if let (Some(survey), Some(pixel)) = (app.looking.survey(), pixel) {
            let met = survey.at(pixel, size);
            for (name, number) in [("leaf", met.leaf), ("emitter", met.emitter)] {
                ui.label(name);
                ui.monospace(if number == NONE {
                    "none".into()
                } else {
                    number.to_string()
                });
                ui.end_row();
            }
        }
    });
}
