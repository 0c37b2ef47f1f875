//! What does a frame of the window cost? The window's own frames, drawn off-screen, on levels by file or
//! by name.
//!
//! `cargo bench -p runelight-tests --bench window -- [--device TEXT] [--basedir DIR] [--level LEVEL]...
//! [--size WxH] [--depth N] [--denoise NAME] [--frames N]` prints a Markdown table: one sample per pixel and frame, while the
//! eye rests and while it turns, without panels and with those of the picture and of the statistics. Times of
//! passes are the device's, the median and the 99th of a hundred; `panels` is the processor's for laying
//! them out; a frame is from one to the next, as fast as they go. Of a level that is a demo (`.dem`) it says how
//! long a seek takes: from the wish to the first picture of that moment.

use clap::Parser as _;
use runelight::cli::{Cli, Command};
use runelight::device::Device;
use runelight::view::app::App;
use runelight::view::panels::Panels;
use runelight::view::session::Session;
use runelight_tests::devices::parse_size;
use std::error::Error;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(300);

#[derive(clap::Parser)]
struct Args {
    /// A device, as `runelight devices` lists them.
    #[arg(long, default_value = "auto")]
    device: String,
    /// A Quake directory.
    #[arg(long)]
    basedir: Option<String>,
    /// Levels and demos, by file or by name; the bundled level otherwise.
    #[arg(long)]
    level: Vec<String>,
    /// Picture size.
    #[arg(long, default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Path vertices after the camera.
    #[arg(long, default_value = "3")]
    depth: String,
    /// What becomes of noise, as `runelight render` has it.
    #[arg(long, default_value = "none")]
    denoise: String,
    /// Frames of each case.
    #[arg(long, default_value_t = 300)]
    frames: u32,
    /// Cargo says that this is a benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Milliseconds of some frames.
#[derive(Default)]
struct Times(Vec<f64>);

impl Times {
    /// The median and the 99th of a hundred.
    fn text(mut self) -> String {
        self.0.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * self.0.len() as f64) as usize;
            self.0.get(index.min(self.0.len().saturating_sub(1)))
        };
        match (at(0.5), at(0.99)) {
            (Some(middle), Some(most)) => format!("{middle:.3} ({most:.3})"),
            _ => "-".into(),
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let [width, height] = args.size;
    let bundled = args.level.is_empty().then_some(None);
    let levels = args.level.iter().map(Some).chain(bundled);
    for (i, level) in levels.enumerate() {
        let mut words: Vec<&str> = vec!["runelight", "view", "--device", &args.device];
        words.extend(["--depth", &args.depth, "--spp", "1000000"]);
        words.extend(["--layers", "beauty", "--denoise", &args.denoise]);
        if let Some(dir) = &args.basedir {
            words.extend(["--basedir", dir]);
        }
        words.extend(level.map(String::as_str));
        let cli = Cli::try_parse_from(words)?;
        let Some(Command::View(view)) = cli.command else {
            return Err("view is a command".into());
        };
        let opened = Device::for_window(&cli.global.device, false)?;
        if i == 0 {
            println!("Device: {}, {}", opened.0.name, opened.0.driver);
            println!(
                "Window: {width}x{height}, depth {}, 1 sample per pixel and frame; milliseconds, median \
                 (99 %) of {} frames\n",
                args.depth, args.frames
            );
            println!(
                "| level | eye | panels | path trace | denoise | tone map | overlay | panels, processor | \
                 frame | samples/s |"
            );
            println!("|---|---|---|---|---|---|---|---|---|---|");
        }
        let app = App::new(opened, cli.global, view.render);
        let mut session = Session::new(app, args.size, 1.0)?;
        session.until(LIMIT, |app| app.samples() > 0)?;
        session.app.notices.pass(1e3);
        if session.app.player.is_some() {
            seeks(&mut session, args.frames.min(60))?;
            continue;
        }
        // Whatever a device can do: one sample of every pixel.
        session.app.pace.most_samples = 1;
        for turns in [false, true] {
            for open in [false, true] {
                row(&mut session, args.frames, [turns, open])?;
            }
        }
    }
    Ok(())
}

fn row(session: &mut Session, frames: u32, [turns, open]: [bool; 2]) -> Result<(), Box<dyn Error>> {
    let panels = &mut session.app.panels;
    *panels = Panels::default();
    (panels.hidden, panels.statistics) = (!open, open);
    // The pace must not make the picture smaller.
    panels.budget_ms = 1e5;
    // Panels find their size in their first frames, and the picture its full one.
    session.until(LIMIT, |app| app.samples() > 2)?;
    session.frames(3)?;
    let [mut frame, mut host, mut trace] = [const { Times(Vec::new()) }; 3];
    let mut passes = [const { Times(Vec::new()) }; 3];
    let (start, mut last) = (Instant::now(), Instant::now());
    let mut samples = 0;
    for _ in 0..frames {
        let before = session.app.samples();
        if turns {
            session.app.eye.yaw += 0.25;
        }
        session.frame()?;
        frame.0.push(1e3 * last.elapsed().as_secs_f64());
        last = Instant::now();
        // A picture that begins anew has none of those before.
        let now = session.app.samples();
        let taken = if turns || now < before {
            1
        } else {
            now - before
        };
        samples += taken;
        if taken > 0 {
            trace.0.push(session.app.statistics.sample_ms());
        }
        host.0.push(session.app.statistics.panels_ms());
        let names = ["denoise", "tone map", "overlay"];
        for (name, times) in names.iter().zip(&mut passes) {
            let timed = session.app.statistics.display().iter();
            times
                .0
                .extend(timed.filter(|t| t.name == *name).map(|t| t.milliseconds));
        }
    }
    let speed = f64::from(samples) / start.elapsed().as_secs_f64();
    let [denoise, tone_map, overlay] = passes;
    println!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {speed:.0} |",
        session.app.title(),
        if turns { "turns" } else { "rests" },
        if open { "two" } else { "none" },
        trace.text(),
        denoise.text(),
        tone_map.text(),
        overlay.text(),
        host.text(),
        frame.text(),
    );
    Ok(())
}

/// Frames until the demo's moment is what is shown.
fn until_shown(session: &mut Session) -> Result<f64, Box<dyn Error>> {
    let begin = Instant::now();
    session.until(LIMIT, |app| app.shows_moment() && app.pace.samples() > 0)?;
    Ok(1e3 * begin.elapsed().as_secs_f64())
}

fn seeks(session: &mut Session, count: u32) -> Result<(), Box<dyn Error>> {
    session.app.panels.hidden = true;
    let [mut next, mut far, mut states] = [const { Times(Vec::new()) }; 3];
    let player = |session: &mut Session, time: f64| {
        let player = session.app.player.as_mut().ok_or("there is no demo")?;
        player.seek(time);
        Ok::<f64, Box<dyn Error>>(player.timeline.duration())
    };
    let all = player(session, 0.0)?;
    until_shown(session)?;
    for i in 0..count {
        // Over the whole demo without an order (the golden ratio), and from there on as when it plays.
        let time = all * (f64::from(i + 1) * 0.618_034).fract();
        player(session, time)?;
        far.0.push(until_shown(session)?);
        if let Some(player) = &session.app.player {
            let begin = Instant::now();
            std::hint::black_box(player.state());
            states.0.push(1e3 * begin.elapsed().as_secs_f64());
        }
        for step in 1..=3 {
            player(session, time + f64::from(step) / 60.0)?;
            next.0.push(until_shown(session)?);
        }
    }
    println!(
        "| {} | seeks over {all:.1} s: {} ms; the frames after: {} ms; the state alone: {} ms |",
        session.app.title(),
        far.text(),
        next.text(),
        states.text(),
    );
    Ok(())
}
