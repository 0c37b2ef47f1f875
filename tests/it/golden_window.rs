//! Pictures of the whole window that must not change unnoticed, as `golden.rs` has them of the film.

use crate::viewer::opened;
use egui::ThemePreference;
use runelight::output::{PartFile, write_rgb8};
use runelight::view::app::App;
use runelight::view::panels::Panels;
use runelight::view::session::Session;
use runelight::view::stage::SAMPLE_DEMO;
use runelight::{metrics, picture};
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);
const SIZE: [u32; 2] = [800, 500];
/// Largest mean FLIP error that passes, as of the film: a panel that is another one gives more.
const MAX_FLIP: f64 = 0.01;

/// Waits until nothing moves, and compares the window with its golden picture.
fn check(session: &mut Session, name: &str, panels: impl FnOnce(&mut Panels)) {
    session.app.panels = Panels::none();
    session.app.panels.percent = 25;
    panels(&mut session.app.panels);
    session.app.notices.pass(1e3);
    // A panel finds its size in its first frame, and its place in the second.
    session.frames(6).expect("frames");
    session.until(LIMIT, App::is_done).expect("a picture");
    session.frames(4).expect("frames");
    let (size, pixels) = session.picture().expect("a frame");

    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    let golden = folder.join(format!("{name}.png"));
    let write = |path: &Path| {
        let mut file = PartFile::create(path).expect("a writable folder");
        write_rgb8(file.file(), pixels.as_flattened(), size[0], size[1]).expect("a picture");
        file.commit().expect("a file");
    };
    let update = std::env::var("UPDATE_GOLDEN").unwrap_or_default();
    if update == name || update == "all" {
        return write(&golden);
    }
    let failed = folder.join(format!("{name}.failed.png"));
    write(&failed);
    let read =
        |path: &Path| picture::read(path, picture::BEAUTY).unwrap_or_else(|e| panic!("{e:#}"));
    let (found, _) =
        metrics::compare(&read(&golden), &read(&failed)).expect("pictures of one size");
    assert!(
        found.flip <= MAX_FLIP,
        "{name}: FLIP {}; see {} and `runelight compare --heatmap`; UPDATE_GOLDEN={name} accepts it",
        found.flip,
        failed.display(),
    );
    std::fs::remove_file(&failed).expect("a file just written");
}

#[test]
fn the_window_looks_as_it_did() {
    let args = [
        "--spp",
        "4",
        "--depth",
        "2",
        "--exposure",
        "1",
        "--no-entities",
    ];
    let mut session = opened(&args, true);
    session.resize(SIZE).expect("a size");
    session.app.egui().set_theme(ThemePreference::Dark);
    check(&mut session, "window_dark", |p| {
        (p.render, p.places) = (true, true);
    });
    session.app.egui().set_theme(ThemePreference::Light);
    session.app.egui().set_zoom_factor(1.25);
    check(&mut session, "window_light", |p| p.keys = true);
    session.app.egui().set_theme(ThemePreference::Dark);
    session.app.egui().set_zoom_factor(1.0);
    session.app.open(Some(SAMPLE_DEMO.into()));
    let there = |app: &App| app.player.is_some() && app.is_done();
    session.until(LIMIT, there).expect("a demo");
    let player = session.app.player.as_mut().expect("a demo");
    player.seek(4.0);
    player.mark(2.5, 5.5);
    check(&mut session, "window_demo", |p| p.export = true);
    assert_eq!(session.app.gpu.validation_messages(), [""; 0]);
}
