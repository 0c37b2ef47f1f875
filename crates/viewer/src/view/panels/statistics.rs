//! What the picture costs.

use super::App;
use egui::{Color32, Grid, Sense, Stroke, Ui, vec2};

/// The graph's height stands for so many milliseconds at least.
const GRAPH_MS: f32 = 34.0;

pub(super) fn show(app: &App, ui: &mut Ui) {
    let statistics = &app.statistics;
    let [mean, longest] = statistics.frame_ms();
    graph(app, ui, longest.max(GRAPH_MS));
    Grid::new("statistics").num_columns(2).show(ui, |ui| {
        let mut line = |name: &str, hint: &str, text: String| {
            ui.label(name).on_hover_text(hint);
            ui.label(text);
            ui.end_row();
        };
        let per_second = 1000.0 / mean.max(1e-3);
        line(
            "Frame",
            "mean and longest of the last frames",
            format!("{mean:.1} ms, at most {longest:.1} ms ({per_second:.0} a second)"),
        );
        let panels = statistics.panels_ms();
        line(
            "panels",
            "the processor's, in a frame",
            format!("{panels:.2} ms"),
        );
        for timing in statistics.display() {
            let text = format!("{:.2} ms", timing.milliseconds);
            line(timing.name, "on the device, in a frame", text);
        }
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
        let memory = app.gpu.allocated_bytes() as f64 / f64::from(1 << 20);
        line("Memory", "of the device", format!("{memory:.0} MiB"));
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

/// The last frames as bars: what the device traced, below what it took to show that, then the processor's
/// panels, and the rest of the time from one frame to the next.
fn graph(app: &App, ui: &mut Ui, most_ms: f32) {
    let (rect, _) = ui.allocate_exact_size(vec2(300.0, 48.0), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_black_alpha(120));
    let frames = app.statistics.frames();
    let step = rect.width() / 120.0;
    for (i, frame) in frames.iter().rev().enumerate() {
        let x = rect.right() - (i as f32 + 0.5) * step;
        let all = frame.seconds * 1000.0;
        // Device and processor work at the same time: together they may be longer than the frame.
        let traced = frame.trace_ms;
        let shown = traced + frame.display_ms;
        let parts = [traced, shown, shown + frame.panels_ms, f32::INFINITY];
        let mut bottom = rect.bottom();
        for (below, (color, _)) in parts.into_iter().zip(PARTS) {
            let below = below.min(all);
            let top = rect.bottom() - (below / most_ms).min(1.0) * rect.height();
            if top < bottom {
                let line = [egui::pos2(x, bottom), egui::pos2(x, top)];
                painter.line_segment(line, Stroke::new(step * 0.8, color));
                bottom = top;
            }
        }
    }
    ui.horizontal(|ui| {
        for (color, name) in PARTS {
            ui.colored_label(color, name);
        }
    });
}

/// Parts of a frame: colour and name.
const PARTS: [(Color32, &str); 4] = [
    (Color32::from_rgb(110, 190, 110), "tracing"),
    (Color32::from_rgb(90, 150, 230), "showing"),
    (Color32::from_rgb(230, 190, 80), "panels"),
    (Color32::from_rgb(140, 140, 140), "rest"),
];
