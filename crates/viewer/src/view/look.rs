//! What the picture depends on: the options of `runelight render`, as they stand at a moment. So a
//! picture of the window is always one that the command line can make again.

use crate::cli::{
    CameraChoice, Cli, Command, Demo, EstimatorName, FrameRange, Global, LayerList, PictureArgs,
    Render,
};
use crate::clip::Ratio;
use crate::output::Layer;
use anyhow::{Result, anyhow, bail};
use clap::{Parser as _, ValueEnum};
use scene::import::FogKeys;
use scene::render::Settings;
use std::path::Path;

/// The options of `runelight render` without any argument.
///
/// # Panics
/// Never: no option is required.
#[must_use]
pub fn defaults() -> Render {
    match Cli::try_parse_from(["runelight", "render"]).map(|cli| cli.command) {
        Ok(Some(Command::Render(args))) => *args,
        other => unreachable!("render has defaults: {other:?}"),
    }
}

/// The options of `runelight demo` without any argument.
///
/// # Panics
/// Never: no option is required.
#[must_use]
pub fn demo_defaults() -> Demo {
    match Cli::try_parse_from(["runelight", "demo"]).map(|cli| cli.command) {
        Ok(Some(Command::Demo(args))) => *args,
        other => unreachable!("demo has defaults: {other:?}"),
    }
}

/// The layers that are kept: beauty alone, or all that `render` names so.
#[must_use]
pub fn layers(all: bool) -> LayerList {
    let names = if all { "all" } else { "beauty" };
    Layer::parse_list(names).map_or_else(|_| LayerList(vec![Layer::Beauty]), LayerList)
}

/// Some settings at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Brute force, as the prototype did it: cosine-distributed walks that find light by hitting it.
    Thesis,
    /// Few bounces and no bright dots, for looking around on slow devices.
    Preview,
    /// All light, however often it is reflected.
    Truth,
}

impl Preset {
    /// All of them with name and hint.
    pub const ALL: [(Self, &str, &str); 3] = [
        (
            Self::Thesis,
            "thesis",
            "brute force: walks that find light by hitting it, depth 4",
        ),
        (Self::Preview, "preview", "depth 3, samples clamped"),
        (Self::Truth, "truth", "unlimited depth, nothing clamped"),
    ];

    /// Sets what it is about; the rest stays.
    pub fn apply(self, picture: &mut PictureArgs) {
        let usual = defaults().picture;
        picture.sampler = usual.sampler;
        picture.selection = usual.selection;
        picture.candidates = usual.candidates;
        picture.lighting = usual.lighting;
        let (estimator, depth, clamp) = match self {
            Self::Thesis => (EstimatorName::Naive, 4, None),
            Self::Preview => (EstimatorName::Mis, 3, Some(10.0)),
            Self::Truth => (EstimatorName::Mis, 0, None),
        };
        (picture.estimator, picture.depth, picture.clamp) = (estimator, depth, clamp);
    }
}

/// A line for a shell.
#[derive(Default)]
struct Line(String);

impl Line {
    fn word(&mut self, text: &str) {
        if !self.0.is_empty() {
            self.0.push(' ');
        }
        self.0 += &quoted(text);
    }

    fn option(&mut self, name: &str, value: impl std::fmt::Display) {
        self.word(name);
        self.word(&value.to_string());
    }

    /// An option where its value is not the default one.
    fn changed<T: PartialEq>(&mut self, name: &str, pair: [&T; 2], text: impl Fn(&T) -> String) {
        if pair[0] != pair[1] {
            self.option(name, text(pair[0]));
        }
    }

    fn switch(&mut self, name: &str, on: bool) {
        if on {
            self.word(name);
        }
    }
}

/// A word as shells read it back.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,+:".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

fn name<T: ValueEnum>(value: &T) -> String {
    (value.to_possible_value()).map_or(String::new(), |v| v.get_name().to_owned())
}

fn fog(keys: &FogKeys) -> String {
    let [r, g, b] = keys.color;
    if *keys == FogKeys::OFF {
        "off".into()
    } else {
        format!("{} {r} {g} {b}", keys.density)
    }
}

/// The command that renders a picture with these options: what differs from the defaults, and always
/// the samples, the size and the seed.
#[must_use]
pub fn command_line(args: &Render, global: &Global) -> String {
    let mut line = Line::default();
    line.word("runelight");
    line.word("render");
    if let Some(level) = &args.level {
        line.word(level);
    }
    line.files(global);
    line.option("--device", &global.device);
    line.picture(&args.picture);
    (args.output.iter()).for_each(|o| line.option("-o", o.display()));
    line.0
}

/// What a picture notes of how it was made: the command that renders it, but for the device, which it notes
/// by itself, and the files. Whatever told the camera and the samples, they are said as they were.
#[must_use]
pub fn noted_command(args: &Render, global: &Global, settings: &Settings, samples: u32) -> String {
    let mut args = args.clone();
    let picture = &mut args.picture;
    (picture.time_limit, picture.target_error) = (None, None);
    (picture.spp, picture.view.size) = (samples, (settings.width, settings.height));
    let c = &settings.camera;
    let [x, y, z] = c.position.to_array();
    let pose = [x, y, z, c.pitch_deg, c.yaw_deg, c.roll_deg];
    (picture.view.camera, picture.view.camera_path) = (Some(CameraChoice::Pose(pose)), None);
    picture.view.take_lens(c);
    let mut line = Line::default();
    line.word("runelight");
    line.word("render");
    if let Some(level) = &args.level {
        line.word(level);
    }
    line.files(global);
    line.picture(&args.picture);
    line.0
}

/// What a frame of a demo notes of how it was made, as [`noted_command`]: the command that makes it alone.
#[must_use]
pub fn noted_demo_command(args: &Demo, global: &Global, frame: u32, samples: u32) -> String {
    let (mut clip, mut picture) = (args.clip.clone(), args.picture.clone());
    (clip.to, clip.resume) = (None, false);
    clip.frames = Some(FrameRange {
        first: frame,
        end: Some(frame + 1),
    });
    (picture.time_limit, picture.target_error) = (None, None);
    picture.spp = samples;
    let alone = Demo {
        demo: args.demo.clone(),
        output: Vec::new(),
        clip,
        picture,
    };
    let mut line = Line::default();
    line.demo(&alone, global, None);
    line.0
}

/// A command that a picture noted.
#[derive(Debug)]
pub enum Noted {
    /// A level's.
    Render(Box<Render>),
    /// A frame of a demo.
    Demo(Box<Demo>),
}

/// Reads what [`noted_command`] or [`noted_demo_command`] wrote, as the command line is read.
///
/// # Errors
/// When it is no such command.
pub fn read_command(line: &str) -> Result<(Global, Noted)> {
    let cli = Cli::try_parse_from(split(line)).map_err(|e| {
        let text = e.to_string();
        anyhow!("{}", text.lines().next().unwrap_or_default().to_owned())
    })?;
    match cli.command {
        Some(Command::Render(render)) => {
            render.picture.check()?;
            Ok((cli.global, Noted::Render(render)))
        }
        Some(Command::Demo(demo)) => {
            demo.picture.check()?;
            Ok((cli.global, Noted::Demo(demo)))
        }
        _ => bail!("it is not the command of a picture"),
    }
}

/// Words of a line as shells take it, as far as [`quoted`] goes.
fn split(line: &str) -> Vec<String> {
    let (mut words, mut word, mut inside, mut any) = (Vec::new(), String::new(), false, false);
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        match c {
            '\'' => (inside, any) = (!inside, true),
            '\\' if !inside => word.extend(chars.next()),
            ' ' if !inside => {
                words.push(std::mem::take(&mut word));
                any = false;
            }
            c => word.push(c),
        }
    }
    if any || !word.is_empty() {
        words.push(word);
    }
    words
}

/// The command that makes a film with these options.
#[must_use]
pub fn demo_command_line(args: &Demo, global: &Global) -> String {
    let mut line = Line::default();
    line.demo(args, global, Some(&global.device));
    (args.output.iter()).for_each(|o| line.option("-o", o.display()));
    line.0
}

impl Line {
    /// A film, but for its files.
    fn demo(&mut self, args: &Demo, global: &Global, device: Option<&str>) {
        let usual = demo_defaults().clip;
        let clip = &args.clip;
        let line = self;
        line.word("runelight");
        line.word("demo");
        if let Some(demo) = &args.demo {
            line.word(demo);
        }
        line.files(global);
        if let Some(device) = device {
            line.option("--device", device);
        }
        line.changed("--fps", [&clip.fps, &usual.fps], Ratio::to_string);
        let ratio = |r: &Option<Ratio>| r.map_or(String::new(), Ratio::to_decimal);
        line.changed("--from", [&clip.from, &usual.from], ratio);
        line.changed("--to", [&clip.to, &usual.to], ratio);
        line.changed("--frames", [&clip.frames, &usual.frames], |frames| {
            frames.map_or(String::new(), |f| {
                format!(
                    "{}..{}",
                    f.first,
                    f.end.map_or(String::new(), |n| n.to_string())
                )
            })
        });
        line.changed("--shutter", [&clip.shutter, &usual.shutter], f64::to_string);
        line.switch("--resume", clip.resume);
        line.changed("--unseen", [&clip.unseen, &usual.unseen], |unseen| {
            unseen.as_ref().map_or(String::new(), name)
        });
        line.switch("--no-tint", clip.no_tint);
        line.picture(&args.picture);
    }

    /// Where files are looked up.
    fn files(&mut self, global: &Global) {
        let path = |p: &Path| p.display().to_string();
        if let Some(dir) = &global.basedir {
            self.option("--basedir", path(dir));
        }
        global.game.iter().for_each(|g| self.option("--game", g));
        (global.pak.iter()).for_each(|p| self.option("--pak", path(p)));
    }

    /// What the picture is.
    fn picture(&mut self, picture: &PictureArgs) {
        let (line, usual) = (self, defaults().picture);
        let path = |p: &Path| p.display().to_string();
        if let Some(camera) = &picture.view.camera {
            let text = match camera {
                CameraChoice::Pose(numbers) => numbers.map(|n| n.to_string()).join(" "),
                CameraChoice::Index(index) => index.to_string(),
                CameraChoice::Name(name) => name.clone(),
            };
            line.option("--camera", text);
        }
        let number = |n: &f64| n.to_string();
        let optional = |n: &Option<f64>| n.map_or(String::new(), |n| n.to_string());
        if let Some(file) = &picture.view.camera_path {
            line.option("--camera-path", path(file));
        }
        let apertures = [&picture.view.aperture, &usual.view.aperture];
        line.changed("--aperture", apertures, optional);
        line.changed(
            "--focus",
            [&picture.view.focus, &usual.view.focus],
            optional,
        );
        line.changed("--fov", [&picture.view.fov, &usual.view.fov], optional);
        line.option(
            "--size",
            format!("{}x{}", picture.view.size.0, picture.view.size.1),
        );
        line.option("--spp", picture.spp);
        line.option("--seed", picture.seed);
        let times = [&picture.time_limit, &usual.time_limit];
        line.changed("--time-limit", times, optional);
        let errors = [&picture.target_error, &usual.target_error];
        line.changed("--target-error", errors, optional);
        line.switch("--adaptive", picture.adaptive);
        line.changed("--depth", [&picture.depth, &usual.depth], u32::to_string);
        line.changed("--estimator", [&picture.estimator, &usual.estimator], name);
        line.changed("--selection", [&picture.selection, &usual.selection], name);
        line.changed("--lighting", [&picture.lighting, &usual.lighting], name);
        let candidates = [&picture.candidates, &usual.candidates];
        line.changed("--candidates", candidates, u32::to_string);
        line.changed("--clamp", [&picture.clamp, &usual.clamp], optional);
        line.changed("--sampler", [&picture.sampler, &usual.sampler], name);
        let (scene, plain) = (&picture.scene, &usual.scene);
        line.changed("--at", [&scene.at, &plain.at], number);
        line.changed("--lights", [&scene.lights, &plain.lights], name);
        line.changed("--threshold", [&scene.threshold, &plain.threshold], number);
        let scales = [&scene.emission_scale, &plain.emission_scale];
        line.changed("--emission-scale", scales, number);
        for (number, brightness) in &scene.styles {
            line.option("--light-style", format!("{number}={brightness}"));
        }
        let fogs = [&scene.fog, &plain.fog];
        line.changed("--fog", fogs, |keys| {
            keys.as_ref().map_or(String::new(), fog)
        });
        line.changed("--skyfog", [&scene.skyfog, &plain.skyfog], optional);
        line.switch("--no-entities", scene.entities.no_entities);
        let skills = [&scene.entities.skill, &plain.entities.skill];
        line.changed("--skill", skills, u32::to_string);
        line.switch("--deathmatch", scene.entities.deathmatch);
        for file in &scene.surfaces.materials {
            line.option("--materials", file);
        }
        line.switch("--no-textures", scene.surfaces.no_textures);
        line.switch("--original-models", scene.surfaces.original_models);
        line.switch("--flat-models", scene.surfaces.flat_models);
        line.changed("--layers", [&picture.layers, &usual.layers], |list| {
            let names: Vec<_> = list.0.iter().map(|l| l.name()).collect();
            names.join(",")
        });
        line.changed("--exr-type", [&picture.exr_type, &usual.exr_type], name);
        line.changed("--exposure", [&picture.exposure, &usual.exposure], number);
        line.changed("--denoise", [&picture.denoise, &usual.denoise], name);
        line.changed("--tonemap", [&picture.tonemap, &usual.tonemap], name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    /// The line that is said of a command with these options means the same again.
    fn says_all(command: &str, options: Vec<&str>) {
        let words = ["runelight", command].into_iter().chain(options);
        let cli = Cli::try_parse_from(words).unwrap();
        let line = match &cli.command {
            Some(Command::Render(args)) => command_line(args, &cli.global),
            Some(Command::Demo(args)) => demo_command_line(args, &cli.global),
            _ => panic!("{cli:?}"),
        };
        let again = Cli::try_parse_from(split(&line)).unwrap_or_else(|e| panic!("{line}: {e}"));
        assert_eq!(format!("{cli:?}"), format!("{again:?}"), "{line}");
    }

    #[test]
    fn the_command_line_says_all_that_render_was_told() {
        for extra in [
            vec![],
            vec![
                "some level's.bsp",
                "--basedir",
                "/q u/ake",
                "--game",
                "ad",
                "--pak",
                "x.pak",
            ],
            vec![
                "e1m1",
                "--camera",
                "-1.5 2 3.25 0 -90 1e-3",
                "--fov",
                "70.5",
                "--size",
                "31x17",
            ],
            vec![
                "--spp",
                "7",
                "--seed",
                "18446744073709551615",
                "--time-limit",
                "2.5",
            ],
            vec![
                "--target-error",
                "0.01",
                "--adaptive",
                "--depth",
                "0",
                "--estimator",
                "nee",
            ],
            vec![
                "--selection",
                "tree",
                "--lighting",
                "compiler",
                "--candidates",
                "2",
            ],
            vec!["--clamp", "3.5", "--sampler", "independent", "--at", "1.25"],
            vec![
                "--lights",
                "all",
                "--threshold",
                "0.3",
                "--emission-scale",
                "8",
            ],
            vec![
                "--fog",
                "0.05 0.1 0.2 0.4",
                "--skyfog",
                "0.25",
                "--no-entities",
            ],
            vec![
                "--fog",
                "off",
                "--skill",
                "3",
                "--materials",
                "default",
                "--no-textures",
                "--original-models",
                "--flat-models",
            ],
            vec![
                "--deathmatch",
                "--layers",
                "all",
                "--exr-type",
                "half",
                "--exposure",
                "-1.5",
            ],
            vec![
                "--tonemap",
                "clip",
                "--denoise",
                "svgf",
                "-o",
                "a b.exr",
                "-o",
                "c.png",
                "--camera",
                "2",
            ],
            vec![
                "--aperture",
                "2.5",
                "--focus",
                "300",
                "--camera-path",
                "a path.toml",
            ],
            vec!["--light-style", "3=0.25", "--light-style", "32=0"],
            vec!["--device", "NVIDIA H100", "--camera", "info_intermission"],
        ] {
            says_all("render", extra);
        }
    }

    #[test]
    fn the_command_line_says_all_that_demo_was_told() {
        for extra in [
            vec![],
            vec![
                "a demo.dem",
                "--basedir",
                "/q",
                "--fps",
                "30000/1001",
                "-o",
                "a/%05d.png",
            ],
            vec![
                "--from",
                "1.25",
                "--to",
                "2.000001",
                "--shutter",
                "0.5",
                "--resume",
            ],
            vec!["--frames", "3..9", "--unseen", "brushes", "--no-tint"],
            vec![
                "--frames",
                "3..",
                "--camera",
                "-1 2 3 0 0 0",
                "--spp",
                "8",
                "--size",
                "32x16",
            ],
        ] {
            says_all("demo", extra);
        }
    }

    #[test]
    fn what_is_noted_of_a_picture_is_read_again() {
        let words = "runelight render e1m1 --camera 2 --fov 80 --depth 3 --threshold 0.3 --target-error 0.1";
        let cli = Cli::try_parse_from(words.split(' ')).unwrap();
        let Some(Command::Render(args)) = cli.command else {
            panic!("a picture");
        };
        let camera = scene::Camera {
            name: String::new(),
            position: glam::Vec3::new(1.0, -2.5, 1e-7),
            pitch_deg: 10.0,
            yaw_deg: -90.5,
            roll_deg: 0.0,
            fov_deg: 80.0,
            lens: scene::camera::Lens::new(2.0, 300.0),
        };
        let mut settings = args.picture.settings(camera.clone());
        (settings.width, settings.height) = (31, 17);
        let line = noted_command(&args, &cli.global, &settings, 40);
        let (global, Noted::Render(read)) = read_command(&line).unwrap() else {
            panic!("a picture: {line}");
        };
        assert_eq!(noted_command(&read, &global, &settings, 40), line);
        assert_eq!((read.picture.spp, read.picture.view.size), (40, (31, 17)));
        assert_eq!((read.picture.depth, read.picture.scene.threshold), (3, 0.3));
        assert_eq!(read.picture.target_error, None);
        assert!(!line.contains("--device"), "{line}");
        for wrong in [
            "",
            "runelight",
            "runelight render --depth x",
            "runelight info a",
            "rm -rf /",
        ] {
            assert!(read_command(wrong).is_err(), "{wrong}");
        }
    }

    /// An option that is new would be lost from the command line without anybody noticing.
    #[test]
    fn every_option_of_render_is_said() {
        let known = "level output layers exr_type exposure tonemap spp time_limit target_error \
            adaptive denoise depth estimator selection lighting candidates clamp sampler seed size camera fov \
            aperture focus camera_path \
            at lights threshold emission_scale styles fog skyfog no_entities skill deathmatch materials \
            no_textures original_models flat_models";
        let known: Vec<&str> = known.split_whitespace().collect();
        let of_demo = [
            "demo", "fps", "from", "to", "frames", "shutter", "resume", "unseen", "no_tint",
        ];
        let cli = Cli::command();
        for (command, more) in [("render", &[][..]), ("demo", &of_demo)] {
            let command = cli.find_subcommand(command).unwrap();
            for arg in command.get_arguments().map(|a| a.get_id().as_str()) {
                let is_said = known.contains(&arg) || more.contains(&arg);
                assert!(is_said, "--{arg}: say it in `command_line`");
            }
        }
    }
}
