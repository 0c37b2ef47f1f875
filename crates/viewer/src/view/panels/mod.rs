//! What lies over the picture.

mod demo;
mod entities;
mod export;
mod files;
mod inspector;
mod looking;
mod open;
mod path;
mod places;
mod render;
mod statistics;
mod styles;
mod window;

use super::app::App;
use super::draw::PICTURE_ID;
use super::inspect::Report;
use super::keys::{ACTIONS, Action};
use crate::job::Stopped;
use egui::{Align2, Color32, Context, LayerId, Pos2, Rect, RichText, Ui, vec2};

/// Which panels are open, and what is set in them that is no part of the picture.
#[derive(Clone, Debug)]
pub struct Panels {
    /// None is shown at all.
    pub hidden: bool,
    /// How the picture is made.
    pub render: bool,
    /// What is shown instead of it.
    pub looking: bool,
    /// What is at a pixel.
    pub inspector: bool,
    /// The entities of the level.
    pub entities: bool,
    /// Its light styles.
    pub styles: bool,
    /// What it costs.
    pub statistics: bool,
    /// Where to go.
    pub places: bool,
    /// What to open.
    pub open: bool,
    /// What keys do.
    pub keys: bool,
    /// A film of the demo.
    pub export: bool,
    /// A flight that is recorded.
    pub path: bool,
    /// How the window is shown.
    pub window: bool,
    /// The folder whose files can be opened; `None` before it was listed.
    folder: Option<files::Folder>,
    /// Size of the picture in percent of the window's.
    pub percent: u32,
    /// Milliseconds of tracing in a frame, at most.
    pub budget_ms: f64,
    /// Levels of the search path; `None` before they were listed.
    pub browser: Option<Vec<String>>,
    /// What their names hold.
    filter: String,
    /// What is typed as a place.
    viewpos: String,
    /// What is looked for among the entities.
    pub entity: String,
}

/// Milliseconds of tracing in a frame: with the display at 60 frames a second something is left.
pub const BUDGET_MS: f64 = 14.0;

impl Default for Panels {
    fn default() -> Self {
        Self {
            hidden: false,
            render: true,
            looking: false,
            inspector: false,
            entities: false,
            styles: false,
            statistics: false,
            places: false,
            open: false,
            keys: false,
            export: false,
            path: false,
            window: false,
            folder: None,
            percent: 100,
            budget_ms: BUDGET_MS,
            browser: None,
            filter: String::new(),
            viewpos: String::new(),
            entity: String::new(),
        }
    }
}

impl Panels {
    /// None but the bar.
    #[must_use]
    pub fn none() -> Self {
        Self {
            render: false,
            ..Self::default()
        }
    }
}

/// A panel in a window of its own.
struct Panel {
    title: &'static str,
    /// Corner or side of the screen, and how far from it in points.
    at: (Align2, egui::Vec2),
    scrolls: bool,
    is_open: fn(&mut Panels) -> &mut bool,
    show: fn(&mut App, &mut Ui),
}

const PANELS: [Panel; 12] = [
    Panel {
        title: "Picture",
        at: (Align2::RIGHT_TOP, vec2(-8.0, 36.0)),
        scrolls: true,
        is_open: |p| &mut p.render,
        show: render::show,
    },
    Panel {
        title: "Statistics",
        at: (Align2::LEFT_TOP, vec2(8.0, 36.0)),
        scrolls: true,
        is_open: |p| &mut p.statistics,
        show: |app, ui| statistics::show(app, ui),
    },
    Panel {
        title: "Look",
        at: (Align2::RIGHT_BOTTOM, vec2(-8.0, -8.0)),
        scrolls: false,
        is_open: |p| &mut p.looking,
        show: looking::show,
    },
    Panel {
        title: "Inspector",
        at: (Align2::LEFT_TOP, vec2(8.0, 36.0)),
        scrolls: false,
        is_open: |p| &mut p.inspector,
        show: inspector::show,
    },
    Panel {
        title: "Entities",
        at: (Align2::LEFT_BOTTOM, vec2(8.0, -8.0)),
        scrolls: false,
        is_open: |p| &mut p.entities,
        show: entities::show,
    },
    Panel {
        title: "Light styles",
        at: (Align2::RIGHT_BOTTOM, vec2(-8.0, -8.0)),
        scrolls: false,
        is_open: |p| &mut p.styles,
        show: styles::show,
    },
    Panel {
        title: "Places",
        at: (Align2::LEFT_BOTTOM, vec2(8.0, -8.0)),
        scrolls: false,
        is_open: |p| &mut p.places,
        show: places::show,
    },
    Panel {
        title: "Path",
        at: (Align2::LEFT_CENTER, vec2(8.0, 0.0)),
        scrolls: false,
        is_open: |p| &mut p.path,
        show: path::show,
    },
    Panel {
        title: "Window",
        at: (Align2::CENTER_TOP, vec2(0.0, 48.0)),
        scrolls: false,
        is_open: |p| &mut p.window,
        show: window::show,
    },
    Panel {
        title: "Film",
        at: (Align2::RIGHT_BOTTOM, vec2(-8.0, -64.0)),
        scrolls: true,
        is_open: |p| &mut p.export,
        show: export::show,
    },
    Panel {
        title: "Open",
        at: (Align2::CENTER_CENTER, vec2(0.0, 0.0)),
        scrolls: false,
        is_open: |p| &mut p.open,
        show: open::show,
    },
    Panel {
        title: "Keys",
        at: (Align2::CENTER_CENTER, vec2(0.0, 0.0)),
        scrolls: true,
        is_open: |p| &mut p.keys,
        show: |app, ui| keys(app, ui),
    },
];

/// Shows the picture and what lies over it.
pub fn show(app: &mut App, ctx: &Context) {
    picture(app, ctx);
    notices(app, ctx);
    if app.panels.hidden {
        return;
    }
    bar(app, ctx);
    demo::show(app, ctx);
    // What does not fit is scrolled to.
    let height = ctx.viewport_rect().height() - 96.0;
    for panel in PANELS {
        let mut open = *(panel.is_open)(&mut app.panels);
        egui::Window::new(panel.title)
            .anchor(panel.at.0, panel.at.1)
            .resizable(false)
            .default_height(height)
            .max_height(height)
            .frame(egui::Frame::window(&ctx.style()).multiply_with_opacity(0.92))
            .open(&mut open)
            .vscroll(panel.scrolls)
            .show(ctx, |ui| (panel.show)(app, ui));
        // What is shown may have closed it, too.
        *(panel.is_open)(&mut app.panels) &= open;
    }
}

/// The traced picture, all over the window.
fn picture(app: &mut App, ctx: &Context) {
    let (screen, painter) = (
        ctx.viewport_rect(),
        ctx.layer_painter(LayerId::background()),
    );
    if app.settings().is_some() {
        let part = app.looking.zoom.part();
        let [now, then] = app.looking.plates();
        // Layers are of the eye at rest.
        let now = now.filter(|_| app.is_still());
        let texture = now.map_or(PICTURE_ID, |plate| plate.texture.id());
        let then = then.map(|plate| plate.texture.id());
        painter.image(texture, screen, part, Color32::WHITE);
        if let Some(then) = then {
            let x = split(app, ctx, screen);
            let left = Rect::from_min_max(screen.min, Pos2::new(x, screen.bottom()));
            (painter.with_clip_rect(left)).image(then, screen, part, Color32::WHITE);
            let line = [Pos2::new(x, screen.top()), left.right_bottom()];
            painter.line_segment(line, egui::Stroke::new(3.0, Color32::from_black_alpha(160)));
        }
    }
    let is_seen = |report: &&Report| {
        let told = app.settings().map(|s| &s.camera);
        app.panels.inspector && !app.panels.hidden && told == Some(&report.camera)
    };
    if let Some(report) = app.inspected.as_ref().filter(is_seen) {
        let [x, y] = report.at.map(|share| share as f32);
        let at = app.looking.zoom.place(Pos2::new(x, y), screen);
        for (radius, color) in [(6.0, Color32::BLACK), (5.0, Color32::WHITE)] {
            painter.circle_stroke(at, radius, egui::Stroke::new(1.5, color));
        }
    }
    if !ctx.input(|i| i.raw.hovered_files.is_empty()) {
        painter.rect_filled(screen, 0.0, Color32::from_black_alpha(160));
        let text =
            "drop a level (.bsp), a demo (.dem), an archive (.pak) or a picture (.exr) to open it";
        let font = egui::FontId::proportional(24.0);
        painter.text(
            screen.center(),
            Align2::CENTER_CENTER,
            text,
            font,
            Color32::WHITE,
        );
    }
}

/// Moves the border between what was kept, on its left, and what is now, and says where it is.
fn split(app: &mut App, ctx: &Context, screen: Rect) -> f32 {
    /// Half the width of what can be dragged, in points.
    const GRIP: f32 = 6.0;
    let x = screen.left() + app.looking.split * screen.width();
    let grip = vec2(2.0 * GRIP, 48.0);
    let place = Pos2::new(x - GRIP, screen.center().y - grip.y / 2.0);
    egui::Area::new("split".into())
        .order(egui::Order::Middle)
        .fixed_pos(place)
        .constrain(false)
        .show(ctx, |ui| {
            let (rect, response) = ui.allocate_exact_size(grip, egui::Sense::drag());
            let response = response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
            let moved = response.drag_delta().x / screen.width().max(1.0);
            app.looking.split = (app.looking.split + moved).clamp(0.0, 1.0);
            let visuals = ui.style().interact(&response);
            ui.painter().rect(
                rect,
                4.0,
                visuals.bg_fill,
                visuals.fg_stroke,
                egui::StrokeKind::Inside,
            );
        });
    x
}

/// What is loaded, what was said.
fn notices(app: &mut App, ctx: &Context) {
    // An empty area would still be in the way of the mouse.
    if app.notices.all().is_empty() && app.loading.is_none() {
        return;
    }
    let frame = egui::Frame::popup(&ctx.style()).multiply_with_opacity(0.92);
    let area = egui::Area::new("notices".into()).anchor(Align2::CENTER_BOTTOM, vec2(0.0, -12.0));
    area.show(ctx, |ui| {
        let mut gone = None;
        for (i, notice) in app.notices.all().iter().enumerate() {
            frame.show(ui, |ui| {
                ui.set_max_width(ctx.viewport_rect().width() * 0.7);
                let color = if notice.is_error {
                    ui.visuals().error_fg_color
                } else {
                    ui.visuals().strong_text_color()
                };
                let text = RichText::new(&notice.text).color(color);
                if ui.add(egui::Label::new(text).wrap()).clicked() {
                    gone = Some(i);
                }
            });
        }
        if let Some(i) = gone {
            app.notices.forget(i);
        }
        if let Some(loading) = &app.loading {
            let (phase, share, time) = loading.progress();
            // A quick import while a slider moves needs no words.
            if loading.is_new() || time.as_secs_f32() > 0.5 {
                frame.show(ui, |ui| {
                    let text = format!("{phase} {} ({:.0} s)", loading.name(), time.as_secs_f32());
                    ui.add(
                        egui::ProgressBar::new(share)
                            .desired_width(360.0)
                            .text(text),
                    );
                });
            }
        }
    });
}

/// The bar at the top: which panels there are, and how far the picture is.
fn bar(app: &mut App, ctx: &Context) {
    let frame = egui::Frame::side_top_panel(&ctx.style()).multiply_with_opacity(0.85);
    egui::TopBottomPanel::top("bar").frame(frame).show(ctx, |ui| {
        ui.horizontal_wrapped(|ui| {
            let panels = &mut app.panels;
            ui.toggle_value(&mut panels.open, "Open")
                .on_hover_text("levels of the search path; files can also be dropped on the window");
            ui.toggle_value(&mut panels.places, "Places")
                .on_hover_text("the level's cameras, and typing where to be");
            ui.toggle_value(&mut panels.path, "Path")
                .on_hover_text("a flight of the camera: keys, played and kept");
            ui.toggle_value(&mut panels.render, "Picture")
                .on_hover_text("how the picture is made");
            ui.toggle_value(&mut panels.looking, "Look")
                .on_hover_text("layers, zoom, pixel values, comparison with another picture");
            ui.toggle_value(&mut panels.inspector, "Inspector")
                .on_hover_text("click on the picture: what is there, and where its light comes from");
            ui.toggle_value(&mut panels.entities, "Entities")
                .on_hover_text("the entities of the level; a click goes there");
            ui.toggle_value(&mut panels.styles, "Styles")
                .on_hover_text("light styles: how bright each one is");
            ui.toggle_value(&mut panels.statistics, "Statistics")
                .on_hover_text("what the picture costs");
            ui.toggle_value(&mut panels.window, "Window")
                .on_hover_text("how often it is drawn, its colours, the size of its words");
            ui.toggle_value(&mut panels.keys, "Keys").on_hover_text("what keys do");
            ui.separator();
            let key = app.bindings.key(Action::Save).name();
            let save = ui.button("Save").on_hover_text(format!(
                "EXR with all layers, and PNG; the clipboard gets the command that makes them again ({key})"
            ));
            if save.clicked() {
                app.save();
            }
            let mut walks = app.is_walking();
            if ui
                .toggle_value(&mut walks, "Walk")
                .on_hover_text("with a player's box, gravity and steps, instead of flying")
                .changed()
            {
                app.set_walking(walks);
            }
            ui.separator();
            let total = app.args.picture.spp;
            ui.label(format!("{} / {total} samples", app.samples()));
            if let Some(why) = app.stopped() {
                let why = match why {
                    Stopped::Complete => "done",
                    other => other.name(),
                };
                ui.strong(why).on_hover_text("why there are no more samples");
            }
            if let Some(stage) = &app.stage {
                ui.separator();
                ui.label(&stage.scene.name);
            }
        });
    });
}

fn keys(app: &App, ui: &mut Ui) {
    egui::Grid::new("keys").num_columns(2).show(ui, |ui| {
        for (action, _, what, _) in ACTIONS {
            ui.strong(app.bindings.key(action).name());
            ui.label(what);
            ui.end_row();
        }
        for (key, what) in [
            ("Shift", "hurry"),
            ("Mouse wheel", "fly faster or slower"),
            ("Click", "inspect, while that panel is open"),
            ("Ctrl+wheel", "go nearer to the picture"),
            ("Ctrl+drag", "move it then"),
            ("Drag", "look around"),
            ("Escape", "let go of the mouse"),
            ("Ctrl+Q", "end"),
        ] {
            ui.strong(key);
            ui.label(what);
            ui.end_row();
        }
    });
}
