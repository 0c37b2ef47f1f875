//! A film of a demo.

use super::App;
use crate::progress::clock;
use crate::view::look::demo_command_line;
use egui::{DragValue, Grid, ProgressBar, RichText, TextEdit, Ui};

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_max_width(420.0);
    marked(app, ui);
    ui.separator();
    let is_idle = app.export.under_way().is_none();
    ui.add_enabled_ui(is_idle, |ui| settings(app, ui));
    ui.separator();
    match app.film_options() {
        Ok(demo) => {
            let frames = app.film_frames(&demo);
            let made = app.export.command().map(str::to_owned);
            let line = made.unwrap_or_else(|| demo_command_line(&demo, &app.global));
            ui.add(egui::Label::new(RichText::new(&line).monospace()).wrap());
            ui.horizontal(|ui| {
                if ui
                    .button("Copy")
                    .on_hover_text("the command that makes the same film")
                    .clicked()
                {
                    ui.ctx().copy_text(line);
                }
                if is_idle {
                    let start = ui.add_enabled(frames > 0, egui::Button::new("Make the film"));
                    if start
                        .on_hover_text("beside the window, which can be used meanwhile")
                        .clicked()
                    {
                        app.export_film();
                    }
                }
                ui.label(format!("{frames} frames"));
            });
        }
        Err(error) => _ = ui.colored_label(ui.visuals().error_fg_color, format!("{error:#}")),
    }
    if let Some(audience) = app.export.under_way() {
        let (share, taken, left) = audience.progress();
        let left = left.map_or_else(
            || "preparing".into(),
            |left| format!("{} left", clock(left)),
        );
        let text = format!("{:.1} %, {}, {left}", 100.0 * share, clock(taken));
        ui.add(ProgressBar::new(share as f32).text(text));
        let ends = audience.asks_to_end();
        let cancel = ui.add_enabled(!ends, egui::Button::new("Cancel"));
        if cancel
            .on_hover_text(
                "frames that are complete stay; 'only missing frames' makes the rest later",
            )
            .clicked()
        {
            app.export.cancel();
        }
        ui.ctx()
            .request_repaint_after(std::time::Duration::from_millis(250));
    }
    match &app.export.told {
        Some(Ok(text)) => _ = ui.label(text),
        Some(Err(text)) => _ = ui.colored_label(ui.visuals().error_fg_color, text),
        None => {}
    }
}

/// Which part of the demo.
fn marked(app: &mut App, ui: &mut Ui) {
    let Some(player) = &mut app.player else {
        ui.label("open a demo first");
        return;
    };
    let all = player.timeline.duration();
    let [mut from, mut to] = player.marked.unwrap_or([0.0, all]);
    ui.horizontal(|ui| {
        ui.label("from");
        let seconds = |value| {
            DragValue::new(value)
                .range(0.0..=all)
                .speed(0.05)
                .suffix(" s")
        };
        let mut changed = ui
            .add(seconds(&mut from))
            .on_hover_text("where the film begins, seconds of the demo")
            .changed();
        ui.label("to");
        changed |= ui
            .add(seconds(&mut to))
            .on_hover_text("where it ends")
            .changed();
        if changed {
            player.mark(from, to);
        }
        let whole = ui.add_enabled(player.marked.is_some(), egui::Button::new("all"));
        if whole.on_hover_text("the whole demo").clicked() {
            player.marked = None;
        }
        let eye = if player.follows {
            "the player's eye"
        } else if app.flight_path.flies {
            "along the path"
        } else {
            "from where you are"
        };
        ui.label(eye)
            .on_hover_text("as the window shows it now: 'player's eye' in the bar below");
    });
}

fn settings(app: &mut App, ui: &mut Ui) {
    let window = app.settings().map(|s| [s.width, s.height]);
    let samples = app.samples();
    let export = &mut app.export;
    Grid::new("export").num_columns(2).show(ui, |ui| {
        ui.label("Files").on_hover_text(
            ".png or .exr with %05d where the frame's number goes, or one .y4m of raw video",
        );
        ui.add(TextEdit::singleline(&mut export.output).desired_width(260.0));
        ui.end_row();
        ui.label("Size").on_hover_text("in pixels");
        ui.horizontal(|ui| {
            let [width, height] = &mut export.size;
            ui.add(DragValue::new(width).range(1..=16384));
            ui.label("x");
            ui.add(DragValue::new(height).range(1..=16384));
            if let Some(size) = window
                && ui
                    .button("window")
                    .on_hover_text("the size of the picture here")
                    .clicked()
            {
                export.size = size;
            }
        });
        ui.end_row();
        ui.label("Samples").on_hover_text("per pixel and frame");
        ui.horizontal(|ui| {
            ui.add(DragValue::new(&mut export.spp).range(1..=1 << 20));
            if samples > 0
                && ui
                    .button("as here")
                    .on_hover_text("as many as the picture has now")
                    .clicked()
            {
                export.spp = samples;
            }
        });
        ui.end_row();
        ui.label("Frames per second")
            .on_hover_text("a number, or a fraction such as 30000/1001");
        ui.add(TextEdit::singleline(&mut export.fps).desired_width(80.0));
        ui.end_row();
        ui.label("Shutter").on_hover_text(
            "share of a frame's time that it is open: what moves is blurred; 0.5 is 180 degrees",
        );
        ui.add(egui::Slider::new(&mut export.shutter, 0.0..=1.0));
        ui.end_row();
    });
    ui.checkbox(&mut export.resume, "only missing frames")
        .on_hover_text("files there that were made with the same settings stay");
    ui.checkbox(&mut export.no_tint, "without the game's colours")
        .on_hover_text("for damage, items and liquids, and without the wobble under water");
    ui.checkbox(&mut export.all_layers, "all layers")
        .on_hover_text("in EXRs: albedo, normals, depth and so on");
    if ui
        .button("Usual settings")
        .on_hover_text("takes all of these back")
        .clicked()
    {
        let usual = crate::view::export::Export::default();
        (export.output, export.size, export.spp) = (usual.output.clone(), usual.size, usual.spp);
        (export.fps, export.shutter) = (usual.fps.clone(), usual.shutter);
        (export.resume, export.no_tint, export.all_layers) = (false, false, false);
    }
}
