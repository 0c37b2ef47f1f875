//! Where the eye is, and where it can go.

use super::App;
use crate::cli::CameraChoice;
use crate::view::fly::{Eye, SPEEDS};
use egui::{Slider, Ui};

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    let text = app.eye.pose().map(|v| format!("{v:.2}")).join(" ");
    ui.horizontal(|ui| {
        ui.monospace(&text)
            .on_hover_text("x y z pitch yaw roll, of the eye");
        if ui.button("Copy").on_hover_text("for --camera").clicked() {
            ui.ctx()
                .copy_text(app.eye.pose().map(|v| v.to_string()).join(" "));
        }
    });
    ui.horizontal(|ui| {
        let hint = "x y z pitch yaw roll";
        let field = egui::TextEdit::singleline(&mut app.panels.viewpos).hint_text(hint);
        let typed = ui.add(field.desired_width(220.0));
        let entered = typed.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let go = ui
            .button("Go")
            .on_hover_text("the eye, 22 above what an engine's viewpos prints");
        if go.clicked() || entered {
            match crate::cli::parse_camera(&app.panels.viewpos) {
                Ok(CameraChoice::Pose(pose)) => {
                    if let Some(eye) = Eye::from_pose(pose) {
                        app.go_to(eye);
                    }
                }
                Ok(CameraChoice::Index(index)) => app.go_to_camera(index),
                Ok(CameraChoice::Name(name)) => go_by_name(app, &name),
                Err(why) => app.notices.error(why),
            }
        }
    });
    let [least, most, _] = SPEEDS;
    let speed = Slider::new(&mut app.flight.speed, least..=most).logarithmic(true);
    ui.add(speed.text("units/s").max_decimals(0))
        .on_hover_text("speed of flight; the mouse wheel changes it too");
    let names: Vec<String> = (app.stage.iter())
        .flat_map(|s| s.scene.cameras.iter().map(|c| c.name.clone()))
        .collect();
    bookmarks(app, ui);
    ui.separator();
    egui::ScrollArea::vertical()
        .max_height(160.0)
        .show(ui, |ui| {
            for (i, name) in names.iter().enumerate() {
                if ui.button(format!("{i} {name}")).clicked() {
                    app.go_to_camera(i);
                }
            }
        });
}

/// The level's places that are remembered.
fn bookmarks(app: &mut App, ui: &mut Ui) {
    let Some(level) = app.stage.as_ref().map(|s| s.loaded.level.name.clone()) else {
        return;
    };
    let pose = app.eye.pose();
    let (mut goes, mut forgets) = (None, None);
    let places = app.preferences.places.entry(level.clone()).or_default();
    if ui.button("Remember this place").clicked() && !places.contains(&pose) {
        places.push(pose);
    }
    for (i, place) in places.iter().enumerate() {
        ui.horizontal(|ui| {
            let [x, y, z, ..] = place;
            if ui.button(format!("{x:.0} {y:.0} {z:.0}")).clicked() {
                goes = Eye::from_pose(*place);
            }
            if ui.small_button("x").on_hover_text("forget it").clicked() {
                forgets = Some(i);
            }
        });
    }
    if let Some(i) = forgets {
        places.remove(i);
    }
    if places.is_empty() {
        app.preferences.places.remove(&level);
    }
    if let Some(eye) = goes {
        app.go_to(eye);
    }
}

fn go_by_name(app: &mut App, name: &str) {
    let found =
        (app.stage.as_ref()).and_then(|s| s.scene.cameras.iter().position(|c| c.name == *name));
    match found {
        Some(index) => app.go_to_camera(index),
        None => app
            .notices
            .error(format!("the level has no camera named {name}")),
    }
}
