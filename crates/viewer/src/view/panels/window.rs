//! The window itself: how often it is drawn, how large its words are, in which colours.

use super::App;
use crate::view::display::PACES;
use egui::{Button, ComboBox, DragValue, Grid, Slider, ThemePreference, Ui};

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    Grid::new("window").num_columns(3).show(ui, |ui| {
        ui.label("Pictures are shown")
            .on_hover_text("what the display and its driver offer");
        let display = &mut app.display;
        let name = |pace| PACES.iter().find(|p| p.0 == pace).map_or("", |p| p.1);
        ComboBox::from_id_salt("pace")
            .selected_text(name(display.pace))
            .show_ui(ui, |ui| {
                for (pace, name, hint) in PACES {
                    let known = display.paces.contains(&pace);
                    ui.add_enabled_ui(known, |ui| {
                        ui.selectable_value(&mut display.pace, pace, name)
                            .on_hover_text(hint)
                            .on_disabled_hover_text("this window does not offer it");
                    });
                }
            });
        if reset(ui, display.pace != rt::Pace::Vsync) {
            display.pace = rt::Pace::Vsync;
        }
        ui.end_row();

        ui.label("Frames at most")
            .on_hover_text("a second: fewer leave the device for others");
        ui.horizontal(|ui| {
            let mut on = display.most_fps.is_some();
            ui.checkbox(&mut on, "");
            display.most_fps = on.then(|| display.most_fps.unwrap_or(60.0));
            if let Some(fps) = &mut display.most_fps {
                ui.add(DragValue::new(fps).range(1.0..=1000.0).max_decimals(0));
            }
        });
        if reset(ui, display.most_fps.is_some()) {
            display.most_fps = None;
        }
        ui.end_row();

        ui.label("Colours").on_hover_text("of the panels");
        let mut theme = ui.ctx().options(|o| o.theme_preference);
        ui.horizontal(|ui| theme.radio_buttons(ui));
        let usual = ThemePreference::default();
        if reset(ui, theme != usual) {
            theme = usual;
        }
        if theme != ui.ctx().options(|o| o.theme_preference) {
            ui.ctx().set_theme(theme);
        }
        ui.end_row();

        ui.label("Size of words")
            .on_hover_text("in percent of the system's; Ctrl with + and - changes it, too");
        let mut percent = 100.0 * ui.ctx().zoom_factor();
        let slider = Slider::new(&mut percent, 50.0..=300.0).suffix(" %");
        // While it is dragged it would run away under the pointer.
        let response = ui.add(slider.step_by(10.0).update_while_editing(false));
        if response.drag_stopped() || response.lost_focus() || response.clicked() {
            ui.ctx().set_zoom_factor(percent / 100.0);
        }
        if reset(ui, (percent - 100.0).abs() > 0.5) {
            ui.ctx().set_zoom_factor(1.0);
        }
        ui.end_row();

        ui.label("Panels")
            .on_hover_text("can be dragged by any part that is no button");
        let moved = app.panels.moved.len();
        ui.label(if moved == 0 {
            "where they belong".into()
        } else {
            format!("{moved} moved")
        });
        if reset(ui, moved > 0) {
            app.panels.moved.clear();
        }
        ui.end_row();
    });
}

/// A button that takes a setting back to the usual.
fn reset(ui: &mut Ui, changed: bool) -> bool {
    let button = ui.add_enabled(changed, Button::new("\u{21ba}").small());
    button.on_hover_text("back to the usual").clicked()
}
