//! The demo's time.

use super::App;
use egui::{Color32, Context, DragValue, PointerButton, Rect, Sense, Stroke, Ui, pos2, vec2};
use scene::timeline::{Event, EventKind, Timeline};

/// Speeds that a demo is played at: slower, and backwards.
const SPEEDS: std::ops::RangeInclusive<f64> = -8.0..=8.0;
/// Seconds of a step.
const STEP: f64 = 1.0 / 60.0;

pub(super) fn show(app: &mut App, ctx: &Context) {
    if app.player.is_none() {
        return;
    }
    let frame = super::glass(ctx, egui::Frame::side_top_panel(&ctx.style()), 0.9);
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
    ui.horizontal_wrapped(|ui| {
        let text = if player.plays { "Stop" } else { "Play" };
        if ui.button(text).clicked() {
            player.play_or_stop();
        }
        if (ui.button("Reverse").on_hover_text("plays the other way")).clicked() {
            player.speed = -player.speed;
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
        for (text, next, hint) in [
            (
                "|<",
                false,
                "what happened before: a level, death, damage, an item",
            ),
            (
                ">|",
                true,
                "what happens next: a level, death, damage, an item",
            ),
        ] {
            if ui.button(text).on_hover_text(hint).clicked() {
                player.go_to_event(next);
            }
        }
        for (text, begins, hint) in [
            ("[", true, "the marked part begins here"),
            ("]", false, "the marked part ends here"),
        ] {
            if ui.button(text).on_hover_text(hint).clicked() {
                player.mark_here(begins);
            }
        }
        ui.toggle_value(&mut app.panels.export, "Film")
            .on_hover_text("the marked part, or all, as files");
        ui.checkbox(&mut player.follows, "player's eye")
            .on_hover_text("or fly yourself, and see what the player did not");
        ui.add_enabled(
            !player.follows,
            egui::Checkbox::new(&mut player.along, "go along"),
        )
        .on_hover_text("the eye goes where the player goes, from where you have put it");
        let state = player.timeline.level_at(player.time);
        let map = state.and_then(|level| player.timeline.levels().get(level));
        let map = map.map_or("", |level| &level.map);
        let (time, all) = (player.time, player.timeline.duration());
        ui.monospace(format!("{time:8.3} / {all:.3} s"));
        ui.label(map);
    });
}

/// The whole demo as a line, with marks where something happens. Dragging seeks; with the other button it
/// marks a part.
fn line(app: &mut App, ui: &mut Ui) {
    let Some(player) = &mut app.player else {
        return;
    };
    let size = vec2(ui.available_width(), 22.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let all = player.timeline.duration().max(1e-3);
    let time = |x: f32| f64::from((x - rect.left()) / rect.width()) * all;
    if let Some(at) = response.interact_pointer_pos() {
        let other = PointerButton::Secondary;
        if response.dragged_by(other) {
            let origin = ui.input(|i| i.pointer.press_origin());
            let from = origin.map_or(at.x, |o| o.x);
            player.mark(time(from), time(at.x));
        } else if response.is_pointer_button_down_on() && !response.secondary_clicked() {
            player.seek(time(at.x));
        }
    }
    let painter = ui.painter_at(rect);
    // Dark in light panels, too: marks have colours that are seen on it.
    painter.rect_filled(rect, 3.0, Color32::from_gray(10));
    let x = |t: f64| rect.left() + (t / all) as f32 * rect.width();
    if let Some([from, to]) = player.marked {
        let part = Rect::from_x_y_ranges(x(from)..=x(to), rect.y_range());
        let color = Color32::from_rgb(0, 92, 128).gamma_multiply(0.45);
        painter.rect_filled(part, 0.0, color);
    }
    for event in player.events.iter() {
        let (color, share, _) = look(event.kind);
        let top = rect.bottom() - share * rect.height();
        let mark = [pos2(x(event.time), top), pos2(x(event.time), rect.bottom())];
        painter.line_segment(mark, Stroke::new(1.0, color));
    }
    let now = [
        pos2(x(player.time), rect.top()),
        pos2(x(player.time), rect.bottom()),
    ];
    painter.line_segment(now, Stroke::new(3.0, Color32::WHITE));
    if let Some(at) = response.hover_pos() {
        let near = f64::from(4.0 / rect.width()) * all;
        let text = told(&player.timeline, &player.events, time(at.x), near);
        response.on_hover_text_at_pointer(text);
    }
}

/// How an event is marked: colour, share of the line's height, name.
fn look(kind: EventKind) -> (Color32, f32, &'static str) {
    match kind {
        EventKind::Level(_) => (Color32::from_gray(220), 1.0, "level"),
        EventKind::Intermission => (Color32::from_rgb(90, 150, 230), 1.0, "the level is over"),
        EventKind::Death => (Color32::from_rgb(230, 60, 60), 1.0, "death"),
        EventKind::Hurt => (Color32::from_rgb(230, 140, 60), 0.4, "damage"),
        EventKind::Pickup => (Color32::from_rgb(210, 200, 90), 0.25, "an item"),
    }
}

/// A time, and what happens near it.
fn told(timeline: &Timeline, events: &[Event], time: f64, near: f64) -> String {
    let mut text = format!("{time:.2} s");
    let mut close: Vec<&Event> = (events.iter())
        .filter(|e| (e.time - time).abs() <= near)
        .collect();
    close.sort_by_key(|e| e.kind);
    close.dedup_by_key(|e| e.kind);
    for event in close {
        let name = match event.kind {
            EventKind::Level(index) => {
                let level = timeline.levels().get(index);
                level.map_or(String::new(), |l| format!("{} begins", l.map))
            }
            kind => look(kind).2.to_owned(),
        };
        text += &format!("\n{name} at {:.2} s", event.time);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happens_near_a_time_is_told_once() {
        let event = |time, kind| Event { time, kind };
        let events = [
            event(1.0, EventKind::Hurt),
            event(1.1, EventKind::Hurt),
            event(1.1, EventKind::Death),
            event(3.0, EventKind::Pickup),
        ];
        let text = told(&Timeline::default(), &events, 1.05, 0.2);
        assert_eq!(text, "1.05 s\ndeath at 1.10 s\ndamage at 1.00 s");
        assert_eq!(told(&Timeline::default(), &events, 2.0, 0.2), "2.00 s");
    }
}
