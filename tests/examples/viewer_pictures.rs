//! Makes the pictures of docs/viewer.md, on the bundled level: `viewer_pictures FOLDER [DEVICE [SAMPLES
//! [NAME]...]]`, all, or those of the film and of plain panels that are named.

use clap::Parser as _;
use runelight::cli::{Cli, Command};
use runelight::denoise::Denoise;
use runelight::device::Device;
use runelight::output::PartFile;
use runelight::view::app::App;
use runelight::view::looking::Shown;
use runelight::view::panels::Panels;
use runelight::view::session::Session;
use runelight::view::stage::SAMPLE_DEMO;
use std::error::Error;
use std::path::Path;
use std::time::Duration;

const SIZE: [u32; 2] = [880, 560];
/// Of half as many pixels across and down: enough to see what it is.
const SAMPLES: &str = "6";
const LIMIT: Duration = Duration::from_secs(900);

/// Opens one panel.
type Opens = fn(&mut Panels);

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().ok_or("where to?")?;
    let device = args.next().unwrap_or_else(|| "auto".into());
    let samples = args.next().unwrap_or_else(|| SAMPLES.into());
    let wanted: Vec<String> = args.collect();
    let words = [
        "runelight",
        "view",
        "--spp",
        &samples,
        "--exposure",
        "1.5",
        "--device",
        &device,
    ];
    let cli = Cli::try_parse_from(words)?;
    let Some(Command::View(view)) = cli.command else {
        return Err("view is a command".into());
    };
    let opened = Device::for_window(&cli.global.device, false)?;
    let app = App::new(opened, cli.global, view.render);
    let mut session = Session::new(app, SIZE, 1.0)?;
    session.app.panels.percent = 50;
    session.until(LIMIT, |app| app.samples() > 0)?;
    session.app.notices.pass(1e3);
    let panels: [(&str, Opens); 7] = [
        ("picture", |p| p.render = true),
        ("statistics", |p| p.statistics = true),
        ("places", |p| p.places = true),
        ("path", |p| p.path = true),
        ("open", |p| p.open = true),
        ("window", |p| p.window = true),
        ("keys", |p| p.keys = true),
    ];
    for index in [1, 0] {
        session.app.go_to_camera(index);
        session.frame()?;
        session.app.add_key();
    }
    let wants = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    for (name, open) in panels {
        if wants(name) {
            shoot(&mut session, Path::new(&folder), name, open)?;
        }
    }
    if wants("denoiser") {
        session.app.args.picture.denoise = Denoise::Svgf;
        shoot(&mut session, Path::new(&folder), "denoiser", |p| {
            p.render = true;
        })?;
        session.app.args.picture.denoise = Denoise::None;
    }
    if wanted.is_empty() {
        looking(&mut session, Path::new(&folder))?;
    }
    if !wants("film") {
        return Ok(());
    }
    session.app.open(Some(SAMPLE_DEMO.into()));
    session.until(LIMIT, |app| app.player.is_some() && app.is_done())?;
    if let Some(player) = &mut session.app.player {
        player.seek(4.0);
        player.mark(2.5, 5.5);
    }
    session.app.notices.pass(1e3);
    shoot(&mut session, Path::new(&folder), "film", |p| {
        p.export = true
    })
}

/// The panels that look at the picture.
fn looking(session: &mut Session, folder: &Path) -> Result<(), Box<dyn Error>> {
    session.app.looking.shown = Shown::Depth;
    // Over the pillar, so that the panel has values to show.
    session.event(egui::Event::PointerMoved(egui::pos2(285.0, 200.0)));
    shoot(session, folder, "look", |p| p.looking = true)?;
    session.app.looking.shown = Shown::Picture;
    let samples = std::mem::replace(&mut session.app.args.picture.spp, 1);
    // Samples begin anew with another seed.
    session.app.args.picture.seed += 1;
    session.frame()?;
    session.until(LIMIT, App::is_done)?;
    session.app.keep("A, 1 sample".into())?;
    session.app.args.picture.spp = samples;
    shoot(session, folder, "split", |p| p.looking = true)?;
    session.app.looking.kept = None;
    session.app.args.picture.seed -= 1;
    session.frame()?;
    session.until(LIMIT, App::is_done)?;
    session.event(egui::Event::PointerGone);
    session.app.inspect([0.58, 0.193]);
    session.until(LIMIT, |app| !app.is_inspecting())?;
    shoot(session, folder, "inspector", |p| p.inspector = true)?;
    shoot(session, folder, "entities", |p| {
        (p.entities, p.entity) = (true, "light".into());
    })?;
    session.app.args.picture.scene.styles = vec![(0, 0.5)];
    shoot(session, folder, "styles", |p| p.styles = true)?;
    session.app.args.picture.scene.styles.clear();
    Ok(())
}

/// The window with one panel as a picture.
fn shoot(
    session: &mut Session,
    folder: &Path,
    name: &str,
    open: Opens,
) -> Result<(), Box<dyn Error>> {
    session.app.panels = Panels::none();
    session.app.panels.percent = 50;
    open(&mut session.app.panels);
    // A panel finds its size in its first frame, and its place in the second.
    session.frames(6)?;
    session.until(LIMIT, |app| app.is_done() && !app.looking.is_busy())?;
    session.frames(2)?;
    let (size, pixels) = session.picture()?;
    let path = folder.join(format!("{name}.png"));
    let mut file = PartFile::create(&path)?;
    runelight::output::write_rgb8(file.file(), pixels.as_flattened(), size[0], size[1])?;
    file.commit()?;
    println!("{}", path.display());
    Ok(())
}
