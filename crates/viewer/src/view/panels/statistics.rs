//! What the picture costs.

use super::App;
use crate::view::convergence::Point;
use crate::view::statistics::{Pass, Taken};
use egui::{Color32, Grid, Sense, Stroke, Ui, vec2};

/// The graph's height stands for so many milliseconds at least.
const GRAPH_MS: f32 = 34.0;
/// Longer lines are wrapped, in points.
const WIDE: f32 = 340.0;

pub(super) fn show(app: &App, ui: &mut Ui) {
    let statistics = &app.statistics;
    let [mean, longest] = statistics.frame_ms();
    graph(app, ui, longest.max(GRAPH_MS));
    curve(app, ui);
    let grid = Grid::new("statistics").num_columns(2);
    grid.max_col_width(WIDE).show(ui, |ui| {
        let mut line = |name: &str, hint: &str, text: String| {
            ui.label(name).on_hover_text(hint);
            ui.add(egui::Label::new(text).wrap());
            ui.end_row();
        };
        let per_second = 1000.0 / mean.max(1e-3);
        line(
            "Frame",
            "mean and longest of the last frames",
            format!("{mean:.1} ms, at most {longest:.1} ms ({per_second:.0} a second)"),
        );
        if let Some(stage) = &app.stage {
            let sample = stage.tracer.sample_ms();
            line(
                "A sample",
                "of all pixels, on the device",
                format!("{sample:.2} ms"),
            );
        }
        let [paths, rays] = statistics.speed();
        let millions = |n: Option<f64>| n.map_or("-".into(), |n| format!("{n:.2} million/s"));
        line("Paths", "of this picture", millions(paths));
        line("Rays", "of this picture", millions(rays));
        if let Some(settings) = app.settings() {
            line(
                "Picture",
                "in pixels",
                format!("{} x {}", settings.width, settings.height),
            );
            let progress = app.pace.progress(settings.height);
            let seconds = statistics.seconds();
            line(
                "Samples",
                "per pixel so far",
                format!("{progress:.2} in {seconds:.1} s"),
            );
        }
        if let Some(point) = app.convergence.points().last() {
            let hint =
                "estimated relMSE of the picture, and by which power of the samples it falls";
            let slope = app.convergence.slope();
            let slope = slope.map_or(String::new(), |s| format!(", falls by the power {s:.2}"));
            let text = format!("{:.2e} at {} samples{slope}", point.error, point.samples);
            line("Error", hint, text);
        }
        if let Some(why) = app.stopped() {
            line(
                "Stopped",
                "why there are no more samples",
                why.name().into(),
            );
        }
        let memory = app.gpu.allocated_bytes() as f64 / f64::from(1 << 20);
        let program = resident_bytes().map_or(String::new(), |bytes| {
            format!(", {} MiB of the program", bytes >> 20)
        });
        line(
            "Memory",
            "that buffers and images have on the device, and all of the program's beside it",
            format!("{memory:.0} MiB{program}"),
        );
        let info = app.gpu.info();
        line("Device", "that traces", info.name.clone());
        line("Driver", "and its version", info.driver.clone());
        if let Some(stage) = &app.stage {
            let (scene, report) = (&stage.scene, &stage.scene.report);
            line(
                "Triangles",
                "over all instances",
                scene.triangle_count().to_string(),
            );
            let lights = format!(
                "{} surfaces, {} lamps",
                scene.emitters.list.len(),
                scene.lights.len()
            );
            line("Lights", "that can be chosen", lights);
            line(
                "Emitting texels",
                "above the threshold",
                report.emissive_texels.to_string(),
            );
            let [read, import, upload] = stage.seconds;
            let text = format!("{read:.2} + {import:.2} + {upload:.2} s");
            line("Loaded in", "reading, importing, uploading", text);
            let names: Vec<&str> = scene.features.described().iter().map(|(n, _)| *n).collect();
            line("Features", "that the shaders have", names.join(", "));
        }
    });
    if let Some(stage) = &app.stage {
        let warnings = &stage.scene.report.warnings;
        if !warnings.is_empty() {
            let title = format!("{} oddities of the level", warnings.len());
            ui.collapsing(title, |ui| {
                egui::ScrollArea::vertical()
                    .max_height(120.0)
                    .show(ui, |ui| {
                        warnings.iter().for_each(|w| _ = ui.label(w));
                    });
            });
        }
    }
}

/// The estimated error over the samples or, after a click, over the seconds, by powers of ten, with the target.
fn curve(app: &App, ui: &mut Ui) {
    let points = app.convergence.points();
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return;
    };
    if points.len() < 2 {
        return;
    }
    let (rect, response) = ui.allocate_exact_size(vec2(300.0, 96.0), Sense::click());
    let of_time = ui.id().with("error over time");
    let mut by_time = ui.data(|d| d.get_temp(of_time).unwrap_or(false));
    if response.clicked() {
        by_time = !by_time;
        ui.data_mut(|d| d.insert_temp(of_time, by_time));
    }
    let across = |p: &Point| {
        let x = if by_time {
            p.seconds
        } else {
            f64::from(p.samples)
        };
        x.max(SOONEST).log10()
    };
    let (painter, visuals) = (ui.painter_at(rect), ui.visuals());
    painter.rect_filled(rect, 2.0, visuals.extreme_bg_color);
    let log_of = |error: f64| error.max(1e-12).log10();
    let target = app.args.picture.target_error.map(log_of);
    let errors = || points.iter().map(|p| log_of(p.error)).chain(target);
    let low = errors().fold(f64::INFINITY, f64::min).floor();
    let high = errors()
        .fold(f64::NEG_INFINITY, f64::max)
        .ceil()
        .max(low + 1.0);
    let [from, to] = [first, last].map(across);
    let to = to.max(from + 1e-3);
    let x = |log: f64| rect.left() + ((log - from) / (to - from)) as f32 * rect.width();
    let y = |log: f64| rect.bottom() - ((log - low) / (high - low)) as f32 * rect.height();
    let faint = Stroke::new(1.0, visuals.weak_text_color().gamma_multiply(0.4));
    for decade in low as i32..=high as i32 {
        painter.hline(rect.x_range(), y(decade.into()), faint);
    }
    for decade in from.ceil() as i32..=to.floor() as i32 {
        painter.vline(x(decade.into()), rect.y_range(), faint);
    }
    if let Some(target) = target {
        let stroke = Stroke::new(1.0, visuals.warn_fg_color);
        painter.hline(rect.x_range(), y(target), stroke);
    }
    let line: Vec<_> = (points.iter())
        .map(|p| egui::pos2(x(across(p)), y(log_of(p.error))))
        .collect();
    painter.line(line, Stroke::new(2.0, Color32::from_rgb(110, 190, 110)));
    let font = egui::FontId::proportional(11.0);
    let color = visuals.text_color();
    for (at, align, text) in [
        (
            rect.left_top(),
            egui::Align2::LEFT_TOP,
            // No minus before a zero.
            format!("relMSE 1e{}", high + 0.0),
        ),
        (
            rect.left_bottom(),
            egui::Align2::LEFT_BOTTOM,
            format!("1e{}", low + 0.0),
        ),
        (
            rect.right_bottom(),
            egui::Align2::RIGHT_BOTTOM,
            if by_time {
                format!("{:.1} s", last.seconds)
            } else {
                format!("{} samples", last.samples)
            },
        ),
    ] {
        painter.text(at, align, text, font.clone(), color);
    }
    if let Some(at) = response.hover_pos() {
        let share = f64::from((at.x - rect.left()) / rect.width());
        let there = from + share * (to - from);
        let near = |p: &&Point| (across(p) - there).abs();
        if let Some(point) = points.iter().min_by(|a, b| near(a).total_cmp(&near(b))) {
            response.on_hover_text_at_pointer(format!(
                "{:.3e} at {} samples, {:.1} s; a click shows it over {}",
                point.error,
                point.samples,
                point.seconds,
                if by_time { "the samples" } else { "time" }
            ));
        }
    }
}

/// Seconds before which the curve over time does not begin.
const SOONEST: f64 = 1e-3;

/// Bytes of the program that lie in memory, where the system says so in a file.
fn resident_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib << 10)
}

/// The last frames as bars: what the device did, by passes, then the processor's panels, and the rest of the time from one
/// frame to the next.
fn graph(app: &App, ui: &mut Ui, most_ms: f32) {
    let (rect, response) = ui.allocate_exact_size(vec2(300.0, 48.0), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_gray(40));
    let (frames, passes) = (app.statistics.frames(), app.statistics.passes());
    let step = rect.width() / 120.0;
    let mut pointed = None;
    for (i, frame) in frames.iter().rev().enumerate() {
        let x = rect.right() - (i as f32 + 0.5) * step;
        if (response.hover_pos()).is_some_and(|at| (at.x - x).abs() <= step / 2.0) {
            pointed = Some(frame);
        }
        // Device and processor work at the same time: together they may be longer than the frame.
        let all = frame.seconds * 1000.0;
        let device = (passes.iter()).map(|pass| (color(pass.number), ms_of(frame, pass)));
        let rest = [(PANELS.0, frame.panels_ms), (REST.0, f32::INFINITY)];
        let (mut bottom, mut below) = (rect.bottom(), 0.0);
        for (color, ms) in device.chain(rest) {
            below = (below + ms).min(all);
            let top = rect.bottom() - (below / most_ms).min(1.0) * rect.height();
            if top < bottom {
                let line = [egui::pos2(x, bottom), egui::pos2(x, top)];
                painter.line_segment(line, Stroke::new(step * 0.8, color));
                bottom = top;
            }
        }
    }
    let text = format!("{most_ms:.0} ms");
    let font = egui::FontId::proportional(11.0);
    let text = painter.layout_no_wrap(text, font, Color32::WHITE);
    let at = rect.left_top() + vec2(3.0, 1.0);
    let behind = egui::Rect::from_min_size(at, text.size()).expand(2.0);
    painter.rect_filled(behind, 2.0, Color32::from_black_alpha(180));
    painter.galley(at, text, Color32::WHITE);
    if let Some(frame) = pointed {
        let device = (passes.iter()).map(|pass| (pass.name, ms_of(frame, pass)));
        let lines = device.chain([
            (PANELS.1, frame.panels_ms),
            ("frame", frame.seconds * 1000.0),
        ]);
        let lines: Vec<_> = lines.map(|(n, ms)| format!("{n} {ms:.2} ms")).collect();
        response.on_hover_text_at_pointer(lines.join("\n"));
    }
    legend(app, ui, &passes);
}

/// Which colour is what, and how long that took.
fn legend(app: &App, ui: &mut Ui, passes: &[Pass]) {
    const DEVICE: &str = "on the device, mean of the last frames";
    let ms = |ms: f64| format!("{ms:.2} ms");
    let device = passes.iter().map(|pass| {
        let part = (color(pass.number), pass.name);
        (part, DEVICE, ms(pass.mean_ms.into()))
    });
    let host = [
        (
            PANELS,
            "the processor's, in a frame",
            ms(app.statistics.panels_ms()),
        ),
        (REST, "until the next frame", String::new()),
    ];
    let parts: Vec<_> = device.chain(host).collect();
    Grid::new("parts of frames").num_columns(4).show(ui, |ui| {
        for row in parts.chunks(2) {
            for ((color, name), hint, time) in row {
                ui.horizontal(|ui| {
                    // Words in these colours could not be read on light panels.
                    let (rect, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
                    ui.painter().rect_filled(rect, 2.0, *color);
                    ui.label(*name).on_hover_text(*hint);
                });
                ui.label(time);
            }
            ui.end_row();
        }
    });
}

fn ms_of(frame: &Taken, pass: &Pass) -> f32 {
    frame.passes.get(pass.number).copied().unwrap_or(0.0)
}

/// The parts of a frame that are no passes: colour and name.
const PANELS: (Color32, &str) = (Color32::from_rgb(230, 190, 80), "panels");
const REST: (Color32, &str) = (Color32::from_rgb(140, 140, 140), "rest");

/// The colour of a pass: neighbours are told apart by hue on the dark graph, and beside words on light panels.
fn color(number: usize) -> Color32 {
    const COLORS: [[u8; 3]; 9] = [
        [110, 190, 110],
        [90, 150, 230],
        [80, 205, 215],
        [225, 105, 80],
        [175, 120, 225],
        [235, 140, 190],
        [185, 200, 70],
        [50, 150, 130],
        [180, 130, 90],
    ];
    let [r, g, b] = COLORS[number % COLORS.len()];
    Color32::from_rgb(r, g, b)
}
