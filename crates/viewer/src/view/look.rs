//! What the picture depends on: the options of `runelight render`, as they stand at a moment. So a
//! picture of the window is always one that the command line can make again.

use crate::cli::{
    CameraChoice, Cli, Command, EstimatorName, Global, LayerList, PictureArgs, Render,
};
use crate::output::Layer;
use clap::{Parser as _, ValueEnum};
use scene::import::FogKeys;
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
    let usual = defaults().picture;
    let picture = &args.picture;
    let mut line = Line::default();
    line.word("runelight");
    line.word("render");
    if let Some(level) = &args.level {
        line.word(level);
    }
    let path = |p: &Path| p.display().to_string();
    if let Some(dir) = &global.basedir {
        line.option("--basedir", path(dir));
    }
    global.game.iter().for_each(|g| line.option("--game", g));
    (global.pak.iter()).for_each(|p| line.option("--pak", path(p)));
    line.option("--device", &global.device);
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
    line.changed("--layers", [&picture.layers, &usual.layers], |list| {
        let names: Vec<_> = list.0.iter().map(|l| l.name()).collect();
        names.join(",")
    });
    line.changed("--exr-type", [&picture.exr_type, &usual.exr_type], name);
    line.changed("--exposure", [&picture.exposure, &usual.exposure], number);
    line.changed("--tonemap", [&picture.tonemap, &usual.tonemap], name);
    (args.output.iter()).for_each(|o| line.option("-o", path(o)));
    line.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    /// Words of a line as a shell takes it, as far as [`quoted`] goes.
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
            vec!["--device", "NVIDIA H100", "--camera", "info_intermission"],
        ] {
            let words = ["runelight", "render"].into_iter().chain(extra);
            let cli = Cli::try_parse_from(words).unwrap();
            let Some(Command::Render(args)) = &cli.command else {
                panic!("{cli:?}");
            };
            let line = command_line(args, &cli.global);
            let again = Cli::try_parse_from(split(&line)).unwrap_or_else(|e| panic!("{line}: {e}"));
            assert_eq!(format!("{cli:?}"), format!("{again:?}"), "{line}");
        }
    }

    /// An option that is new would be lost from the command line without anybody noticing.
    #[test]
    fn every_option_of_render_is_said() {
        let known = "level output layers exr_type exposure tonemap spp time_limit target_error \
            adaptive depth estimator selection lighting candidates clamp sampler seed size camera fov \
            aperture focus camera_path \
            at lights threshold emission_scale fog skyfog no_entities skill deathmatch materials \
            no_textures original_models";
        let known: Vec<&str> = known.split_whitespace().collect();
        let cli = Cli::command();
        let render = cli.find_subcommand("render").unwrap();
        for arg in render.get_arguments().map(|a| a.get_id().as_str()) {
            assert!(known.contains(&arg), "--{arg}: say it in `command_line`");
        }
    }
}
