//! What the window shows besides the picture: layers, splits, what is at a pixel.

use crate::viewer::{LIMIT, SIZE, assert_silent, session};
use egui::Rect;
use runelight::output::Layer;
use runelight::view::app::App;
use runelight::view::looking::{Legend, Shown, Zoom};
use runelight::view::session::Session;
use std::path::Path;

fn rest(session: &mut Session) {
    let done = |app: &App| app.is_done() && !app.looking.is_busy();
    session.until(LIMIT, done).expect("a picture");
    // What came with this frame is shown in the next, and drawn in the one after.
    session.frames(3).expect("frames");
}

fn pixels(session: &mut Session) -> Vec<[u8; 3]> {
    session.picture().expect("a frame").1
}

/// Every layer is shown, and looking at it changes nothing about the picture.
#[test]
fn layers_are_shown_and_leave_the_picture_alone() {
    let mut session = session(&["--spp", "2", "--depth", "2", "--no-entities"]);
    rest(&mut session);
    let args = session.app.args.clone();
    let plain = pixels(&mut session);
    for (shown, name, _) in Shown::ALL {
        session.app.looking.shown = shown;
        session.frames(3).expect("frames");
        rest(&mut session);
        assert_eq!(session.app.samples(), 2, "{name} takes no samples anew");
        let seen = pixels(&mut session);
        match (shown, session.app.looking.legend()) {
            (Shown::Picture, None) => assert!(seen == plain),
            (Shown::Style, Some(Legend::Nothing(_))) => {}
            (_, None | Some(Legend::Nothing(_))) => panic!("{name}: nothing to see"),
            (_, Some(legend)) => {
                assert!(seen != plain, "{name} is something else");
                if let Legend::Numbers(count) = legend {
                    assert!(*count > 1 || shown == Shown::Entities, "{name}: {count}");
                }
            }
        }
    }
    assert!(
        session.app.args == args,
        "looking is no part of the picture"
    );
    // A style by itself is, because it is traced by itself.
    session.app.args.picture.layers.0.push(Layer::Style);
    session.app.looking.shown = Shown::Style;
    rest(&mut session);
    assert_eq!(session.app.looking.legend(), Some(&Legend::Colours));

    session.app.looking.shown = Shown::Depth;
    rest(&mut session);
    let found = session.app.looking.legend().cloned();
    let Some(Legend::Range([low, high], "units")) = found else {
        panic!("{found:?}")
    };
    assert!(0.0 < low && low < high && high < 10_000.0, "{low} {high}");
    session.app.looking.range = Some([low, low + 1.0]);
    let before = pixels(&mut session);
    session.frames(3).expect("frames");
    assert!(pixels(&mut session) != before, "the range is another one");
    assert_silent(&session);
}

/// A split shows what was kept on its left, pixels can be looked at from near, and files compared with.
#[test]
fn pictures_are_compared_and_looked_at_from_near() {
    let mut session = session(&["--spp", "1", "--depth", "2", "--no-entities"]);
    rest(&mut session);
    let a = pixels(&mut session);
    session.app.keep("A".into()).expect("a picture");
    session.app.args.picture.lighting = runelight::cli::LightingName::Fullbright;
    session.frame().expect("a frame");
    rest(&mut session);
    let both = pixels(&mut session);
    // The handle is in the middle, and moves the border without turning the eye.
    let eye = session.app.eye;
    let [from, to] = [60.0, 90.0].map(|x| egui::pos2(x, 40.0));
    session.drag(from, to).expect("a drag");
    assert!(
        (session.app.looking.split - 0.75).abs() < 0.02,
        "{}",
        session.app.looking.split
    );
    assert_eq!(session.app.eye, eye);
    session.app.looking.kept = None;
    session.frames(2).expect("frames");
    let b = pixels(&mut session);
    let [width, height] = SIZE;
    // Far from the border and its handle; the two tone mappings are one code apart at most.
    let near = |a: [u8; 3], b: [u8; 3]| (0..3).all(|c| a[c].abs_diff(b[c]) <= 1);
    let differ = |x: std::ops::Range<u32>, whole: &[[u8; 3]]| {
        let at = |x, y| (y * width + x) as usize;
        (0..height)
            .flat_map(|y| x.clone().map(move |x| at(x, y)))
            .filter(|&i| !near(both[i], whole[i]))
            .count()
    };
    assert_eq!(differ(0..width / 2 - 8, &a), 0, "left is what was kept");
    assert_eq!(differ(width / 2 + 8..width, &b), 0, "right is what is now");
    assert!(differ(0..width / 2 - 8, &b) > 100, "and they differ");

    // Sixteen times as near a pixel is a square of that size.
    session
        .app
        .looking
        .zoom
        .approach(16.0, egui::vec2(0.5, 0.5));
    session.frames(2).expect("frames");
    let seen = pixels(&mut session);
    let window = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width as f32, height as f32));
    for (x, y) in [(5, 7), (60, 40), (100, 70)] {
        let at = egui::pos2(x as f32 + 0.5, y as f32 + 0.5);
        let zoom: Zoom = session.app.looking.zoom;
        let [i, j] = zoom.pixel(at, window, SIZE).expect("in the picture");
        assert_eq!(
            seen[(y * width + x) as usize],
            b[(j * width + i) as usize],
            "{x} {y}"
        );
    }
    session.app.looking.zoom = Zoom::default();

    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/sample_cpu.exr");
    session.app.looking.open(file);
    rest(&mut session);
    let kept = session.app.looking.kept.as_ref().expect("the file");
    assert!(
        kept.film.width > 0
            && kept.film.beauty.len() == (kept.film.width * kept.film.height) as usize
    );
    session.app.looking.open("no-such-file.exr".into());
    rest(&mut session);
    let said = session
        .app
        .notices
        .all()
        .iter()
        .any(|n| n.is_error && n.text.contains("no-such-file"));
    assert!(
        said && session.app.looking.kept.is_some(),
        "what was there stays"
    );
}

/// A click says what is there and where its light comes from; entities are found and flown to.
#[test]
fn clicks_are_answered_and_entities_flown_to() {
    let mut session = session(&["--spp", "1", "--depth", "1", "--no-entities"]);
    rest(&mut session);
    // The panel would lie over all of so small a window.
    session.app.inspect([0.5, 0.5]);
    (session.until(LIMIT, |app| !app.is_inspecting())).expect("an answer");
    let report = session
        .app
        .inspected
        .clone()
        .expect("something in the middle");
    let film = session.app.film().expect("a device").expect("a film");
    let middle = (SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize;
    assert_eq!(
        film.id[middle],
        report.seen.face + 1,
        "the face that the renderer saw"
    );
    let depth = f64::from(film.depth[middle]);
    assert!(
        (report.seen.distance / depth - 1.0).abs() < 0.02,
        "{depth} for {report:?}"
    );
    assert!(!report.texture.is_empty() && report.pictures[0].is_some());
    assert!(report.leaf.is_some() && report.contents == "air");
    let (number, keys) = report.entity.expect("an entity");
    assert!(
        keys.iter().any(|(key, _)| key == "classname"),
        "{number}: {keys:?}"
    );
    assert!(
        report.total[0] > 0.0 && report.total[1] < 0.2 * report.total[0],
        "{:?}",
        report.total
    );
    let shares: Vec<f64> = report.lights.iter().map(|l| l.share[0]).collect();
    assert!(shares.windows(2).all(|p| p[0] >= p[1]), "{shares:?}");
    let sum: f64 = shares.iter().sum();
    assert!(sum > 0.5 && sum < 1.0 + 1e-9, "{sum}");
    // Every panel is drawn, whatever the size of the window.
    session.app.panels.hidden = false;
    let panels = &mut session.app.panels;
    (panels.looking, panels.inspector) = (true, true);
    (panels.entities, panels.styles, panels.entity) = (true, true, "light".into());
    session.frames(4).expect("frames");

    // A click makes sharp what is there.
    session.app.panels.hidden = true;
    let view = &mut session.app.args.picture.view;
    (view.aperture, view.focus) = (Some(1.0), Some(1.0));
    rest(&mut session);
    session.app.focus_by_click = true;
    let middle = egui::pos2(SIZE[0] as f32 / 2.0, SIZE[1] as f32 / 2.0);
    session.drag(middle, middle).expect("a click");
    (session.until(LIMIT, |app| !app.is_inspecting())).expect("an answer");
    let view = &mut session.app.args.picture.view;
    let focus = view.focus.expect("a focus");
    assert!((focus / depth - 1.0).abs() < 0.02, "{focus} for {depth}");
    (view.aperture, view.focus) = (None, None);

    // Flown to in parts; whoever moves stops it.
    let before = session.app.eye;
    session.app.go_to_entity(1);
    assert_eq!(session.app.eye, before);
    session.frame().expect("a frame");
    let first = session.app.eye.position.distance(before.position);
    rest(&mut session);
    let there = session.app.eye;
    let far = there.position.distance(before.position);
    assert!(first > 0.0 && first < 0.05 * far, "{first} of {far}");
    session.app.go_to(before);
    session.app.go_to_entity(1);
    session.frames(5).expect("frames");
    session.key(egui::Key::S, true);
    session.frames(2).expect("frames");
    session.key(egui::Key::S, false);
    rest(&mut session);
    let stopped = session.app.eye.position.distance(there.position);
    assert!(stopped > 0.2 * far, "{stopped} from there");
    assert_silent(&session);
}

/// Light styles are set by hand, and the picture is the one that the command line makes of it.
#[test]
fn light_styles_are_set_and_said() {
    let mut session = session(&[
        "--spp",
        "1",
        "--depth",
        "2",
        "--no-entities",
        "--lights",
        "entities",
    ]);
    rest(&mut session);
    let before = session.app.film().expect("a device").expect("a film");
    // Steady lamps, doubled.
    let usual = 264.0 / 256.0;
    session.app.args.picture.scene.styles = vec![(0, 2.0 * usual)];
    session.frame().expect("a frame");
    rest(&mut session);
    let after = session.app.film().expect("a device").expect("a film");
    let sum = |film: &scene::render::Film| film.direct.iter().map(|p| f64::from(p[1])).sum::<f64>();
    let lamps = session.app.film().expect("a device").is_some();
    assert!(
        lamps && sum(&after) > 1.2 * sum(&before),
        "{} after {}",
        sum(&after),
        sum(&before)
    );
    let line = runelight::view::look::command_line(&session.app.args, &session.app.global);
    assert!(line.contains("--light-style 0=2.0625"), "{line}");
    session.app.args.picture.scene.styles.clear();
    session.frame().expect("a frame");
    rest(&mut session);
    let again = session.app.film().expect("a device").expect("a film");
    assert!(again.beauty == before.beauty, "as the level has it");
    assert_silent(&session);
}
