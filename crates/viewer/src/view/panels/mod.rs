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

pub use files::KINDS as FILE_KINDS;

use super::app::App;
use super::draw::PICTURE_ID;
use super::inspect::Report;
use super::keys::{ACTIONS, Action};
use crate::job::Stopped;
use egui::{Align, Align2, Color32, Context, Id, LayerId, Pos2, Rect, RichText, Ui, vec2};
use std::collections::BTreeMap;

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
    /// Words of those that are open, in the order in which they were opened.
    order: Vec<&'static str>,
    /// Those that somebody has moved, by their words: their corner or side in points.
    pub(super) moved: BTreeMap<&'static str, [f32; 2]>,
    /// Whether files are listed in the panel for opening them.
    pub lists_files: bool,
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
            order: Vec::new(),
            moved: BTreeMap::new(),
            lists_files: false,
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
pub(super) struct Panel {
    /// What the bar calls it, and in small letters the settings.
    pub word: &'static str,
    title: &'static str,
    /// What the bar says of it; `None` of what has its button elsewhere.
    hint: Option<&'static str>,
    /// Corner or side of the room under the bar, until it is moved.
    at: Align2,
    /// Where in [`Panels`] it is told whether it is open.
    pub is_open: fn(&mut Panels) -> &mut bool,
    show: fn(&mut App, &mut Ui),
}

impl Panel {
    /// What the settings call it.
    pub fn name(&self) -> String {
        self.word.to_ascii_lowercase()
    }

    fn id(&self) -> Id {
        Id::new(("panel", self.word))
    }
}

/// All panels, in the order of the bar.
pub(super) const PANELS: [Panel; 12] = [
    Panel {
        word: "Open",
        title: "Open",
        hint: Some("levels of the search path; files can also be dropped on the window"),
        at: Align2::CENTER_CENTER,
        is_open: |p| &mut p.open,
        show: open::show,
    },
    Panel {
        word: "Places",
        title: "Places",
        hint: Some("the level's cameras, and typing where to be"),
        at: Align2::LEFT_BOTTOM,
        is_open: |p| &mut p.places,
        show: places::show,
    },
    Panel {
        word: "Path",
        title: "Path",
        hint: Some("a flight of the camera: keys, played and kept"),
        at: Align2::LEFT_CENTER,
        is_open: |p| &mut p.path,
        show: path::show,
    },
    Panel {
        word: "Picture",
        title: "Picture",
        hint: Some("how the picture is made"),
        at: Align2::RIGHT_TOP,
        is_open: |p| &mut p.render,
        show: render::show,
    },
    Panel {
        word: "Look",
        title: "Look",
        hint: Some("layers, zoom, pixel values, comparison with another picture"),
        at: Align2::RIGHT_BOTTOM,
        is_open: |p| &mut p.looking,
        show: looking::show,
    },
    Panel {
        word: "Inspector",
        title: "Inspector",
        hint: Some("click on the picture: what is there, and where its light comes from"),
        at: Align2::LEFT_TOP,
        is_open: |p| &mut p.inspector,
        show: inspector::show,
    },
    Panel {
        word: "Entities",
        title: "Entities",
        hint: Some("the entities of the level; a click goes there"),
        at: Align2::LEFT_BOTTOM,
        is_open: |p| &mut p.entities,
        show: entities::show,
    },
    Panel {
        word: "Styles",
        title: "Light styles",
        hint: Some("light styles: how bright each one is"),
        at: Align2::RIGHT_BOTTOM,
        is_open: |p| &mut p.styles,
        show: styles::show,
    },
    Panel {
        word: "Statistics",
        title: "Statistics",
        hint: Some("what the picture costs"),
        at: Align2::LEFT_TOP,
        is_open: |p| &mut p.statistics,
        show: |app, ui| statistics::show(app, ui),
    },
    Panel {
        word: "Window",
        title: "Window",
        hint: Some("how often it is drawn, its colours, the size of its words"),
        at: Align2::CENTER_TOP,
        is_open: |p| &mut p.window,
        show: window::show,
    },
    Panel {
        word: "Keys",
        title: "Keys",
        hint: Some("what keys do"),
        at: Align2::CENTER_CENTER,
        is_open: |p| &mut p.keys,
        show: |app, ui| keys(app, ui),
    },
    Panel {
        word: "Film",
        title: "Film",
        hint: None,
        at: Align2::RIGHT_BOTTOM,
        is_open: |p| &mut p.export,
        show: export::show,
    },
];

impl Panels {
    /// Words of the panels that are open, in the order in which they were opened.
    pub(super) fn opened(&mut self) -> &[&'static str] {
        for panel in PANELS {
            let is_open = *(panel.is_open)(self);
            let is_known = self.order.contains(&panel.word);
            if is_open && !is_known {
                self.order.push(panel.word);
            } else if !is_open && is_known {
                self.order.retain(|word| *word != panel.word);
            }
        }
        &self.order
    }
}

/// Shows the picture and what lies over it.
pub fn show(app: &mut App, ctx: &Context) {
    picture(app, ctx);
    if !app.panels.hidden {
        bar(app, ctx);
        demo::show(app, ctx);
    }
    let room = ctx.available_rect();
    notices(app, ctx, room);
    if app.panels.hidden {
        return;
    }
    // Title and edges of a panel, in points.
    let height = room.height() - 2.0 * APART - 60.0;
    let mut taken: Vec<Rect> = Vec::new();
    for word in app.panels.opened().to_vec() {
        let Some(panel) = PANELS.iter().find(|p| p.word == word) else {
            continue;
        };
        let last = ctx.memory(|m| m.area_rect(panel.id()));
        let size = last.map_or(egui::Vec2::ZERO, |r| r.size());
        let at = (app.panels.moved.get(word))
            .map_or_else(|| place(panel.at, size, room, &taken), |&at| at.into());
        let mut open = true;
        let shown = egui::Window::new(panel.title)
            .id(panel.id())
            .pivot(panel.at)
            .current_pos(at)
            .constrain_to(room)
            .resizable(false)
            // What it may take; it is as high as what is in it.
            .min_height(height)
            .max_height(height)
            .frame(glass(ctx, egui::Frame::window(&ctx.style()), 0.92))
            .open(&mut open)
            .show(ctx, |ui| {
                // What does not fit is scrolled to.
                let scroll = egui::ScrollArea::vertical().max_height(height);
                scroll.show(ui, |ui| (panel.show)(app, ui));
            });
        if let Some(shown) = shown {
            let rect = shown.response.rect;
            taken.push(rect);
            if shown.response.dragged() {
                let at = panel.at.pos_in_rect(&rect);
                app.panels.moved.insert(word, at.into());
            }
        }
        // What is shown may have closed it, too.
        *(panel.is_open)(&mut app.panels) &= open;
    }
}

/// A frame that lets some of the picture through. A light one does not: over a dark picture it would be as grey
/// as the buttons on it.
fn glass(ctx: &Context, frame: egui::Frame, opacity: f32) -> egui::Frame {
    if ctx.style().visuals.dark_mode {
        frame.multiply_with_opacity(opacity)
    } else {
        frame
    }
}

/// Points between panels.
const APART: f32 = 8.0;

/// Where a panel of this size goes that nobody has moved: to its side of the room, or beside the panels that
/// are there already. The point is that corner or side of it.
fn place(align: Align2, size: egui::Vec2, room: Rect, taken: &[Rect]) -> Pos2 {
    let room = room.shrink(APART);
    let usual = align.align_size_within_rect(size, room);
    let mut rect = usual;
    while let Some(other) = taken.iter().find(|other| other.intersects(rect)) {
        let left = if align.x() == Align::Max {
            other.left() - APART - size.x
        } else {
            other.right() + APART
        };
        rect = Rect::from_min_size(Pos2::new(left, rect.top()), size);
        if rect.left() < room.left() || rect.right() > room.right() {
            // There is no room for it: it lies over them.
            rect = usual;
            break;
        }
    }
    align.pos_in_rect(&rect)
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
fn notices(app: &mut App, ctx: &Context, room: Rect) {
    // An empty area would still be in the way of the mouse.
    if app.notices.all().is_empty() && app.loading.is_none() {
        return;
    }
    let frame = glass(ctx, egui::Frame::popup(&ctx.style()), 0.92);
    let area = egui::Area::new("notices".into())
        .constrain_to(room)
        .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -12.0));
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
    let frame = glass(ctx, egui::Frame::side_top_panel(&ctx.style()), 0.85);
    egui::TopBottomPanel::top("bar").frame(frame).show(ctx, |ui| {
        ui.horizontal_wrapped(|ui| {
            for panel in PANELS {
                if let Some(hint) = panel.hint {
                    ui.toggle_value((panel.is_open)(&mut app.panels), panel.word).on_hover_text(hint);
                }
            }
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
            ("Left stick", "move"),
            ("Right stick", "look around"),
            ("Triggers", "sink, rise"),
        ] {
            ui.strong(key);
            ui.label(what);
            ui.end_row();
        }
    });
}
