//! The panels by themselves, without a device's picture: what they draw says what it should, explains itself
//! and fits.
//!
//! They are laid out by egui itself, without `egui_kittest`: that turns on egui's `accesskit`, with which `egui-winit` compiles
//! only if the window is linked with all of AccessKit. What a frame draws is asked here instead, and `golden_window` compares
//! whole windows by FLIP.

use crate::viewer::opened;
use egui::epaint::ClippedShape;
use egui::{
    Context, Event, Id, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Theme, Vec2,
    ViewportId,
};
use runelight::view::app::App;
use runelight::view::panels::{self, Panels};
use runelight::view::preferences::Preferences;
use runelight::view::stage::SAMPLE_DEMO;

/// Somebody in front of the panels.
struct Desk {
    ctx: Context,
    app: App,
    size: Vec2,
    scale: f32,
    seconds: f64,
    theme: Theme,
}

/// Words that were drawn: what, where, and which part of the window they may be drawn on.
struct Words {
    text: String,
    at: Rect,
    clip: Rect,
}

impl Desk {
    fn new(app: App, size: Vec2, scale: f32, theme: Theme) -> Self {
        let ctx = Context::default();
        ctx.set_theme(theme);
        Self {
            ctx,
            app,
            size,
            scale,
            seconds: 0.0,
            theme,
        }
    }

    /// A frame, and the words in it.
    fn frame(&mut self, events: Vec<Event>) -> Vec<Words> {
        self.seconds += 0.2;
        let mut raw = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            time: Some(self.seconds),
            system_theme: Some(self.theme),
            events,
            ..RawInput::default()
        };
        if let Some(viewport) = raw.viewports.get_mut(&ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let app = &mut self.app;
        let full = self.ctx.run(raw, |ctx| panels::show(app, ctx));
        full.shapes.iter().flat_map(words).collect()
    }

    /// Frames until panels have their size and place.
    fn settle(&mut self) -> Vec<Words> {
        (0..6).for_each(|_| _ = self.frame(Vec::new()));
        self.frame(Vec::new())
    }

    /// Where a panel is, by its word in the bar.
    fn panel(&self, word: &str) -> Rect {
        let id = Id::new(("panel", word));
        let rect = self.ctx.memory(|m| m.area_rect(id));
        rect.unwrap_or_else(|| panic!("{word} is not shown"))
    }

    /// The words there are while the pointer rests at a place.
    fn point_at(&mut self, at: Pos2) -> Vec<Words> {
        // Words that explain come when the pointer has been still for a while.
        self.frame(vec![Event::PointerMoved(at)]);
        (0..6).for_each(|_| _ = self.frame(Vec::new()));
        let seen = self.frame(Vec::new());
        self.frame(vec![Event::PointerGone]);
        self.settle();
        seen
    }
}

fn words(shape: &ClippedShape) -> Vec<Words> {
    fn of(shape: &Shape, clip: Rect, all: &mut Vec<Words>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|s| of(s, clip, all)),
            Shape::Text(text) => all.push(Words {
                text: text.galley.text().to_owned(),
                at: text.galley.rect.translate(text.pos.to_vec2()),
                clip,
            }),
            _ => {}
        }
    }
    let mut all = Vec::new();
    of(&shape.shape, shape.clip_rect, &mut all);
    all
}

/// Settings of the picture's panel.
pub(crate) const SETTINGS: &str = "Exposure,Tone curve,Field of view,Aperture,Level time,Size,Samples,Target error,\
    Time limit,Samples per frame,Frame budget,Depth,Estimator,Selection,Candidates,Sampler,Clamp,Seed,\
    Threshold,Emission,Lamps,Lighting,Fog,Sky fog";

/// Those that are no numbers.
const CHOICES: [&str; 6] = [
    "Tone curve",
    "Estimator",
    "Selection",
    "Sampler",
    "Lamps",
    "Lighting",
];

/// Every setting of the picture has words that explain it and tell its range, and a button that takes it back.
fn settings_explain_themselves(app: App) -> App {
    // High enough that nothing has to be scrolled to.
    let mut desk = Desk::new(app, Vec2::new(1280.0, 1800.0), 1.0, Theme::Dark);
    desk.app.panels = Panels::default();
    let all = desk.settle();
    let mut missing = Vec::new();
    for name in SETTINGS.split(',') {
        let label = all.iter().find(|w| w.text == name);
        let label = label.unwrap_or_else(|| panic!("{name} is not there"));
        let row = label.at.center();
        let resets = all.iter().filter(|w| w.text == "\u{21ba}");
        let beside = |w: &Words| (w.at.center().y - row.y).abs() < 12.0 && w.at.left() > row.x;
        assert!(resets.clone().any(beside), "{name} can be taken back");
        let seen = desk.point_at(row);
        let is_new = |w: &&Words| all.iter().all(|old| old.text != w.text);
        let explained: Vec<&str> = seen.iter().filter(is_new).map(|w| &*w.text).collect();
        let is_number = !CHOICES.contains(&name);
        let ranges = explained.iter().any(|text| text.contains(" to "));
        if explained.is_empty() || is_number && !ranges {
            missing.push(name);
        }
    }
    assert!(missing.is_empty(), "not explained: {missing:?}");
    desk.app
}

/// Every panel fits the window at 100 and at 200 percent, dark and light: no word is cut off at its side.
fn panels_fit(mut app: App) {
    type Opens = fn(&mut Panels);
    let shown: [(&str, Opens); 11] = [
        ("picture", |p| p.render = true),
        ("statistics", |p| p.statistics = true),
        ("places", |p| p.places = true),
        ("open", |p| p.open = true),
        ("path", |p| p.path = true),
        ("look", |p| p.looking = true),
        ("inspector", |p| p.inspector = true),
        ("entities", |p| p.entities = true),
        ("styles", |p| p.styles = true),
        ("window", |p| p.window = true),
        ("keys", |p| p.keys = true),
    ];
    for (scale, theme) in [(1.0, Theme::Dark), (2.0, Theme::Light)] {
        // 200 percent of a display that has as many pixels as people have at that.
        let size = Vec2::new(1920.0, 1200.0) / scale;
        for (name, open) in shown {
            let mut desk = Desk::new(app, size, scale, theme);
            desk.app.panels = Panels::none();
            open(&mut desk.app.panels);
            let all = desk.settle();
            assert!(all.len() > 12, "{name} shows {} words", all.len());
            let window = Rect::from_min_size(Pos2::ZERO, size);
            for Words { text, at, clip } in all {
                // What is scrolled away is cut off above and below.
                let room = clip.intersect(window).expand(0.5).x_range();
                let fits = room.contains(at.left()) && room.contains(at.right());
                assert!(fits, "{name}: {text:?} at {at} in {clip} of {size} points");
            }
            app = desk.app;
        }
    }
}

#[test]
fn panels_explain_themselves_and_fit() {
    let session = opened(&["--spp", "1", "--depth", "1", "--no-entities"], true);
    panels_fit(settings_explain_themselves(session.app));
}

const ALL: [&str; 12] = [
    "Open",
    "Places",
    "Path",
    "Picture",
    "Look",
    "Inspector",
    "Entities",
    "Styles",
    "Statistics",
    "Window",
    "Keys",
    "Film",
];

/// Panels lie between the bar and a demo's line, beside each other where there is room, and where they were moved;
/// which are open, in which order and where, is remembered.
#[test]
fn panels_lie_beside_each_other_and_are_remembered() {
    let session = opened(&["--spp", "1", "--depth", "1", SAMPLE_DEMO], true);
    let mut desk = Desk::new(session.app, Vec2::new(880.0, 560.0), 1.0, Theme::Dark);
    let remembered = |app: &App| {
        let text = app.preferences().text();
        Preferences::parse(&text).expect("what was written")
    };
    // A window is as high as wide, low, and large.
    for size in [
        [880.0, 560.0],
        [880.0, 880.0],
        [640.0, 360.0],
        [1280.0, 720.0],
    ] {
        desk.size = size.into();
        for word in ALL {
            let name = word.to_ascii_lowercase();
            desk.app.panels = Panels::default();
            let only = Preferences {
                panels: Some(vec![name.clone()]),
                ..Preferences::default()
            };
            desk.app.prefer(only.clone());
            desk.settle();
            let [bar, line] = ["bar", "demo"].map(|id| {
                let state = egui::containers::panel::PanelState::load(&desk.ctx, Id::new(id));
                state.expect("a bar").rect
            });
            let at = desk.panel(word);
            let room = Rect::from_x_y_ranges(bar.x_range(), bar.bottom()..=line.top());
            assert!(room.contains_rect(at), "{word} at {at} in {room}");
            assert_eq!(remembered(&desk.app).panels, only.panels);
        }
    }

    let beside = ["statistics", "inspector", "picture", "places"];
    let preferences = Preferences {
        panels: Some(beside.map(str::to_owned).into()),
        ..Preferences::default()
    };
    desk.size = Vec2::new(1600.0, 900.0);
    desk.app.panels = Panels::default();
    desk.app.prefer(preferences);
    desk.settle();
    let places = ["Statistics", "Inspector", "Picture", "Places"].map(|word| desk.panel(word));
    for (i, a) in places.iter().enumerate() {
        for b in &places[i + 1..] {
            assert!(!a.intersects(*b), "{places:?}");
        }
    }
    assert!(
        places[0].left() < places[1].left(),
        "the first opened is in the corner"
    );

    // By its title.
    let from = places[0].center_top() + Vec2::new(0.0, 12.0);
    let by = Vec2::new(420.0, 150.0);
    let button = |pos, pressed| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::default(),
    };
    desk.frame(vec![Event::PointerMoved(from)]);
    desk.frame(vec![button(from, true)]);
    desk.frame(vec![Event::PointerMoved(from + by / 2.0)]);
    desk.frame(vec![Event::PointerMoved(from + by)]);
    desk.frame(vec![button(from + by, false), Event::PointerGone]);
    desk.settle();
    let moved = desk.panel("Statistics");
    assert!((moved.min - (places[0].min + by)).length() < 1.0, "{moved}");
    assert!(
        (desk.panel("Inspector").left() - places[0].left()).abs() < 1.0,
        "it takes the place that is free"
    );
    let kept = remembered(&desk.app);
    assert_eq!(kept.panels, Some(beside.map(str::to_owned).into()));
    desk.ctx = Context::default();
    desk.app.panels = Panels::default();
    desk.app.prefer(kept);
    desk.settle();
    assert!((desk.panel("Statistics").min - moved.min).length() < 1.0);
}
