//! A flight that is recorded.

use super::App;
use crate::view::fly::Eye;
use egui::{DragValue, Grid, ScrollArea, Slider, TextEdit, Ui};

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_max_width(360.0);
    ui.horizontal(|ui| {
        let hint = if app.player.is_some() {
            "where the eye is now, at the demo's time"
        } else {
            "where the eye is now, 2 seconds after the last key"
        };
        if ui.button("Add a key").on_hover_text(hint).clicked() {
            app.add_key();
        }
        let flight = &app.flight_path;
        let (can, flies) = (flight.path().is_some(), flight.flies);
        let text = if flies { "Stop" } else { "Fly" };
        let fly = ui.add_enabled(can, egui::Button::new(text));
        if fly
            .on_hover_text("along the keys; with a demo, by its time. Whoever moves takes over")
            .clicked()
        {
            app.fly_path(!flies);
        }
        let clear = ui.add_enabled(can, egui::Button::new("Clear"));
        if clear.on_hover_text("removes all keys").clicked() {
            app.flight_path.clear();
        }
    });
    times(app, ui);
    keys(app, ui);
    ui.separator();
    file(app, ui);
}

/// Where in the path one is.
fn times(app: &mut App, ui: &mut Ui) {
    let Some([from, to]) = app.flight_path.path().map(|p| p.times()) else {
        ui.label("no key yet: fly somewhere and add one");
        return;
    };
    if app.player.is_some() || from >= to {
        return;
    }
    let mut time = app.flight_path.time;
    let slider = Slider::new(&mut time, from..=to).suffix(" s");
    if ui
        .add(slider)
        .on_hover_text("seconds of the path: shows the place there")
        .changed()
    {
        app.flight_path.time = time;
        if let Some(path) = app.flight_path.path() {
            let eye = Eye::of(&path.at(time));
            app.go_to(eye);
        }
    }
}

/// What is done with a key.
enum Edit {
    Go,
    Retime(f64),
    Here,
    Remove,
}

fn keys(app: &mut App, ui: &mut Ui) {
    let mut edit = None;
    ScrollArea::vertical().max_height(160.0).show(ui, |ui| {
        Grid::new("keys of a path").num_columns(4).show(ui, |ui| {
            for (i, key) in app.flight_path.keys().iter().enumerate() {
                let mut time = key.time;
                let drag = DragValue::new(&mut time).speed(0.05).suffix(" s");
                if ui
                    .add(drag.max_decimals(3))
                    .on_hover_text("when: the key takes its place in the order")
                    .changed()
                {
                    edit = Some((i, Edit::Retime(time)));
                }
                let [x, y, z] = key.position.to_array();
                if ui
                    .button(format!("{x:.0} {y:.0} {z:.0}"))
                    .on_hover_text("go there")
                    .clicked()
                {
                    edit = Some((i, Edit::Go));
                }
                if ui
                    .small_button("here")
                    .on_hover_text("the key is where the eye is now")
                    .clicked()
                {
                    edit = Some((i, Edit::Here));
                }
                if ui.small_button("x").on_hover_text("remove it").clicked() {
                    edit = Some((i, Edit::Remove));
                }
                ui.end_row();
            }
        });
    });
    let Some((i, edit)) = edit else { return };
    let key = app.flight_path.keys()[i].clone();
    let eye = Eye {
        position: key.position,
        pitch: key.angles_deg[0],
        yaw: key.angles_deg[1],
        roll: key.angles_deg[2],
    };
    match edit {
        Edit::Go => {
            app.fly_path(false);
            app.flight_path.time = key.time;
            if let Some(player) = &mut app.player {
                player.follows = false;
                player.seek(key.time);
            }
            app.args.picture.view.fov = Some(key.fov_deg.into());
            app.go_to(eye);
        }
        Edit::Retime(time) => {
            if let Err(error) = app.flight_path.retime(i, time) {
                app.notices.error(format!("{error:#}"));
            }
        }
        Edit::Here => app.put_key(key.time),
        Edit::Remove => app.flight_path.remove(i),
    }
}

fn file(app: &mut App, ui: &mut Ui) {
    let shown = app.path_file();
    ui.horizontal(|ui| {
        let hint = shown.display().to_string();
        let field = TextEdit::singleline(&mut app.flight_path.file);
        ui.add(field.hint_text(hint).desired_width(180.0))
            .on_hover_text(
                "the file that --camera-path reads; without a folder, in that of pictures",
            );
        if ui.button("Save").on_hover_text("writes the file").clicked() {
            let told = match app.flight_path.save(&shown) {
                Ok(()) => Ok(format!("saved {}", shown.display())),
                Err(error) => Err(error),
            };
            say(app, told);
        }
        if ui.button("Load").on_hover_text("reads the file").clicked() {
            let told = app.flight_path.load(&shown);
            let told = told.map(|()| format!("{} keys", app.flight_path.keys().len()));
            say(app, told);
        }
    });
}

fn say(app: &mut App, told: anyhow::Result<String>) {
    match told {
        Ok(text) => app.notices.say(text),
        Err(error) => app.notices.error(format!("{error:#}")),
    }
}
