//! The viewer, off-screen: the same frames as in the window.

use clap::Parser as _;
use egui::{Key, Pos2};
use mapc::demo::{Client, DemoWriter, Dialect, Entity};
use runelight::cli::{Cli, Command, EstimatorName, Global, LightingName, Lights, Render};
use runelight::denoise::Denoise;
use runelight::device::Device;
use runelight::job::Stopped;
use runelight::tonemap::Tonemap;
use runelight::view::app::{App, Wish};
use runelight::view::dialog::Dialog;
use runelight::view::gamepad::Pad;
use runelight::view::look::defaults;
use runelight::view::session::Session;
use runelight::view::stage::SAMPLE_DEMO;
use runelight_tests::levels;
use std::path::Path;
use std::time::{Duration, Instant};

/// Nothing takes so long, on whatever busy machine.
pub(crate) const LIMIT: Duration = Duration::from_secs(300);
pub(crate) const SIZE: [u32; 2] = [120, 80];

/// The options of `runelight view` with these arguments.
fn options(args: &[&str]) -> (Global, Render) {
    let device = std::env::var("RUNELIGHT_TEST_DEVICE").unwrap_or_else(|_| "llvmpipe".into());
    let words = ["runelight", "view", "--device", &device].into_iter();
    let cli = Cli::try_parse_from(words.chain(args.iter().copied())).expect("options");
    match cli.command {
        Some(Command::View(view)) => (cli.global, view.render),
        other => panic!("{other:?}"),
    }
}

/// A viewer that has opened its level.
pub(crate) fn session(args: &[&str]) -> Session {
    opened(args, true)
}

/// The same with the validation layer or without it.
pub fn opened(args: &[&str], validation: bool) -> Session {
    let (global, render) = options(args);
    let device = Device::for_window(&global.device, validation).unwrap_or_else(|e| {
        panic!("{e:#}: `cargo xtask test` installs or names what Vulkan tests need")
    });
    let app = App::new(device, global, render);
    let mut session = Session::new(app, SIZE, 1.0).expect("a screen");
    session.app.panels.hidden = true;
    (session.until(LIMIT, |app| app.samples() > 0)).expect("a first sample");
    // In so small a window sentences about the level are in the way of the mouse.
    session.app.notices.pass(1e3);
    session
}

#[track_caller]
pub(crate) fn assert_silent(session: &Session) {
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
    let said: Vec<_> = session
        .app
        .notices
        .all()
        .iter()
        .filter(|n| n.is_error)
        .collect();
    assert!(said.is_empty(), "{said:?}");
}

pub(crate) fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut all: Vec<_> = entries
        .map(|e| {
            let bytes = std::fs::read(e.path()).expect("a file");
            (e.file_name().to_string_lossy().into_owned(), bytes)
        })
        .collect();
    all.sort();
    all
}

/// What stands still is what `render` makes, and what is saved can be made again, bit for bit: after
/// moving, at another size, with other settings, in parts of samples.
#[test]
fn a_saved_picture_is_made_again_by_its_command() {
    let mut session = session(&["--spp", "3", "--depth", "3"]);
    let folder = std::env::temp_dir().join(format!("runelight-viewer-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    session.app.folder.clone_from(&folder);
    session.key(Key::W, true);
    session.frames(8).expect("frames");
    session.key(Key::W, false);
    session
        .drag(Pos2::new(60.0, 40.0), Pos2::new(90.0, 35.0))
        .expect("a drag");
    session.resize([97, 61]).expect("a size");
    session.app.args.picture.exposure = 0.5;
    session.app.args.picture.scene.threshold = 0.35;
    session.app.args.picture.clamp = Some(20.0);
    session.frames(2).expect("frames");
    // Slower than any device: every sample is taken in parts.
    session.app.panels.budget_ms = 0.01;
    session.until(LIMIT, App::is_done).expect("a picture");
    session.tap(Key::P).expect("frames");
    session
        .until(LIMIT, |app| app.saved.is_some())
        .expect("files");
    session.frame().expect("a frame");
    let saved = session.app.saved.clone().expect("files");
    assert_eq!(session.clipboard(), saved.command);
    assert_silent(&session);
    drop(session);

    let before = files(&folder);
    assert_eq!(before.len(), 2, "an EXR and a PNG");
    for file in &saved.files {
        std::fs::remove_file(file).expect("a file to remove");
    }
    let mut words = words(&saved.command);
    words.push("--quiet".into());
    let cli = Cli::try_parse_from(&words).unwrap_or_else(|e| panic!("{}: {e}", saved.command));
    runelight::cmd::run(&cli, Instant::now()).expect("a picture");
    let after = files(&folder);
    for ((name, a), (other, b)) in before.iter().zip(&after) {
        assert!(name == other && a == b, "{name} differs: {}", saved.command);
    }
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}

/// So is a moment of a demo, from the player's eye and beside it; dropped on the window its files bring it back, with
/// all that was set. The frames of films do, too.
#[test]
fn a_moment_of_a_demo_is_made_again_by_its_command() {
    let folder = std::env::temp_dir().join(format!("runelight-moment-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut session = session(&["--spp", "2", "--depth", "3", SAMPLE_DEMO]);
    session.app.folder.clone_from(&folder);
    session.app.args.picture.layers = runelight::view::look::layers(true);
    session.app.args.picture.scene.threshold = 0.35;
    // Of a level's time and skill a demo knows nothing.
    session.app.args.picture.scene.at = 2.0;
    let mut taken = Vec::new();
    for follows in [true, false] {
        let player = session.app.player.as_mut().expect("a demo");
        player.seek(2.0 + 1.0 / 3.0);
        player.follows = follows;
        if !follows {
            session.app.eye.position += glam::Vec3::new(-20.0, 8.0, 30.0);
            session.app.args.picture.view.fov = Some(80.0);
        }
        session.until(LIMIT, App::is_done).expect("a picture");
        session.app.saved = None;
        session.tap(Key::P).expect("frames");
        let is_saved = |app: &App| app.saved.is_some();
        session.until(LIMIT, is_saved).expect("files");
        session.frame().expect("a frame");
        let saved = session.app.saved.clone().expect("files");
        assert_eq!(session.clipboard(), saved.command);
        session.app.notices.pass(1e3);
        session.frames(2).expect("frames");
        let time = session.app.player.as_ref().expect("a demo").time;
        let picture = session.picture().expect("a frame");
        taken.push((saved, time, follows, session.app.eye, picture));
    }
    let before = files(&folder);
    assert_eq!(before.len(), 4, "EXRs and PNGs");
    for (saved, ..) in &taken {
        for file in &saved.files {
            std::fs::remove_file(file).expect("a file to remove");
        }
        let mut words = words(&saved.command);
        words.push("--quiet".into());
        let cli = Cli::try_parse_from(&words).unwrap_or_else(|e| panic!("{}: {e}", saved.command));
        runelight::cmd::run(&cli, Instant::now()).expect("a picture");
    }
    for ((name, a), (other, b)) in before.iter().zip(&files(&folder)) {
        assert!(name == other && a == b, "{name} differs: {:?}", taken[0].0);
    }

    // In another demo's place, in none, and in the same.
    session.app.open(None);
    let ended = |app: &App| app.player.is_none() && app.is_done();
    session.until(LIMIT, ended).expect("a level");
    for (i, file) in [(1, 0), (0, 1), (1, 1)] {
        let (saved, time, follows, eye, picture) = &taken[i];
        session.app.args.picture = defaults().picture;
        session.app.open_file(&saved.files[file]);
        let there = |app: &App| app.player.is_some() && app.is_done();
        session.until(LIMIT, there).expect("a picture");
        let player = session.app.player.as_ref().expect("a demo");
        assert_eq!((player.time, player.follows), (*time, *follows));
        assert_eq!(session.app.eye, *eye);
        session.app.notices.pass(1e3);
        session.frames(2).expect("frames");
        assert!(session.picture().expect("a frame") == *picture, "{saved:?}");
    }
    assert_silent(&session);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}

/// Hands move the eye, settings change the picture, nothing is said by the validation layer.
#[test]
fn one_flies_and_changes_every_setting() {
    // While sprites turn to an eye that rests, a sentence says so, and is in the way of the mouse.
    let mut session = session(&["--spp", "2", "--depth", "2", "--no-entities"]);
    let start = session.app.eye;
    for key in [Key::W, Key::A, Key::Space] {
        let before = session.app.eye.position;
        session.key(key, true);
        session.frames(3).expect("frames");
        session.key(key, false);
        session.frames(12).expect("frames");
        assert!(
            (session.app.eye.position - before).length() > 5.0,
            "{key:?}"
        );
    }
    session
        .drag(Pos2::new(60.0, 40.0), Pos2::new(20.0, 40.0))
        .expect("a drag");
    assert!(
        session.app.eye.yaw > start.yaw + 2.0,
        "the drag turns the view"
    );
    // Sticks do the same as keys and a mouse.
    let before = session.app.eye;
    session.app.gamepad.hold(Pad {
        left: [0.0, -1.0],
        right: [-1.0, 0.0],
        triggers: [0.0; 2],
    });
    session.frames(3).expect("frames");
    session.app.gamepad.hold(Pad::default());
    session.frames(12).expect("frames");
    assert!((session.app.eye.position - before.position).length() > 5.0);
    assert!(session.app.eye.yaw != before.yaw);
    session.tap(Key::N).expect("frames");
    session.app.go_to_camera(0);
    assert_eq!(session.app.eye.position, start.position);
    session.tap(Key::V).expect("frames");
    assert!(session.app.is_walking());
    session.frames(40).expect("frames");
    let fallen = session.app.eye.position - start.position;
    assert!(
        fallen.length() < 30.0,
        "stands where players start: {fallen}"
    );
    session.tap(Key::V).expect("frames");

    type Change = fn(&mut Session);
    let changes: &[(&str, Change, bool)] = &[
        ("exposure", |s| s.app.args.picture.exposure = 2.0, false),
        (
            "tone curve",
            |s| s.app.args.picture.tonemap = Tonemap::Clip,
            false,
        ),
        (
            "denoiser",
            |s| s.app.args.picture.denoise = Denoise::Svgf,
            false,
        ),
        (
            "no denoiser",
            |s| s.app.args.picture.denoise = Denoise::None,
            false,
        ),
        (
            "field of view",
            |s| s.app.args.picture.view.fov = Some(60.0),
            true,
        ),
        ("depth", |s| s.app.args.picture.depth = 3, true),
        (
            "estimator",
            |s| s.app.args.picture.estimator = EstimatorName::Nee,
            true,
        ),
        ("seed", |s| s.app.args.picture.seed = 7, true),
        ("clamp", |s| s.app.args.picture.clamp = Some(0.05), true),
        (
            "layers",
            |s| s.app.args.picture.layers = runelight::view::look::layers(false),
            true,
        ),
        ("size", |s| s.app.panels.percent = 50, true),
        (
            "threshold",
            |s| s.app.args.picture.scene.threshold = 0.1,
            true,
        ),
        (
            "emission",
            |s| s.app.args.picture.scene.emission_scale = 8.0,
            true,
        ),
        (
            "lamps",
            |s| s.app.args.picture.scene.lights = Lights::Textures,
            true,
        ),
        (
            "lighting",
            |s| s.app.args.picture.lighting = LightingName::Fullbright,
            true,
        ),
        ("panels", |s| s.app.panels.hidden = false, false),
    ];
    session.until(LIMIT, App::is_done).expect("a picture");
    for (name, change, restarts) in changes {
        let before = session.picture().expect("a frame");
        change(&mut session);
        session.frame().expect("a frame");
        assert_eq!(session.app.is_done(), !restarts, "{name}");
        session.until(LIMIT, App::is_done).expect("a picture");
        session.frame().expect("a frame");
        let after = session.picture().expect("a frame");
        let changes = *name != "layers";
        assert_eq!(before != after, changes, "{name} changes the picture");
    }
    assert_silent(&session);

    // Ten sizes, one of them none at all.
    for size in [
        [64, 48],
        [200, 30],
        [1, 1],
        [33, 90],
        [0, 0],
        [80, 80],
        [7, 5],
        [150, 100],
        [99, 98],
        SIZE,
    ] {
        session.resize(size).expect("a size");
        session.frames(3).expect("frames");
    }
    session.until(LIMIT, App::is_done).expect("a picture");
    let before = session.picture().expect("a frame");
    assert_eq!(before.0, SIZE);
    // Moved to a display with more pixels to a point, and back: panels are twice as large, the picture is not another
    // one.
    let samples = session.app.samples();
    for (scale, same) in [(2.0, false), (1.0, true)] {
        session.rescale(scale);
        session.frames(3).expect("frames");
        assert_eq!(session.app.egui().pixels_per_point(), scale);
        assert_eq!(session.app.samples(), samples, "nothing is traced anew");
        assert_eq!(session.picture().expect("a frame") == before, same);
    }
    assert_silent(&session);
}

/// A demo plays, is sought, and shows the same moment the same way whatever was shown before.
fn plays_a_demo(session: &mut Session) {
    session.app.panels.hidden = true;
    session.app.args.picture.spp = 2;
    session.app.open(Some("demo1.dem".into()));
    session.until(LIMIT, App::is_done).expect("a picture");
    let start = session.app.eye;
    let seek = |session: &mut Session, time: f64| {
        session.app.player.as_mut().expect("a demo").seek(time);
        session.until(LIMIT, App::is_done).expect("a picture");
        session.frame().expect("a frame");
        let film = session.app.film().expect("a device").expect("a film");
        (session.app.eye, film.beauty)
    };
    let first = seek(session, 4.0);
    assert!(first.0 != start, "the player has moved");
    session.tap(Key::Enter).expect("frames");
    session.frames(10).expect("frames");
    let player = session.app.player.as_ref().expect("a demo");
    assert!(
        player.plays && player.time > 4.2 && player.time < 4.6,
        "{}",
        player.time
    );
    session.tap(Key::Enter).expect("frames");
    session.tap(Key::ArrowRight).expect("frames");
    assert!(session.app.player.as_ref().expect("a demo").time > 9.0);
    assert!(
        seek(session, 4.0) == first,
        "the same moment, the same picture"
    );
    // Backwards into the beginning, where it stops.
    let player = session.app.player.as_mut().expect("a demo");
    (player.time, player.speed, player.plays) = (0.1, -2.0, true);
    session.frames(10).expect("frames");
    let player = session.app.player.as_ref().expect("a demo");
    assert!(player.time == 0.0 && !player.plays);
    // Whoever moves leaves the player's eye.
    session.key(Key::W, true);
    session.frames(3).expect("frames");
    session.key(Key::W, false);
    assert!(!session.app.player.as_ref().expect("a demo").follows);
    session.until(LIMIT, App::is_done).expect("a picture");
    // A level by itself ends the demo.
    session.app.open(None);
    session.until(LIMIT, App::is_done).expect("a picture");
    assert!(session.app.player.is_none());
}

/// Words of a command in which only what stands in quotes has blanks.
pub(crate) fn words(command: &str) -> Vec<String> {
    let (mut words, mut inside) = (vec![String::new()], false);
    for c in command.chars() {
        match c {
            '\'' => inside = !inside,
            ' ' if !inside => words.push(String::new()),
            c => words.last_mut().expect("a word").push(c),
        }
    }
    words
}

/// A picture that is dropped on the window is shown as it was made; a camera path is recorded, flown and kept.
#[test]
fn a_picture_is_restored_and_a_path_is_flown() {
    let mut session = session(&["--spp", "2", "--depth", "1", "--no-entities"]);
    let folder = std::env::temp_dir().join(format!("runelight-restore-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    session.app.folder.clone_from(&folder);
    session.app.go_to_camera(1);
    session.app.args.picture.scene.threshold = 0.4;
    session.app.args.picture.view.fov = Some(70.0);
    session.until(LIMIT, App::is_done).expect("a picture");
    let there = (session.app.eye, session.picture().expect("a frame"));
    session.tap(Key::P).expect("frames");
    (session.until(LIMIT, |app| app.saved.is_some())).expect("files");
    session.app.notices.pass(1e3);
    let saved = session.app.saved.clone().expect("files");

    session.app.go_to_camera(0);
    session.app.args.picture = defaults().picture;
    session.app.args.picture.spp = 1;
    session.until(LIMIT, App::is_done).expect("a picture");
    session.app.open_file(&saved.files[0]);
    assert_eq!(session.app.eye, there.0);
    session.until(LIMIT, App::is_done).expect("a picture");
    assert_eq!(session.app.args.picture.scene.threshold, 0.4);
    session.app.notices.pass(1e3);
    session.frames(2).expect("frames");
    assert!(
        session.picture().expect("a frame") == there.1,
        "the same picture"
    );
    let none = folder.join("none.exr");
    std::fs::write(&none, "no picture").expect("a file");
    session.app.open_file(&none);
    assert!(session.app.notices.all().iter().any(|n| n.is_error));
    session.app.notices.pass(1e3);

    session.app.add_key();
    let first = session.app.eye;
    session.app.go_to_camera(0);
    session.frame().expect("a frame");
    session.app.add_key();
    let file = session.app.path_file();
    session.app.flight_path.save(&file).expect("a file");
    session.app.flight_path.clear();
    session.app.flight_path.load(&file).expect("a path");
    session.app.fly_path(true);
    session.frame().expect("a frame");
    let begun = (session.app.eye.position - first.position).length();
    session.frames(70).expect("frames");
    let last = session.app.flight_path.keys()[1].position;
    assert!(begun < 60.0, "it begins at the first key: {begun}");
    assert_eq!(session.app.eye.position, last);
    assert!(!session.app.flight_path.flies, "it ends");
    // Whoever moves takes over.
    session.app.fly_path(true);
    session.key(Key::S, true);
    session.frames(2).expect("frames");
    session.key(Key::S, false);
    assert!(!session.app.flight_path.flies);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
    assert_silent(&session);
}

/// A picture that is taken on a flight, of a level or of a demo that plays, is of one place on it: its command makes it
/// again.
#[test]
fn a_picture_of_a_flight_is_made_again_by_its_command() {
    let folder = std::env::temp_dir().join(format!("runelight-flight-{}", std::process::id()));
    for level in [&[][..], &[SAMPLE_DEMO]] {
        std::fs::create_dir_all(&folder).expect("a folder");
        let args = ["--spp", "2", "--depth", "2", "--no-entities"];
        let args: Vec<&str> = args.iter().chain(level).copied().collect();
        let mut session = session(&args);
        session.app.folder.clone_from(&folder);
        // Finished with the frame that asks for it: so it is taken while the eye moves.
        session.app.panels.budget_ms = 1e5;
        if let Some(player) = &mut session.app.player {
            player.follows = false;
        }
        // The second key is of another lens and looks elsewhere.
        for (time, fov, aperture) in [(0.0, 70.0, 0.5), (4.0, 100.0, 2.0)] {
            let view = &mut session.app.args.picture.view;
            (view.fov, view.aperture) = (Some(fov), Some(aperture));
            view.focus = Some(100.0 + fov);
            session.app.go_to_camera(if time == 0.0 { 0 } else { 1 });
            session.frame().expect("a frame");
            session.app.put_key(time);
        }
        session.app.fly_path(true);
        if let Some(player) = &mut session.app.player {
            player.seek(0.0);
            player.plays = true;
        }
        session.frames(40).expect("frames");
        session.tap(Key::P).expect("frames");
        let is_saved = |app: &App| app.saved.is_some();
        session.until(LIMIT, is_saved).expect("files");
        assert!(session.app.flight_path.flies, "it is taken on the way");
        let saved = session.app.saved.clone().expect("files");
        assert_silent(&session);
        drop(session);
        let made = files(&folder);
        assert_eq!(made.len(), 2, "an EXR and a PNG");
        std::fs::remove_dir_all(&folder).expect("a folder to remove");
        std::fs::create_dir_all(&folder).expect("a folder");
        let mut words = words(&saved.command);
        words.push("--quiet".into());
        let cli = Cli::try_parse_from(&words).unwrap_or_else(|e| panic!("{}: {e}", saved.command));
        runelight::cmd::run(&cli, Instant::now()).expect("a picture");
        for ((name, a), (other, b)) in made.iter().zip(&files(&folder)) {
            assert!(name == other && a == b, "{name} differs: {}", saved.command);
        }
        std::fs::remove_dir_all(&folder).expect("a folder to remove");
    }
}

/// The picture is done where it is good enough, or after its time.
#[test]
fn a_picture_is_done_when_that_is_asked_for() {
    let mut session = session(&["--depth", "1", "--no-entities", "--target-error", "10"]);
    session.until(LIMIT, App::is_done).expect("a picture");
    assert_eq!(session.app.stopped(), Some(Stopped::TargetError));
    assert_eq!(session.app.samples(), 16, "as `render` looks first");
    let curve = session.app.convergence.points();
    let samples: Vec<u32> = curve.iter().map(|p| p.samples).collect();
    assert_eq!(samples, [2, 3, 5, 8, 12, 16]);
    assert!(curve.last().is_some_and(|p| p.error <= 10.0));
    let picture = &mut session.app.args.picture;
    (picture.target_error, picture.time_limit) = (None, Some(0.1));
    session.until(LIMIT, App::is_done).expect("a picture");
    assert_eq!(session.app.stopped(), Some(Stopped::Deadline));
    assert_silent(&session);
}

/// The marked part of a demo becomes files beside the window: those that `runelight demo` makes by the
/// command that is shown. One that is ended leaves no files, and says so.
#[test]
fn a_film_of_what_is_marked_is_what_demo_makes() {
    let mut session = session(&["--spp", "1", "--depth", "2", SAMPLE_DEMO]);
    let name = format!("runelight-film-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    session.app.global.device = "cpu".into();
    let player = session.app.player.as_mut().expect("a demo");
    assert!(!player.events.is_empty(), "it tells where its level begins");
    player.seek(1.0);
    session.tap(Key::I).expect("frames");
    session.app.player.as_mut().expect("a demo").seek(1.2);
    session.tap(Key::O).expect("frames");
    let marked = session.app.player.as_ref().expect("a demo").marked;
    assert_eq!(marked, Some([1.0, 1.2]));
    let export = &mut session.app.export;
    (export.size, export.spp, export.fps) = ([24, 16], 2, "10".into());
    export.output = folder.join("%03d.png").display().to_string();
    export.shutter = 0.5;
    let options = session.app.film_options().expect("options");
    assert_eq!(session.app.film_frames(&options), 2);
    session.app.export_film();
    let command = session.app.export.command().expect("a film").to_owned();
    let ended = |app: &App| app.export.under_way().is_none();
    session.until(LIMIT, ended).expect("a film");
    assert_eq!(
        session.app.export.told.as_ref().map(Result::is_ok),
        Some(true)
    );
    let made = files(&folder);
    assert_eq!(made.len(), 2, "{command}");
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
    let mut again = words(&command);
    again.push("--quiet".into());
    let cli = Cli::try_parse_from(&again).unwrap_or_else(|e| panic!("{command}: {e}"));
    runelight::cmd::run(&cli, Instant::now()).expect("a film");
    assert!(made == files(&folder), "the same files by {command}");
    std::fs::remove_dir_all(&folder).expect("a folder to remove");

    // An eye beside the player goes along, also where time jumps.
    let player = session.app.player.as_mut().expect("a demo");
    (player.follows, player.along) = (false, true);
    session.app.eye.position += glam::Vec3::Z * 50.0;
    session.frame().expect("a frame");
    for time in [3.0, 0.5] {
        session.app.player.as_mut().expect("a demo").seek(time);
        session.frame().expect("a frame");
        let player = session.app.player.as_ref().expect("a demo");
        let there = player.state().expect("a moment").view.eye + glam::Vec3::Z * 50.0;
        assert!(
            session.app.eye.position.distance(there) < 0.1,
            "at {time} s"
        );
    }

    // Longer than anybody waits, and ended.
    session.app.player.as_mut().expect("a demo").marked = None;
    session.app.export.spp = 1 << 20;
    session.app.export_film();
    session.frames(3).expect("frames");
    session.app.export.cancel();
    session.until(LIMIT, ended).expect("an end");
    let told = session.app.export.told.clone();
    assert!(told.is_some_and(|t| t.is_err_and(|why| why.contains("interrupted"))));
    assert_eq!(files(&folder), []);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
}

/// A level that can't be read leaves the picture; a good one replaces it; keys reach the window.
#[test]
fn levels_are_opened_and_broken_ones_keep_the_picture() {
    let mut session = session(&["--spp", "1", "--depth", "1", "--no-entities"]);
    session.until(LIMIT, App::is_done).expect("a picture");
    let title = session.app.title();
    session.app.open(Some("no-such-level".into()));
    session.until(LIMIT, App::is_done).expect("the old picture");
    assert_eq!(session.app.title(), title);
    let said = session
        .app
        .notices
        .all()
        .last()
        .expect("a sentence")
        .clone();
    assert!(
        said.is_error && said.text.contains("no-such-level"),
        "{said:?}"
    );
    session.app.open_file(Path::new("picture.jpg"));
    assert!(
        session
            .app
            .notices
            .all()
            .iter()
            .any(|n| n.text.contains(".jpg"))
    );

    // What is chosen in the system's dialog is opened; where there is none, files are listed.
    let wrong = async { Some("no-such-level.bsp".into()) };
    session.app.dialog = Some(Dialog::of(wrong));
    session.app.notices.pass(1e3);
    session.frame().expect("a frame");
    session.until(LIMIT, App::is_done).expect("the old picture");
    let said = session.app.notices.all().last().expect("a sentence");
    assert!(said.text.contains("no-such-level.bsp"), "{said:?}");
    session.app.dialog = Some(Dialog::of(async { None }));
    session.frame().expect("a frame");
    let panels = &mut session.app.panels;
    assert!(panels.open && panels.lists_files && session.app.dialog.is_none());
    (panels.open, panels.lists_files) = (false, false);

    // The same level again keeps the eye.
    session.app.go_to_camera(1);
    let eye = session.app.eye;
    session.tap(Key::F5).expect("frames");
    session.until(LIMIT, App::is_done).expect("a picture");
    assert_eq!(session.app.eye, eye);

    if levels::game().is_some() {
        session.app.open_file(&levels::data().join("id1/pak0.pak"));
        session.app.panels.hidden = false;
        session.frame().expect("a frame");
        let names = session
            .app
            .panels
            .browser
            .clone()
            .expect("a list of levels");
        assert!(names.iter().any(|n| n == "lqdm1"), "{names:?}");
        let titled = |app: &App| !app.titles.of("lqdm1").is_empty();
        session.until(LIMIT, titled).expect("titles");
        session.app.open(Some("lqdm1".into()));
        session.until(LIMIT, App::is_done).expect("a picture");
        assert!(session.app.title().contains("lqdm1"));
        assert!((session.app.title()).starts_with(session.app.titles.of("lqdm1")));
    }
    if levels::game().is_some() {
        let folder = levels::data();
        session.app.global.basedir = Some(folder);
        plays_a_demo(&mut session);
    }
    session.tap(Key::F11).expect("frames");
    session.tap(Key::M).expect("frames");
    session.tap(Key::Escape).expect("frames");
    let expected = [
        Wish::FullScreen(true),
        Wish::HoldMouse(true),
        Wish::HoldMouse(false),
    ];
    assert_eq!(session.wishes(), expected);
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
}

/// A room whose walls are two pictures in turn, with a window to the sky, and a demo of somebody who looks up
/// to it. Half way the server makes it red.
fn write_game(folder: &Path) {
    let mut map = mapc::Map::new();
    for (name, colour) in [("+0wall", 100), ("+1wall", 40)] {
        map.texture(mapc::Texture::solid(name, 64, 64, colour));
    }
    map.texture(mapc::Texture::solid("sky1", 256, 128, 80));
    map.room([0.0; 3], [256.0; 3], 16.0, "+0wall");
    map.brush_box([20.0, 20.0, 16.0], [40.0; 3], "+1wall");
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], "sky1");
    map.entity("info_player_start", &[("origin", "128 128 32")]);
    let level = mapc::compile(&map, &mapc::Options::default()).expect("a level");
    let base = folder.join("id1");
    for folder in ["maps", "gfx/env"] {
        std::fs::create_dir_all(base.join(folder)).expect("a folder");
    }
    std::fs::write(base.join("maps/window.bsp"), level.bytes).expect("a level");
    for side in ["rt", "bk", "lf", "ft", "up", "dn"] {
        let mut tga = vec![0; 18];
        (tga[2], tga[12], tga[14], tga[16]) = (2, 1, 1, 24);
        tga.extend([0, 0, 255]);
        std::fs::write(base.join(format!("gfx/env/red{side}.tga")), tga).expect("a side");
    }
    let mut w = DemoWriter::new(Dialect::QUAKE, -1);
    w.server_info("window", 1, &["maps/window.bsp"], &[]);
    w.set_view(1).signon(1).signon(3);
    w.end_block([0.0; 3]);
    for i in 0..9_u8 {
        let me = Entity {
            origin: [128.0, 128.0, 40.0],
            ..Entity::default()
        };
        w.frame(10.0 + f32::from(i) / 10.0, &[(1, me)]);
        w.client(&Client::default());
        if i == 4 {
            w.skybox("red");
        }
        w.end_block([-90.0, 0.0, 0.0]);
    }
    w.disconnect();
    w.end_block([0.0; 3]);
    std::fs::write(base.join("window.dem"), w.finish()).expect("a demo");
}

/// The sky that a demo's server asks for is there whichever way one comes to its time, played or sought; what is asked
/// of a point is of the time that is shown.
#[test]
fn a_demo_has_the_sky_of_its_time_and_a_level_the_texture() {
    let folder = std::env::temp_dir().join(format!("runelight-sky-{}", std::process::id()));
    write_game(&folder);
    let base = folder.display().to_string();
    let mut session = session(&["--spp", "1", "--depth", "1", "--basedir", &base, "window"]);
    let mut albedos = Vec::new();
    for at in [0.0, 0.2, 0.4] {
        session.app.args.picture.scene.at = at;
        session.until(LIMIT, App::is_done).expect("a picture");
        session.app.inspect([0.5, 0.5]);
        (session.until(LIMIT, |app| !app.is_inspecting())).expect("an answer");
        let report = session.app.inspected.as_ref().expect("a wall");
        albedos.push(report.seen.albedo);
    }
    assert!(
        albedos[0] != albedos[1] && albedos[0] == albedos[2],
        "{albedos:?}"
    );

    session.app.args.picture.scene.at = 0.0;
    session.app.open(Some("window.dem".into()));
    let opened = |app: &App| app.player.is_some() && app.is_done();
    session.until(LIMIT, opened).expect("a picture");
    let is_red = |session: &mut Session| {
        session.until(LIMIT, App::is_done).expect("a picture");
        let film = session.app.film().expect("a device").expect("a film");
        let [red, green, blue] = film.beauty[(film.width * film.height + film.width) as usize / 2];
        assert!(red > 0.0);
        green == 0.0 && blue == 0.0
    };
    assert!(!is_red(&mut session));
    for (time, red) in [(0.6, true), (0.2, false), (0.7, true), (0.0, false)] {
        session.app.player.as_mut().expect("a demo").seek(time);
        session.frame().expect("a frame");
        assert_eq!(is_red(&mut session), red, "at {time} s");
    }
    session.app.player.as_mut().expect("a demo").plays = true;
    session.frame().expect("a frame");
    assert!(is_red(&mut session), "played to its end");
    // Another scene of the same moment keeps it.
    session.app.args.picture.scene.threshold = 0.3;
    session.frame().expect("a frame");
    assert!(is_red(&mut session));
    assert_silent(&session);
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}

/// Whoever closes the window while a level is on its way leaves nothing on the device: its driver is unloaded when
/// the program ends, whatever threads still do.
#[test]
fn a_viewer_that_ends_while_it_loads_leaves_nothing_behind() {
    for milliseconds in [0, 40, 120, 300] {
        let (global, render) = options(&["--spp", "1"]);
        let (device, gpu) = Device::for_window(&global.device, true).expect("a device");
        let app = App::new((device, gpu.clone()), global, render);
        std::thread::sleep(Duration::from_millis(milliseconds));
        drop(app);
        assert_eq!(gpu.allocated_bytes(), 0, "after {milliseconds} ms");
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(gpu.allocated_bytes(), 0, "and later");
        assert_eq!(gpu.validation_messages(), [""; 0]);
    }
}
