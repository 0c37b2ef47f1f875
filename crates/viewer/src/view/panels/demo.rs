//! The demo's time.

use super::App;
use egui::{Context, DragValue, Sense, Stroke, Ui, pos2, vec2};

/// Speeds that a demo is played at: slower, and backwards.
const SPEEDS: std::ops::RangeInclusive<f64> = -8.0..=8.0;
/// Seconds of a step.
const STEP: f64 = 1.0 / 60.0;

pub(super) fn show(app: &mut App, ctx: &Context) {
    if app.player.is_none() {
        return;
    }
    let frame = egui::Frame::side_top_panel(&ctx.style()).multiply_with_opacity(0.9);
    egui::TopBottomPanel::bottom("demo")
        .frame(frame)
        .show(ctx, |ui| {
            controls(app, ui);
            line(app, ui);
        });
}

fn controls(app: &mut App, ui: &mut Ui) {
    let Some(player) = &mut app.player else {
        return;
    };
    ui.horizontal(|ui| {
        let text = if player.plays { "Stop" } else { "Play" };
        if ui.button(text).clicked() {
            player.plays = !player.plays;
        }
        for (text, step, hint) in [
            ("<", -STEP, "a sixtieth of a second back"),
            (">", STEP, "a sixtieth of a second forward"),
        ] {
            if ui.button(text).on_hover_text(hint).clicked() {
                player.plays = false;
                player.seek(player.time + step);
            }
        }
        ui.add(
            DragValue::new(&mut player.speed)
                .range(SPEEDS)
                .speed(0.05)
                .prefix("x "),
        )
        .on_hover_text("speed; less than 0 plays backwards");
        ui.checkbox(&mut player.follows, "player's eye")
            .on_hover_text("or fly yourself, and see what the player did not");
        let state = player.timeline.level_at(player.time);
        let map = state.and_then(|level| player.timeline.levels().get(level));
        let map = map.map_or("", |level| &level.map);
        let (time, all) = (player.time, player.timeline.duration());
        ui.monospace(format!("{time:8.3} / {all:.3} s"));
        ui.label(map);
    });
}

/// The whole demo as a line, with a mark where a level begins.
fn line(app: &mut App, ui: &mut Ui) {
    let Some(player) = &mut app.player else {
        return;
    };
    let size = vec2(ui.available_width(), 18.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let all = player.timeline.duration().max(1e-3);
    if let Some(at) = response.interact_pointer_pos() {
        let share = f64::from((at.x - rect.left()) / rect.width());
        player.seek(share * all);
    }
    let (painter, visuals) = (ui.painter_at(rect), ui.visuals());
    painter.rect_filled(rect, 3.0, visuals.extreme_bg_color);
    let x = |t: f64| rect.left() + (t / all) as f32 * rect.width();
    for level in player.timeline.levels() {
        let (begin, end) = level.span;
        if begin < end {
            let mark = [pos2(x(begin), rect.top()), pos2(x(begin), rect.bottom())];
            painter.line_segment(mark, Stroke::new(1.0, visuals.weak_text_color()));
        }
    }
    let now = [
        pos2(x(player.time), rect.top()),
        pos2(x(player.time), rect.bottom()),
    ];
    painter.line_segment(now, Stroke::new(3.0, visuals.selection.bg_fill));
}
