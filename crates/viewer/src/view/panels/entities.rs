//! The entities of the level.

use super::App;
use crate::view::entities::{matches, place_of};
use egui::{ScrollArea, Ui};

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_width(300.0);
    let Some(loaded) = app.stage.as_ref().map(|s| s.loaded.clone()) else {
        ui.weak("no level yet");
        return;
    };
    let level = &loaded.level;
    ui.horizontal(|ui| {
        let hint = "part of a key or value, or key=value";
        let field = egui::TextEdit::singleline(&mut app.panels.entity).hint_text(hint);
        ui.add(field.desired_width(230.0));
        if ui
            .small_button("\u{21ba}")
            .on_hover_text("all of them")
            .clicked()
        {
            app.panels.entity.clear();
        }
    });
    let word = app.panels.entity.trim().to_owned();
    let found: Vec<usize> = (0..level.entities.len())
        .filter(|&i| matches(&level.entities[i], &word))
        .collect();
    ui.weak(format!(
        "{} of {} entities; a click goes there",
        found.len(),
        level.entities.len()
    ));
    let row = ui.text_style_height(&egui::TextStyle::Button) + 2.0 * ui.spacing().button_padding.y;
    let mut goes = None;
    ScrollArea::vertical()
        .max_height(280.0)
        .auto_shrink([false, true])
        .show_rows(ui, row, found.len(), |ui, rows| {
            for &number in &found[rows] {
                let entity = &level.entities[number];
                let name = entity
                    .get("targetname")
                    .map_or(String::new(), |n| format!(" \"{n}\""));
                let text = format!("{number} {}{name}", entity.classname());
                let is_somewhere = place_of(entity, &level.bsp).is_some();
                let button = ui.add_enabled(is_somewhere, egui::Button::new(text).truncate());
                let keys: Vec<String> = entity.iter().map(|(k, v)| format!("{k} {v}")).collect();
                if button.on_hover_text(keys.join("\n")).clicked() {
                    goes = Some(number);
                }
            }
        });
    if let Some(number) = goes {
        app.go_to_entity(number);
    }
}
