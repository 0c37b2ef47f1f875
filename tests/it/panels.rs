//! The panels by themselves, without a device's picture: what they draw says what it should, explains itself
//! and fits.
//!
//! They are laid out by egui itself, without `egui_kittest`: that turns on egui's `accesskit`, with which `egui-winit` compiles
//! only if the window is linked with all of AccessKit. What a frame draws is asked here instead, and `golden_window` compares
//! whole windows by FLIP.

use crate::viewer::{LIMIT, SIZE, files, opened, words as words_of};
use clap::Parser as _;
use egui::epaint::ClippedShape;
use egui::{
    Context, Event, Id, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Theme, Vec2,
    ViewportId,
};
use runelight::cli::Cli;
use runelight::view::app::App;
use runelight::view::panels::{self, Panels};
use runelight::view::preferences::Preferences;
use runelight::view::session::Session;
use runelight::view::stage::SAMPLE_DEMO;
use std::path::Path;
use std::time::Instant;

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

    /// A click there.
    fn click(&mut self, at: Pos2) {
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::default(),
        };
        self.frame(vec![Event::PointerMoved(at)]);
        self.frame(vec![button(true)]);
        self.frame(vec![button(false)]);
        self.frame(vec![Event::PointerGone]);
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
pub(crate) const SETTINGS: &str = "Exposure,Tone curve,Denoiser,Field of view,Aperture,Level time,Size,Samples,Target error,\
    Time limit,Samples per frame,Frame budget,Depth,Estimator,Selection,Candidates,Sampler,Clamp,Seed,\
    Threshold,Emission,Lamps,Lighting,Fog,Sky fog";

/// Those that are no numbers.
const CHOICES: [&str; 7] = [
    "Tone curve",
    "Denoiser",
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

/// A room with a wall that a camera looks along, and a lamp on each side of it, whose light reaches the half of the
/// picture that is its own: of style 0 on the left, of style 3 on the right.
fn write_two_sides(file: &Path) {
    let mut map = mapc::Map::new();
    map.texture(mapc::Texture::solid("wall", 64, 64, 100));
    map.room([0.0; 3], [256.0, 256.0, 144.0], 16.0, "wall");
    map.brush_box([120.0, 80.0, 0.0], [136.0, 256.0, 144.0], "wall");
    map.entity("info_player_start", &[("origin", "128 32 40")]);
    for (origin, style) in [("60 200 64", "0"), ("196 200 64", "3")] {
        let keys = [("origin", origin), ("light", "300"), ("style", style)];
        map.entity("light", &keys);
    }
    let level = mapc::compile(&map, &mapc::Options::default()).expect("a level");
    std::fs::write(file, level.bytes).expect("a level");
}

/// The picture, and how bright its left and its right half are, but for the edge of the wall in its middle.
fn halves(app: App) -> (App, Vec<[f32; 3]>, [f64; 2]) {
    let mut session = Session::new(app, SIZE, 1.0).expect("a screen");
    session.app.panels.hidden = true;
    session.until(LIMIT, App::is_done).expect("a picture");
    let film = session.app.film().expect("a device").expect("a film");
    let width = film.width as usize;
    let mean = |columns: std::ops::Range<usize>| {
        let count = columns.len() * film.height as usize;
        let rows = film.beauty.chunks_exact(width);
        let sum: f64 = (rows.flat_map(|row| &row[columns.clone()]))
            .map(|p| f64::from(p[1]))
            .sum();
        sum / count as f64
    };
    let both = [mean(0..2 * width / 5), mean(3 * width / 5..width)];
    (session.app, film.beauty, both)
}

/// Light styles are muted, heard alone and dimmed where that is clicked; the picture becomes what the numbers say, and its
/// command says the same numbers and makes the same files.
#[test]
fn light_styles_are_set_by_their_buttons() {
    let name = format!("runelight-styles-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    let level = folder.join("sides.bsp");
    write_two_sides(&level);
    let level = level.display().to_string();
    let camera = "128 24 64 0 90 0";
    // What lamps give directly.
    let args = ["--spp", "32", "--depth", "2", "--camera", camera, &level];
    let (app, usual, [left, right]) = halves(opened(&args, true).app);
    assert!(left > 0.0 && right > 0.0, "{left}, {right}");
    // Samples choose among other lamps: as bright as before, but for noise.
    let near = |found: f64, expected: f64| (found - expected).abs() <= 0.02 * expected;

    let mut desk = Desk::new(app, Vec2::new(800.0, 600.0), 1.0, Theme::Dark);
    // What is right of a style's name: its number, and its two buttons.
    let row = |desk: &mut Desk, style: &str| {
        desk.app.panels = Panels::none();
        desk.app.panels.styles = true;
        let all = desk.settle();
        let name = all.iter().find(|w| w.text == style).expect("its name");
        let (y, x) = (name.at.center().y, name.at.right());
        let mut beside: Vec<_> = (all.iter())
            .filter(|w| (w.at.center().y - y).abs() < 6.0 && w.at.left() > x)
            .map(|w| (w.text.clone(), w.at.center()))
            .collect();
        beside.sort_by(|a, b| a.1.x.total_cmp(&b.1.x));
        beside
    };
    let press = |desk: &mut Desk, style: &str, button: &str| {
        let beside = row(desk, style);
        let found = beside.iter().find(|(text, _)| text == button);
        desk.click(found.expect("a button").1);
    };
    let (steady, candle) = ("0 steady", "3 candle");
    // Each button that is pressed, the brightness of each style that is set then, and which halves are lit.
    type Case<'a> = (&'a str, &'a str, &'a [(u16, f64)], [bool; 2]);
    let cases: [Case; 8] = [
        (steady, "M", &[(0, 0.0)], [false, true]),
        (steady, "M", &[], [true, true]),
        (candle, "M", &[(3, 0.0)], [true, false]),
        (candle, "M", &[], [true, true]),
        (steady, "S", &[(3, 0.0)], [true, false]),
        // The other one instead.
        (candle, "S", &[(0, 0.0)], [false, true]),
        (candle, "S", &[], [true, true]),
        (steady, "M", &[(0, 0.0)], [false, true]),
    ];
    for (style, button, expected, lit) in cases {
        press(&mut desk, style, button);
        let set = &desk.app.args.picture.scene.styles;
        assert_eq!(set, expected, "{button} of {style}");
        let (app, picture, both) = halves(desk.app);
        desk.app = app;
        for (i, usual) in [left, right].into_iter().enumerate() {
            let fits = if lit[i] {
                near(both[i], usual)
            } else {
                both[i] == 0.0
            };
            assert!(fits, "{button} of {style}: {both:?} of {left}, {right}");
        }
        assert_eq!(picture == usual, expected.is_empty(), "{button} of {style}");
    }

    // Half way of what is left of the slider: the one is dimmed, the other stays dark.
    let beside = row(&mut desk, candle);
    let (text, number) = &beside[0];
    assert_eq!(text, "1.03", "as the level has it");
    desk.click(*number - Vec2::new(90.0, 0.0));
    let set = desk.app.args.picture.scene.styles.clone();
    let [(0, 0.0), (3, brightness)] = set[..] else {
        panic!("{set:?}");
    };
    assert!(
        brightness > 0.05 && (brightness - 1.03).abs() > 0.2,
        "{brightness}"
    );
    // Letter m of a to z, of which z is 264: 1 is 256.
    let normal = 12.0 * 22.0 / 256.0;
    let (app, _, both) = halves(desk.app);
    let expected = right * brightness / normal;
    assert!(
        both[0] == 0.0 && near(both[1], expected),
        "{both:?}, not {expected}"
    );

    // What is saved says so.
    let mut session = Session::new(app, SIZE, 1.0).expect("a screen");
    session.app.folder = folder.join("pictures");
    std::fs::create_dir_all(&session.app.folder).expect("a folder");
    let pictures = session.app.folder.clone();
    session.app.panels.hidden = true;
    session.until(LIMIT, App::is_done).expect("a picture");
    session.tap(egui::Key::P).expect("frames");
    let is_saved = |app: &App| app.saved.is_some();
    session.until(LIMIT, is_saved).expect("files");
    let command = session.app.saved.as_ref().expect("files").command.clone();
    for (style, brightness) in set {
        let option = format!("--light-style '{style}={brightness}'");
        let plain = option.replace('\'', "");
        assert!(
            command.contains(&option) || command.contains(&plain),
            "{command}"
        );
    }
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
    drop(session);
    let made = files(&pictures);
    for (file, _) in &made {
        std::fs::remove_file(pictures.join(file)).expect("a file to remove");
    }
    let mut again = words_of(&command);
    again.push("--quiet".into());
    let cli = Cli::try_parse_from(&again).unwrap_or_else(|e| panic!("{command}: {e}"));
    runelight::cmd::run(&cli, Instant::now()).expect("a picture");
    assert!(made.len() == 2 && files(&pictures) == made, "{command}");
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}
