//! The window itself, on a display that nobody sees.

use clap::Parser as _;
use runelight::cli::{Cli, Command as RunelightCommand, Global, Render};
use runelight::view::app::{App, Wish};
use runelight::view::preferences::Preferences;
use runelight::view::window::{self, Options, PilotWish};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Set in the process that opens the window.
const INSIDE: &str = "RUNELIGHT_TEST_WINDOW";

/// Ends a process when it is no longer needed.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display of its own: Xvfb chooses a number that is free, and says it.
fn display() -> (Ends, String) {
    use std::io::{BufRead as _, BufReader};
    let started = Command::new("Xvfb")
        .args([
            "-displayfd",
            "1",
            "-screen",
            "0",
            "1280x960x24",
            "-nolisten",
            "tcp",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut server = started.unwrap_or_else(|e| {
        panic!("Xvfb: {e}: `cargo xtask test` installs or names what the tests need")
    });
    let out = server.stdout.take().expect("what it says");
    let server = Ends(server);
    let mut line = String::new();
    BufReader::new(out)
        .read_line(&mut line)
        .expect("its number");
    (server, format!(":{}", line.trim()))
}

/// Runs `inside` of a test of this name in a process of its own, on a display of its own that has so many pixels to a
/// point, or as many as it says itself: the environment names it, and a process opens windows once.
pub(crate) fn on_a_display(test: &str, inside: fn(), scale: &str) {
    if std::env::var_os(INSIDE).is_some() {
        inside();
        return println!("the window has ended");
    }
    let (_server, display) = display();
    let this = std::env::current_exe().expect("this program");
    let output = Command::new(this)
        .args(["--exact", test, "--nocapture"])
        .env(INSIDE, "1")
        .env("DISPLAY", display)
        .env("WINIT_X11_SCALE_FACTOR", scale)
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("this program");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(
        output.status.success() && said.contains("the window has ended"),
        "{said}"
    );
}

/// The options of `runelight view` on the sample level.
pub(crate) fn options() -> (Global, Render) {
    let device = std::env::var("RUNELIGHT_TEST_DEVICE").unwrap_or_else(|_| "llvmpipe".into());
    let words = "runelight view --spp 1 --depth 2 --device";
    let words = words.split(' ').chain([device.as_str()]);
    let cli = Cli::try_parse_from(words).expect("options");
    match cli.command {
        Some(RunelightCommand::View(view)) => (cli.global, view.render),
        other => panic!("{other:?}"),
    }
}

/// The window opens on the sample level, is flown, is resized ten times, loses its device, and ends, while the validation
/// layer has nothing to say.
#[test]
fn the_window_lives_on_a_display() {
    on_a_display("window::the_window_lives_on_a_display", lives, "1");
}

/// Where the device has no memory for the picture, settings and place are kept, and the same place is shown by a
/// picture of half the size; if that can't be had either, the window ends and says why.
#[test]
fn the_window_goes_on_with_less_memory() {
    on_a_display("window::the_window_goes_on_with_less_memory", goes_on, "1");
}

fn goes_on() {
    let (global, render) = options();
    let start = Instant::now();
    let (mut eye, mut times) = (None, 0);
    let pilot = move |app: &mut App, frame: u64| {
        assert!(
            start.elapsed() < Duration::from_secs(240),
            "the window takes too long"
        );
        if frame == 0 && times == 0 {
            app.panels.percent = 20;
        }
        if !app.is_done() {
            return Vec::new();
        }
        match eye {
            None => app.go_to_camera(1),
            Some(eye) => {
                assert_eq!((app.eye, app.panels.percent), (eye, 10));
                let said = app.notices.all().iter().any(|n| {
                    n.text.contains("could not allocate") && n.text.contains("are kept in")
                });
                assert!(said, "{:?}", app.notices.all());
            }
        }
        eye = Some(app.eye);
        times += 1;
        // Not a byte more: a larger picture does not fit.
        app.gpu.limit_bytes(app.gpu.allocated_bytes());
        vec![PilotWish::Resize([300 + 80 * times, 200 + 60 * times])]
    };
    let folder = std::env::temp_dir().join(format!("runelight-window-{}", std::process::id()));
    let file = folder.join("window.toml");
    let options = Options {
        validation: true,
        pilot: Some(Box::new(pilot)),
        settings: Some(file.clone()),
    };
    let error = window::run(&global, &render, options).expect_err("no memory");
    let error = format!("{error:#}");
    for part in ["could not allocate", "did not help", "window.toml"] {
        assert!(error.contains(part), "{error}");
    }
    let kept = Preferences::read(&file).expect("settings");
    assert_eq!(kept.places.values().map(Vec::len).sum::<usize>(), 1);
    assert_eq!(kept.panels, Some(vec!["picture".to_owned()]));
    std::fs::remove_dir_all(&folder).expect("a folder to remove");
}

fn lives() {
    let (global, render) = options();
    let start = Instant::now();
    let (mut resized, mut at, mut done, mut lost) = (0, 0, false, None);
    let pilot = move |app: &mut App, frame: u64| {
        assert!(
            start.elapsed() < Duration::from_secs(240),
            "the window takes too long"
        );
        app.panels.percent = 10;
        if app.samples() == 0 {
            return Vec::new();
        }
        if resized < 10 && frame >= at {
            resized += 1;
            at = frame + 3;
            app.eye = app.eye.turned([20.0, 0.0]);
            return vec![PilotWish::Resize([200 + 37 * resized, 400 - 23 * resized])];
        }
        if resized == 10 && app.is_done() && lost.is_none() {
            app.panels.budget_ms = 20.0;
            lost = Some((app.eye, app.panels.budget_ms));
            return vec![PilotWish::LoseDevice];
        }
        if let Some((eye, budget_ms)) = lost
            && app.is_done()
            && !done
        {
            // It is opened anew, on the same place, and says so.
            assert_eq!((app.eye, app.panels.budget_ms), (eye, budget_ms));
            let said = app
                .notices
                .all()
                .iter()
                .any(|n| n.text.contains("opened anew"));
            assert!(said, "{:?}", app.notices.all());
            done = true;
            return vec![PilotWish::App(Wish::Quit)];
        }
        Vec::new()
    };
    let options = Options {
        validation: true,
        pilot: Some(Box::new(pilot)),
        settings: None,
    };
    let said = window::run(&global, &render, options);
    assert_eq!(said.expect("a window"), [""; 0]);
}
