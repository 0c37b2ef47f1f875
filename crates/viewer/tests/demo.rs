//! `runelight demo`: frames that are the same however they come about, and what is refused.

use mapc::demo::{Client, DemoWriter, Dialect, Entity};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Frames of the demos below at [`FPS`].
const FRAMES: u32 = 12;
const FPS: &str = "10";

/// 1.2 seconds in the sample level: the player walks, is hurt, and particles fly.
fn write_demo(path: &Path, maps: &[&str]) {
    let mut w = DemoWriter::new(
        Dialect {
            protocol: 666,
            ..Dialect::QUAKE
        },
        -1,
    );
    for map in maps {
        w.server_info("sample", 1, &[map, "progs/player.mdl"], &[]);
        w.set_view(1).signon(1).signon(3);
        w.end_block([0.0; 3]);
        for i in 0..13_u8 {
            let along = 40.0 + 8.0 * f32::from(i);
            let me = Entity {
                model: 2,
                origin: [along, -56.0, 24.0],
                ..Entity::default()
            };
            w.frame(10.0 + f32::from(i) / 10.0, &[(1, me)]);
            w.client(&Client {
                velocity: [5, 0, 0],
                ..Client::default()
            });
            if i == 3 {
                w.damage(0, 60, [0.0; 3]);
                w.particles([along + 80.0, -56.0, 60.0], [0; 3], 40, 73);
            }
            w.end_block([0.0, 6.0 + f32::from(i), 0.0]);
        }
    }
    w.disconnect();
    w.end_block([0.0; 3]);
    std::fs::write(path, w.finish()).unwrap();
}

/// A directory with the demo `a.dem`.
fn directory() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_demo(&dir.path().join("a.dem"), &["maps/sample.bsp"]);
    dir
}

/// The program on the processor, with tiny frames.
fn demo(dir: &Path, args: &[&str]) -> Command {
    demo_at(FPS, dir, args)
}

fn demo_at(fps: &str, dir: &Path, args: &[&str]) -> Command {
    demo_with("2", fps, dir, args)
}

fn demo_with(spp: &str, fps: &str, dir: &Path, args: &[&str]) -> Command {
    const TINY: [&str; 6] = ["--size", "24x14", "--device", "cpu", "--depth", "3"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_runelight"));
    command
        .args(["demo", "a.dem"])
        .args(TINY)
        .args(["--spp", spp, "--fps", fps])
        .args(args)
        .current_dir(dir)
        .env_remove("RUNELIGHT_BASEDIR");
    command
}

fn run(dir: &Path, args: &[&str]) -> (i32, Vec<u8>, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = demo(dir, args).output().unwrap();
    let stderr = String::from_utf8(stderr).unwrap();
    (status.code().unwrap_or(-1), stdout, stderr)
}

fn succeeds(dir: &Path, args: &[&str]) -> Vec<u8> {
    let (code, out, err) = run(dir, args);
    assert_eq!(code, 0, "{err}");
    out
}

/// All files of a directory; none if there is no such directory.
fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().map(|entry| {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        (name, std::fs::read(path).unwrap())
    });
    entries.collect()
}

const BOTH: [&str; 6] = ["-o", "f/%03d.exr", "-o", "f/%03d.png", "--shutter", "0.5"];

#[test]
fn a_frame_is_the_same_alone_and_among_others() {
    let dir = directory();
    let out = succeeds(dir.path(), &[&BOTH[..], &["--json"]].concat());
    let all = files(&dir.path().join("f"));
    assert_eq!(all.len(), 2 * FRAMES as usize);
    let lines: Vec<Value> = (std::str::from_utf8(&out).unwrap().lines())
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), FRAMES as usize + 1);
    for (n, line) in lines[..FRAMES as usize].iter().enumerate() {
        assert_eq!(
            (line["frame"].as_u64(), line["spp"].as_u64()),
            (Some(n as u64), Some(2))
        );
        assert_eq!(line["time"].as_f64(), Some(n as f64 / 10.0));
        assert_eq!(line["outputs"][1], format!("f/{n:03}.png"));
    }
    assert_ne!(lines[0]["seed"], lines[1]["seed"]);
    let summary = &lines[FRAMES as usize];
    assert_eq!(
        (&summary["frames"], &summary["stopped"]),
        (&12.into(), &"complete".into())
    );
    let shares = summary["shares"].as_object().unwrap();
    let sum: f64 = ["prepare", "render", "wait"]
        .iter()
        .map(|k| shares[*k].as_f64().unwrap())
        .sum();
    assert!((0.5..=1.01).contains(&sum), "{summary}");

    for frame in ["7", "3..5"] {
        let args = [
            "-o",
            "g/%03d.exr",
            "-o",
            "g/%03d.png",
            "--shutter",
            "0.5",
            "--frames",
            frame,
        ];
        succeeds(dir.path(), &args);
    }
    let alone = files(&dir.path().join("g"));
    assert_eq!(alone.len(), 6);
    for (name, bytes) in alone {
        assert!(all[&name] == bytes, "{name}");
    }
    // The player moves, and what the shutter sees is another light.
    assert!(all["003.exr"] != all["004.exr"]);
    succeeds(dir.path(), &["-o", "h.exr", "--frames", "7"]);
    assert!(std::fs::read(dir.path().join("h.exr")).unwrap() != all["007.exr"]);
}

/// Killed at ten moments all over its run, each time with other frames missing, and gone on with.
#[cfg(unix)]
#[test]
fn killed_runs_are_gone_on_with_bit_for_bit() {
    let dir = directory();
    let more = ["--seed", "3"];
    let begin = Instant::now();
    succeeds(dir.path(), &[&BOTH[..], &more].concat());
    let whole = begin.elapsed();
    let undisturbed = files(&dir.path().join("f"));
    std::fs::rename(dir.path().join("f"), dir.path().join("undisturbed")).unwrap();

    let resume = [&BOTH[..], &more, &["--resume"]].concat();
    let (mut killed, mut partial) = (0, 0);
    for i in 0..10_u32 {
        // The golden ratio's multiples: evenly spread over the run, in no order.
        let share = (f64::from(i) * 0.618_033_988_749_895).fract();
        let mut child = demo(dir.path(), &resume)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(whole.mul_f64(share).max(Duration::from_millis(5)));
        killed += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        // What is there is whole.
        let there = files(&dir.path().join("f"));
        let named: Vec<_> = there
            .iter()
            .filter(|(name, _)| !name.starts_with('.'))
            .collect();
        partial += u32::from(!named.is_empty() && named.len() < undisturbed.len());
        for (name, bytes) in named {
            assert!(undisturbed[name] == *bytes, "{name} after kill {i}");
        }
        // Begin anew with another part missing, so that later kills still find work.
        for (n, name) in undisturbed.keys().enumerate() {
            if n as u32 % 10 == i || (n as u32 + i).is_multiple_of(3) {
                let _ = std::fs::remove_file(dir.path().join("f").join(name));
            }
        }
    }
    // What a run leaves that is killed while it makes a file of a frame anew that has both.
    for name in ["000.exr", "000.png"] {
        let from = dir.path().join("undisturbed").join(name);
        std::fs::copy(from, dir.path().join("f").join(name)).unwrap();
    }
    std::fs::write(dir.path().join("f/.000.png.1.part"), "half").unwrap();
    succeeds(dir.path(), &resume);
    let resumed = files(&dir.path().join("f"));
    assert!(resumed == undisturbed, "{:?}", resumed.keys());
    assert!(
        killed >= 5 && partial >= 1,
        "{killed} killed, {partial} in the midst"
    );
}

#[test]
fn frames_of_other_settings_are_not_gone_on_with() {
    let dir = directory();
    let part = ["-o", "f/%d.png", "--frames", "2..4"];
    succeeds(dir.path(), &part);
    let before = files(&dir.path().join("f"));
    let refused = |more: &[&str]| {
        let args = [&["-o", "f/%d.png", "--resume"], more].concat();
        let (code, _, err) = run(dir.path(), &args);
        assert_eq!(code, 1, "{err}");
        assert!(
            err.contains("f/2.png was made with other settings"),
            "{err}"
        );
        assert!(files(&dir.path().join("f")) == before);
        err
    };
    let err = refused(&["--seed", "9"]);
    assert!(err.contains("seed: 0 there, 9 asked for"), "{err}");
    let err = refused(&["--shutter", "0.5"]);
    assert!(err.contains("shutter: 0.0 there, 0.5 asked for"), "{err}");
    write_demo(&dir.path().join("b.dem"), &["maps/sample.bsp"; 2]);
    let first = std::fs::read(dir.path().join("a.dem")).unwrap();
    std::fs::rename(dir.path().join("b.dem"), dir.path().join("a.dem")).unwrap();
    assert!(refused(&[]).contains("demo: "));
    std::fs::write(dir.path().join("a.dem"), first).unwrap();
    // A file of another kind is kept, too.
    std::fs::write(dir.path().join("f/5.png"), "mine").unwrap();
    let (code, _, err) = run(dir.path(), &["-o", "f/%d.png", "--resume"]);
    assert!(code == 1 && err.contains("f/5.png is there"), "{err}");
    std::fs::remove_file(dir.path().join("f/5.png")).unwrap();
    // More frames of the same; a limit of time is none of the settings.
    let out = succeeds(
        dir.path(),
        &[
            "-o",
            "f/%d.png",
            "--resume",
            "--json",
            "--time-limit",
            "1000",
        ],
    );
    let last = std::str::from_utf8(&out)
        .unwrap()
        .lines()
        .last()
        .unwrap()
        .to_owned();
    let summary: Value = serde_json::from_str(&last).unwrap();
    assert_eq!(summary["frames_resumed"], 2);
    assert_eq!(summary["frames"], FRAMES - 2);
}

#[test]
fn video_is_a_stream_of_frames_as_pngs_have_them() {
    let dir = directory();
    let out = succeeds(
        dir.path(),
        &["-o", "-", "-o", "a.y4m", "-o", "%d.png", "--to", "0.3"],
    );
    assert!(std::fs::read(dir.path().join("a.y4m")).unwrap() == out);
    let header = b"YUV4MPEG2 W24 H14 F10:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    assert!(out.starts_with(header));
    let frames = &out[header.len()..];
    let plane = 24 * 14;
    assert_eq!(frames.len(), 3 * (6 + 3 * plane));
    let png = runelight::picture::read(&dir.path().join("1.png"), "beauty").unwrap();
    let codes = png.codes.unwrap();
    let second = &frames[6 + 3 * plane..];
    assert!(second.starts_with(b"FRAME\n"));
    for (y, [r, g, b]) in second[6..6 + plane].iter().zip(codes) {
        let luma = 16.0 + 219.0 * (0.2126 * r + 0.7152 * g + 0.0722 * b);
        assert!((f32::from(*y) - luma).abs() <= 0.51);
    }
}

#[test]
fn tints_are_on_displays_and_not_in_the_light() {
    let dir = directory();
    // The player is hurt in the message of 0.3 s, which pictures show from 0.2 s on.
    let hurt = ["-o", "f.exr", "-o", "f.png", "--frames", "3", "--from", "0"];
    succeeds(dir.path(), &hurt);
    let plain = ["-o", "g.exr", "-o", "g.png", "--frames", "3", "--no-tint"];
    succeeds(dir.path(), &plain);
    let read = |name: &str| {
        let picture = runelight::picture::read(&dir.path().join(name), "beauty").unwrap();
        picture.radiance
    };
    assert_eq!(read("f.exr"), read("g.exr"));
    let red = |pixels: &[[f32; 3]]| pixels.iter().map(|p| f64::from(p[0] - p[2])).sum::<f64>();
    let (tinted, plain) = (read("f.png"), read("g.png"));
    assert!(red(&tinted) > red(&plain) + 0.02 * plain.len() as f64);
    // A camera of its own has no such screen.
    let free = ["--frames", "3", "--camera", "40 -56 46 0 6 0"];
    succeeds(dir.path(), &[&["-o", "h.png"], &free[..]].concat());
    succeeds(
        dir.path(),
        &[&["-o", "i.png", "--no-tint"], &free[..]].concat(),
    );
    assert_eq!(read("h.png"), read("i.png"));
}

#[test]
fn a_demo_of_several_levels_is_one_film() {
    let dir = directory();
    let path = dir.path().join("a.dem");
    write_demo(&path, &["maps/sample.bsp"; 2]);
    let out = succeeds(dir.path(), &["-o", "f/%d.exr", "--json"]);
    let lines = std::str::from_utf8(&out).unwrap().lines().count() as u32;
    let made = files(&dir.path().join("f")).len() as u32;
    assert_eq!(made + 1, lines);
    // The second level goes on where the first one ends.
    assert!((2 * FRAMES..=2 * FRAMES + 1).contains(&made), "{made}");

    write_demo(&path, &["maps/sample.bsp", "maps/absent.bsp"]);
    let (code, _, err) = run(dir.path(), &["-o", "g/%d.exr"]);
    assert!(
        code == 1 && err.contains("plays in maps/absent.bsp"),
        "{err}"
    );
    assert!(files(&dir.path().join("g")).is_empty());
    // What does not need it is made.
    succeeds(dir.path(), &["-o", "g/%d.exr", "--to", "0.5"]);
}

#[test]
fn wrong_usage_is_told() {
    let dir = directory();
    for (args, told) in [
        (&["-o", "f.exr"][..], "several frames"),
        (&["-o", "%s.exr"], "one %d"),
        (&["-o", "%d.jpg"], ".y4m"),
        (&["-o", "a.y4m", "--resume"], "--resume"),
        (&["-o", "%d.exr", "--at", "1"], "--at"),
        (&["-o", "%d.exr", "--skill", "2"], "--skill"),
        (
            &["-o", "%d.exr", "--frames", "1..3", "--to", "3"],
            "--frames",
        ),
        (&["-o", "%d.exr", "--shutter", "2"], "--shutter"),
        (&["-o", "%d.exr", "-o", "%d.exr"], "twice"),
    ] {
        let (code, _, err) = run(dir.path(), args);
        assert!(code == 2 && err.contains(told), "{code}: {err}");
    }
    let (code, _, err) = run(dir.path(), &["-o", "%d.exr", "--frames", "500"]);
    assert!(code == 1 && err.contains("no such frames"), "{err}");
    assert_eq!(files(dir.path()).len(), 1, "nothing is left");
}

#[cfg(unix)]
#[test]
fn an_interruption_leaves_whole_frames() {
    use std::io::{BufRead as _, BufReader};
    let dir = directory();
    // So many frames that there is time.
    let mut child = demo_at("1000", dir.path(), &["-o", "f/%d.exr", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.next().unwrap().unwrap();
    let pid = child.id().to_string();
    let signal = Command::new("kill").args(["-INT", &pid]).status();
    assert!(signal.unwrap().success());
    let rest: Vec<String> = lines.map(Result::unwrap).collect();
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(err.contains("--resume makes the rest"), "{err}");
    let summary: Value = serde_json::from_str(rest.last().unwrap()).unwrap();
    assert_eq!(summary["stopped"], "interrupted");
    let made = files(&dir.path().join("f"));
    assert_eq!(summary["frames"], made.len());
    assert!(
        made.keys()
            .all(|name| name.ends_with(".exr") && !name.starts_with('.'))
    );
}

#[test]
fn a_camera_flies_by_the_seconds_of_the_demo() {
    let dir = directory();
    let path = "[[key]]\ntime = 0.2\nposition = [40, -56, 46]\nangles = [0, 6, 0]\n\
        [[key]]\ntime = 0.6\nposition = [80, -56, 46]\nangles = [0, 6, 0]\n";
    std::fs::write(dir.path().join("a.toml"), path).unwrap();
    let at = |args: &[&str]| {
        succeeds(
            dir.path(),
            &[&["-o", "f.exr", "--frames", "4"], args].concat(),
        );
        runelight::picture::read(&dir.path().join("f.exr"), "beauty")
            .unwrap()
            .radiance
    };
    let flying = at(&["--camera-path", "a.toml"]);
    // Half way between two keys: the ends of a flight are straight.
    assert_eq!(flying, at(&["--camera", "60 -56 46 0 6 0"]));
    let blurred = at(&[
        "--camera-path",
        "a.toml",
        "--aperture",
        "2",
        "--focus",
        "50",
    ]);
    assert_ne!(flying, blurred);
    let (code, _, err) = run(
        dir.path(),
        &["-o", "f.exr", "--frames", "4", "--aperture", "2"],
    );
    assert!(code == 2 && err.contains("--focus"), "{err}");
}

#[test]
fn the_motion_layer_leads_to_the_frame_before() {
    let dir = directory();
    let layers = ["--layers", "motion", "--shutter", "0.5"];
    succeeds(
        dir.path(),
        &[&["-o", "m/%03d.exr", "--frames", "0..6"], &layers[..]].concat(),
    );
    let motion = |frame: &str| {
        let path = dir.path().join("m").join(frame);
        runelight::picture::read(&path, "motion").unwrap().radiance
    };
    // Nothing was before the first frame; afterwards the player walks and turns.
    assert!(motion("000.exr").iter().all(|m| m[..2] == [0.0; 2]));
    let turned = motion("005.exr");
    let moved = turned.iter().filter(|m| m[0].hypot(m[1]) > 0.05).count();
    assert!(
        moved > turned.len() / 2,
        "{moved} pixels of {}",
        turned.len()
    );
    assert!(
        turned
            .iter()
            .all(|m| m[0].abs() < 24.0 && m[1].abs() < 14.0)
    );
}

/// What a shutter that is open from frame to frame sees is the mean of 256 frames in that time.
#[test]
fn motion_blur_is_the_mean_of_the_moments_between() {
    type Pixels = Vec<[f32; 3]>;
    const PARTS: u32 = 256;
    let dir = directory();
    let picture = |name: &str| -> [Pixels; 2] {
        ["beauty", "variance"].map(|layer| {
            let picture = runelight::picture::read(&dir.path().join(name), layer).unwrap();
            picture.radiance
        })
    };
    let make = |spp: &str, fps: &str, args: &[&str]| {
        let all = ["--layers", "variance", "--sampler", "independent"];
        let output = (demo_with(spp, fps, dir.path(), &[&all, args].concat()))
            .output()
            .unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{err}");
    };
    let parts = ["-o", "p/%d.exr", "--frames", "1024..1280"];
    make("8", "2560", &parts);
    let (mut mean, mut variance) = (vec![[0.0; 3]; 24 * 14], vec![[0.0; 3]; 24 * 14]);
    for part in 1024..1024 + PARTS {
        let [beauty, of_mean] = picture(&format!("p/{part}.exr"));
        for pixel in 0..mean.len() {
            for c in 0..3 {
                mean[pixel][c] += f64::from(beauty[pixel][c]) / f64::from(PARTS);
                variance[pixel][c] += f64::from(of_mean[pixel][c]) / f64::from(PARTS).powi(2);
            }
        }
    }
    // The mean of the squares of differences over their expected size: 1 if only noise is left.
    let distance = |name: &str| {
        let [beauty, of_mean] = picture(name);
        let each = (0..mean.len()).flat_map(|pixel| (0..3).map(move |c| (pixel, c)));
        let squares: Vec<f64> = each
            .filter(|(p, c)| variance[*p][*c] > 0.0 && of_mean[*p][*c] > 0.0)
            .map(|(p, c)| {
                let difference = f64::from(beauty[p][c]) - mean[p][c];
                difference.powi(2) / (f64::from(of_mean[p][c]) + variance[p][c])
            })
            .collect();
        assert!(squares.len() > 900, "{} channels are lit", squares.len());
        squares.iter().sum::<f64>() / squares.len() as f64
    };
    for (name, seed, shutter) in [("a.exr", "1", "1"), ("b.exr", "2", "0")] {
        let args = [
            "-o",
            name,
            "--frames",
            "4",
            "--seed",
            seed,
            "--shutter",
            shutter,
        ];
        make("1024", "10", &args);
    }
    let (blurred, sharp) = (distance("a.exr"), distance("b.exr"));
    assert!(
        blurred < 1.25 && sharp > 1.5,
        "{blurred} blurred, {sharp} sharp"
    );
}

/// A demo in a room with a window to the sky, which the server makes red half way.
#[test]
fn skies_that_the_server_changes_are_seen() {
    let dir = tempfile::tempdir().unwrap();
    let mut map = mapc::Map::new();
    map.texture(mapc::Texture::solid("wall", 64, 64, 100));
    map.texture(mapc::Texture::solid("sky1", 256, 128, 80));
    map.room([0.0; 3], [256.0; 3], 16.0, "wall");
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], "sky1");
    map.entity("info_player_start", &[("origin", "128 128 32")]);
    let level = mapc::compile(&map, &mapc::Options::default()).unwrap();
    let base = dir.path().join("id1");
    for folder in ["maps", "gfx/env"] {
        std::fs::create_dir_all(base.join(folder)).unwrap();
    }
    std::fs::write(base.join("maps/window.bsp"), level.bytes).unwrap();
    for side in ["rt", "bk", "lf", "ft", "up", "dn"] {
        let mut tga = vec![0; 18];
        (tga[2], tga[12], tga[14], tga[16]) = (2, 1, 1, 24);
        tga.extend([0, 0, 255]);
        std::fs::write(base.join(format!("gfx/env/red{side}.tga")), tga).unwrap();
    }
    let mut w = DemoWriter::new(Dialect::QUAKE, -1);
    w.server_info("window", 1, &["maps/window.bsp"], &[]);
    w.set_view(1).signon(1).signon(3);
    w.end_block([0.0; 3]);
    for i in 0..7_u8 {
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
    std::fs::write(dir.path().join("a.dem"), w.finish()).unwrap();
    let args = ["-o", "f/%d.exr", "--basedir", "."];
    succeeds(dir.path(), &args);
    let seen = |frame: u32| {
        let path = dir.path().join(format!("f/{frame}.exr"));
        runelight::picture::read(&path, "beauty").unwrap().radiance[7 * 24 + 12]
    };
    let frames = [0, 2, 4, 5].map(seen);
    assert_eq!(
        frames[0], frames[1],
        "the sky of the level stands still here"
    );
    assert!(frames[0][1] > 0.0, "{frames:?}");
    for red in &frames[2..] {
        assert!(red[0] > 0.9 && red[1] == 0.0 && red[2] == 0.0, "{frames:?}");
    }
    // Frames that are there are compared with the level in their own sky.
    std::fs::remove_file(dir.path().join("f/1.exr")).unwrap();
    std::fs::remove_file(dir.path().join("f/5.exr")).unwrap();
    succeeds(dir.path(), &[&args[..], &["--resume"]].concat());
    assert_eq!(seen(5), frames[3]);
}
