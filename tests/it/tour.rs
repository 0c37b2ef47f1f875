//! A whole visit in the real window: somebody flies, changes every setting, opens an archive, plays a demo, keeps
//! pictures, resizes and leaves, on a display with two pixels to a point.

use crate::panels::SETTINGS;
use crate::window::{on_a_display, options};
use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use runelight::cli::{EstimatorName, LightingName, Lights, SamplerName, SelectionName};
use runelight::denoise::Denoise;
use runelight::tonemap::Tonemap;
use runelight::view::app::{App, Wish};
use runelight::view::fly::Eye;
use runelight::view::look::{Preset, defaults, layers};
use runelight::view::stage::SAMPLE_DEMO;
use runelight::view::window::{self, Options, PilotWish};
use runelight_tests::levels;
use scene::import::FogKeys;
use std::cell::Cell;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

type Act = Box<dyn FnMut(&mut App) -> Vec<PilotWish>>;

/// Something that is done, and when that is over.
pub(crate) struct Step {
    what: String,
    act: Act,
    over: Box<dyn Fn(&App) -> bool>,
    /// Frames that it takes at least.
    pub frames: u64,
}

#[test]
fn the_window_is_used_from_end_to_end() {
    let test = "tour::the_window_is_used_from_end_to_end";
    on_a_display(test, tour, "2");
}

pub(crate) fn step(
    what: &str,
    act: impl FnMut(&mut App) -> Vec<PilotWish> + 'static,
    over: impl Fn(&App) -> bool + 'static,
) -> Step {
    Step {
        what: what.into(),
        act: Box::new(act),
        over: Box::new(over),
        frames: 2,
    }
}

/// Something that is done at once; the picture is waited for.
pub(crate) fn now(what: &str, mut act: impl FnMut(&mut App) + 'static) -> Step {
    let act = move |app: &mut App| {
        act(app);
        Vec::new()
    };
    step(what, act, App::is_done)
}

fn key(key: Key, pressed: bool) -> PilotWish {
    PilotWish::Input(Event::Key {
        key,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::default(),
    })
}

pub(crate) fn tap(which: Key, over: impl Fn(&App) -> bool + 'static) -> [Step; 2] {
    let press = move |pressed| move |_: &mut App| vec![key(which, pressed)];
    [
        step("a key is pressed", press(true), |_| true),
        step("a key is let go", press(false), over),
    ]
}

type Change = fn(&mut App);

/// Every setting of the picture, by its name in the panel, with another value than the usual.
const CHANGES: [(&str, Change); 25] = [
    ("Exposure", |a| a.args.picture.exposure = 1.0),
    ("Tone curve", |a| a.args.picture.tonemap = Tonemap::Aces),
    ("Denoiser", |a| a.args.picture.denoise = Denoise::Svgf),
    ("Field of view", |a| a.args.picture.view.fov = Some(70.0)),
    ("Aperture", |a| {
        let view = &mut a.args.picture.view;
        (view.aperture, view.focus) = (Some(1.0), Some(200.0));
    }),
    ("Level time", |a| a.args.picture.scene.at = 1.5),
    ("Size", |a| a.panels.percent = 12),
    ("Samples", |a| a.args.picture.spp = 2),
    ("Target error", |a| a.args.picture.target_error = Some(1e-6)),
    ("Time limit", |a| a.args.picture.time_limit = Some(60.0)),
    ("Samples per frame", |a| a.pace.most_samples = 2),
    ("Frame budget", |a| a.panels.budget_ms = 30.0),
    ("Depth", |a| a.args.picture.depth = 3),
    ("Estimator", |a| {
        a.args.picture.estimator = EstimatorName::Nee
    }),
    ("Selection", |a| {
        a.args.picture.selection = SelectionName::Power
    }),
    ("Candidates", |a| a.args.picture.candidates = 2),
    ("Sampler", |a| {
        a.args.picture.sampler = SamplerName::Independent
    }),
    ("Clamp", |a| a.args.picture.clamp = Some(4.0)),
    ("Seed", |a| a.args.picture.seed = 5),
    ("Threshold", |a| a.args.picture.scene.threshold = 0.3),
    ("Emission", |a| a.args.picture.scene.emission_scale = 6.0),
    ("Lamps", |a| a.args.picture.scene.lights = Lights::Textures),
    ("Lighting", |a| {
        a.args.picture.lighting = LightingName::Lightmap
    }),
    ("Fog", |a| {
        let fog = FogKeys {
            density: 0.05,
            ..FogKeys::OFF
        };
        a.args.picture.scene.fog = Some(fog);
    }),
    ("Sky fog", |a| a.args.picture.scene.skyfog = Some(0.3)),
];

/// What else there is to set.
const MORE: [(&str, Change); 10] = [
    ("exposure by itself", |a| a.auto_exposure.on = true),
    ("thesis", |a| Preset::Thesis.apply(&mut a.args.picture)),
    ("preview", |a| Preset::Preview.apply(&mut a.args.picture)),
    ("truth", |a| Preset::Truth.apply(&mut a.args.picture)),
    ("skill", |a| a.args.picture.scene.entities.skill = 3),
    ("deathmatch", |a| {
        a.args.picture.scene.entities.deathmatch = true
    }),
    ("inhabitants", |a| {
        a.args.picture.scene.entities.no_entities = true
    }),
    ("textures", |a| {
        a.args.picture.scene.surfaces.no_textures = true
    }),
    ("models", |a| {
        a.args.picture.scene.surfaces.flat_models = true
    }),
    ("layers", |a| a.args.picture.layers = layers(true)),
];

/// All as it was: the next change is by itself.
fn usual(app: &mut App) {
    app.args.picture = defaults().picture;
    (app.args.picture.spp, app.args.picture.depth) = (1, 2);
    (app.panels.percent, app.pace.most_samples) = (10, 16);
    app.auto_exposure.on = false;
}

fn flies(steps: &mut VecDeque<Step>) {
    steps.push_back(step(
        "the level is there",
        |a| {
            a.panels.percent = 10;
            Vec::new()
        },
        |a| a.samples() > 0,
    ));
    let first: Rc<Cell<Option<Eye>>> = Rc::default();
    let begins = Rc::clone(&first);
    steps.push_back(now("usual", move |app| {
        usual(app);
        begins.set(Some(app.eye));
    }));
    let mut hold = step("flies", |_| vec![key(Key::W, true)], |_| true);
    hold.frames = 12;
    steps.push_back(hold);
    steps.push_back(step("stops", |_| vec![key(Key::W, false)], App::is_done));
    let (begun, last) = (Rc::clone(&first), Rc::clone(&first));
    steps.push_back(now("has flown", move |app| {
        let begun = begun.get().expect("where it began");
        assert!(app.eye.position.distance(begun.position) > 5.0);
    }));
    let button = |pos, pressed| {
        PilotWish::Input(Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::default(),
        })
    };
    let moved = |pos| PilotWish::Input(Event::PointerMoved(pos));
    // The left of the window has no panel.
    let [from, to] = [60.0, 160.0].map(|x| Pos2::new(x, 300.0));
    steps.push_back(step("points", move |_| vec![moved(from)], |_| true));
    steps.push_back(step("looks", move |_| vec![button(from, true)], |_| true));
    steps.push_back(step("around", move |_| vec![moved(to)], |_| true));
    steps.push_back(step(
        "there",
        move |_| vec![button(to, false), PilotWish::Input(Event::PointerGone)],
        App::is_done,
    ));
    steps.push_back(now("has turned", move |app| {
        let begun = last.get().expect("where it began");
        assert!(
            (app.eye.yaw - begun.yaw).abs() > 1.0,
            "{:?} after {begun:?}",
            app.eye
        );
    }));
}

fn opens_and_plays(steps: &mut VecDeque<Step>) {
    let mut demo = SAMPLE_DEMO.to_owned();
    if levels::game().is_some() {
        let data = levels::data();
        let pak: PathBuf = data.join("id1/pak0.pak");
        steps.push_back(now("an archive", move |app| app.open_file(&pak)));
        steps.push_back(step(
            "a level of it",
            |app| {
                assert!(app.panels.browser.is_some(), "it is listed");
                app.panels.open = false;
                app.open(Some("lqdm1".into()));
                Vec::new()
            },
            |app| app.is_done() && app.title().contains("lqdm1"),
        ));
        steps.push_back(now("a game", move |app| {
            app.global.basedir = Some(data.clone());
        }));
        demo = "demo1.dem".into();
    }
    steps.push_back(step(
        "a demo",
        move |app| {
            app.open(Some(demo.clone()));
            Vec::new()
        },
        |app| app.player.is_some() && app.is_done(),
    ));
    steps.extend(tap(Key::Enter, |app| {
        app.player.as_ref().is_some_and(|p| p.time > 0.5)
    }));
    steps.extend(tap(Key::Enter, App::is_done));
    steps.extend(tap(Key::ArrowRight, App::is_done));
    steps.push_back(now("has played", |app| {
        let player = app.player.as_ref().expect("a demo");
        assert!(!player.plays && player.time > 5.0, "{}", player.time);
    }));
}

fn keeps_pictures(steps: &mut VecDeque<Step>, folder: &Path) {
    let folder = folder.to_owned();
    steps.push_back(now("a folder", move |app| app.folder.clone_from(&folder)));
    // Of a demo, and of a level.
    for level in [false, true] {
        if level {
            steps.push_back(step(
                "the sample level",
                |app| {
                    app.open(None);
                    Vec::new()
                },
                |app| app.player.is_none() && app.is_done(),
            ));
        }
        steps.push_back(now("nothing is saved yet", |app| app.saved = None));
        steps.extend(tap(Key::P, |app| app.saved.is_some() && app.is_done()));
        steps.push_back(now("is saved", |app| {
            let saved = app.saved.as_ref().expect("files");
            assert_eq!(saved.files.len(), 2);
            assert!(saved.files.iter().all(|f| f.is_file()), "{saved:?}");
        }));
    }
}

fn is_as_large(app: &App, size: [u32; 2]) -> bool {
    let [width, height] = size.map(|n| n as f32);
    (app.egui().viewport_rect().size() - egui::vec2(width, height)).length() < 2.0
}

fn changes_its_size(steps: &mut VecDeque<Step>) {
    for n in 1..=10 {
        let size = [200 + 37 * n, 400 - 23 * n];
        steps.push_back(step(
            "another size",
            move |_| vec![PilotWish::Resize(size)],
            // The window system takes its time, and the picture of the old size is done until then.
            move |app| is_as_large(app, size) && app.is_done(),
        ));
    }
    steps.push_back(now("as large in points, of two pixels each", |app| {
        assert_eq!(app.egui().pixels_per_point(), 2.0);
        assert!(is_as_large(app, [570, 170]));
    }));
}

fn tour() {
    let names: Vec<&str> = CHANGES.iter().map(|change| change.0).collect();
    assert_eq!(names.join(","), SETTINGS, "each setting of the panel");
    let folder = std::env::temp_dir().join(format!("runelight-tour-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut steps = VecDeque::new();
    flies(&mut steps);
    for (name, change) in CHANGES.into_iter().chain(MORE) {
        steps.push_back(now(name, move |app| {
            usual(app);
            change(app);
        }));
    }
    steps.push_back(now("usual", usual));
    opens_and_plays(&mut steps);
    keeps_pictures(&mut steps, &folder);
    changes_its_size(&mut steps);
    let leaves = |_: &mut App| vec![PilotWish::App(Wish::Quit)];
    steps.push_back(step("leaves", leaves, |_| false));
    walk_through(steps);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}

/// Does all that in a window, one after the other; the validation layer has nothing to say.
pub(crate) fn walk_through(mut steps: VecDeque<Step>) {
    let (start, mut under_way, mut since) = (Instant::now(), None::<Step>, 0);
    let pilot = move |app: &mut App, frame: u64| {
        let what = under_way.as_ref().map_or("", |s| &s.what);
        let limit = Duration::from_secs(500);
        assert!(start.elapsed() < limit, "{what} takes too long");
        let errors: Vec<_> = app.notices.all().iter().filter(|n| n.is_error).collect();
        assert!(errors.is_empty(), "{what}: {errors:?}");
        let over = (under_way.as_ref()).is_none_or(|s| frame >= since + s.frames && (s.over)(app));
        let Some(mut next) = over.then(|| steps.pop_front()).flatten() else {
            return Vec::new();
        };
        // Sentences would be in the way of the mouse.
        app.notices.pass(1e3);
        let asked = (next.act)(app);
        (under_way, since) = (Some(next), frame);
        asked
    };
    let (global, render) = options();
    let options = Options {
        validation: true,
        pilot: Some(Box::new(pilot)),
        settings: None,
    };
    let said = window::run(&global, &render, options);
    assert_eq!(said.expect("a window"), [""; 0]);
}
