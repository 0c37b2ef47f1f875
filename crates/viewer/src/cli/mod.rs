//! The command line: names, defaults, help. What the options mean in full is said in their help.

mod bench;
mod compare;
mod compare_light;
mod demo;
mod export;
mod render;
mod shared;
mod view;

pub use bench::{Bench, List};
pub use compare::{Compare, Maxima};
pub use compare_light::CompareLight;
pub use demo::{ClipArgs, Demo, FrameRange, UnseenName};
pub use export::{Export, ExportFormat};
pub use render::{ExrType, LayerList, PictureArgs, Render};
pub use shared::{
    CameraChoice, EstimatorName, LightingName, Lights, SamplerName, SceneArgs, SelectionName,
    SurfaceArgs, ViewArgs,
};
pub(crate) use shared::{MOST_BRIGHTNESS, parse_camera, read_text};
pub use view::{View, with_view};

use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, ColorChoice, Parser, Subcommand};
use std::path::PathBuf;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Yellow.on_default().bold())
    .usage(AnsiColor::Yellow.on_default().bold())
    .literal(AnsiColor::Green.on_default())
    .placeholder(AnsiColor::Cyan.on_default());

const EXAMPLES: &str = "\
Examples:
  runelight
      a window on the bundled sample level
  runelight my.bsp
      a window on that level, or on a demo (.dem)
  runelight view start --basedir ~/quake
      fly through a level out of the PAKs of a Quake installation
  runelight render
      the bundled sample level, to sample.exr and sample.png
  runelight render e1m1 --basedir ~/quake --spp 256
      a level out of the PAKs of a Quake installation
  runelight render my.bsp -o my.png --time-limit 60 --device cpu
      as good as a minute of the processor makes it
  runelight info e1m1.bsp
  runelight compare reference.exr image.exr --max-relmse 0.01

Exit codes: 0 done, 1 could not do it (a sentence says why), 2 wrong usage,
3 a limit of compare or bench is exceeded.";

/// Path-traced pictures of Quake levels
#[derive(Debug, Parser)]
#[command(name = "runelight", version, styles = STYLES, after_help = EXAMPLES)]
#[command(infer_long_args = false, max_term_width = 100)]
pub struct Cli {
    /// What to do; nothing opens a window on the bundled level.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Options of every command.
    #[command(flatten)]
    pub global: Global,
}

/// Options of every command.
#[derive(Clone, Debug, Default, Args)]
pub struct Global {
    /// Quake directory (the one that holds id1/)
    #[arg(long, value_name = "DIR", env = "RUNELIGHT_BASEDIR", global = true)]
    #[arg(help_heading = "Finding files")]
    pub basedir: Option<PathBuf>,
    /// Mod directory inside the Quake directory, as with an engine's -game; repeatable, the last
    /// is searched first
    #[arg(
        long,
        value_name = "NAME",
        global = true,
        help_heading = "Finding files"
    )]
    pub game: Vec<String>,
    /// A PAK, or a directory, to search as well; repeatable, the last is searched first
    #[arg(
        long,
        value_name = "FILE",
        global = true,
        help_heading = "Finding files"
    )]
    pub pak: Vec<PathBuf>,
    /// What computes: auto is the best hardware ray-tracing device, else the processor; cpu; the
    /// number, or part of the name, of a device that `runelight devices` lists
    #[arg(
        long,
        value_name = "auto|cpu|INDEX|TEXT",
        default_value = "auto",
        global = true
    )]
    #[arg(help_heading = "Running")]
    pub device: String,
    /// Print the result as JSON on stdout
    #[arg(long, global = true, help_heading = "Running")]
    pub json: bool,
    /// No progress, no warnings; errors only
    #[arg(
        short,
        long,
        global = true,
        help_heading = "Running",
        conflicts_with = "verbose"
    )]
    pub quiet: bool,
    /// Say more; twice for all details
    #[arg(short, long, action = clap::ArgAction::Count, global = true, help_heading = "Running")]
    pub verbose: u8,
    /// When to use colours
    #[arg(long, value_name = "WHEN", default_value = "auto", global = true)]
    #[arg(help_heading = "Running")]
    pub color: ColorChoice,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open a window and fly through a level while it is path traced
    View(Box<View>),
    /// Path-trace one picture of a level
    Render(Box<Render>),
    /// Path-trace a demo as film, or say what it holds
    Demo(Box<Demo>),
    /// Say what files hold: BSP, PAK, WAD, MDL, SPR, DEM, palettes
    Info(Info),
    /// Measure how far an image is from a reference
    Compare(Box<Compare>),
    /// Measure how far a level's lightmaps are from light traced by the light compilers' rules
    CompareLight(Box<CompareLight>),
    /// Measure speed against error
    Bench(Box<Bench>),
    /// Write a level as another renderer reads it: Mitsuba 3, glTF
    Export(Box<Export>),
    /// List what can compute: Vulkan devices, and the processor
    Devices,
}

/// `runelight info`
#[derive(Debug, Args)]
pub struct Info {
    /// Files, or names to look up in the search path
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<String>,
    /// Relative luminance from which a fullbright texel emits, as for render
    #[arg(long, value_name = "T", default_value_t = 0.5, value_parser = shared::number(0.0, 1.0))]
    pub threshold: f64,
    /// What surfaces are made of.
    #[command(flatten)]
    pub surfaces: SurfaceArgs,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Layer;
    use crate::tonemap::Tonemap;
    use clap::CommandFactory as _;
    use clap::error::ErrorKind;

    fn render(args: &[&str]) -> Render {
        let all = ["runelight", "render"].iter().chain(args);
        match Cli::try_parse_from(all).unwrap().command {
            Some(Command::Render(r)) => *r,
            other => panic!("{other:?}"),
        }
    }

    fn fails(args: &[&str]) -> clap::Error {
        let all = ["runelight"].iter().chain(args);
        Cli::try_parse_from(all).unwrap_err()
    }

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn defaults_are_the_documented_ones() {
        let r = render(&[]);
        assert_eq!(
            (
                r.picture.view.size,
                r.picture.spp,
                r.picture.depth,
                r.picture.seed
            ),
            ((1280, 720), 64, 8, 0)
        );
        assert!(r.level.is_none() && r.output.is_empty() && r.picture.view.camera.is_none());
        let r = r.picture;
        assert_eq!((r.scene.threshold, r.exposure, r.scene.at), (0.5, 0.0, 0.0));
        let import = scene::import::ImportOptions::default();
        assert_eq!(r.scene.emission_scale as f32, import.emission_scale);
        assert_eq!(r.scene.threshold as f32, import.threshold);
        assert_eq!(r.estimator, EstimatorName::Mis);
        assert_eq!(r.lighting, LightingName::Physical);
        assert_eq!((r.scene.lights, r.tonemap), (Lights::Auto, Tonemap::Agx));
        assert_eq!(r.layers, LayerList(vec![Layer::Beauty]));
    }

    #[test]
    fn cameras_are_poses_numbers_or_names() {
        let pose = CameraChoice::Pose([-1.5, 2.0, 3.0, 0.0, -90.0, 5.0]);
        assert_eq!(
            render(&["--camera", "-1.5 2 3 0 -90 5"])
                .picture
                .view
                .camera,
            Some(pose.clone())
        );
        assert_eq!(
            render(&["--camera=-1.5,2,3, 0,-90,5"]).picture.view.camera,
            Some(pose)
        );
        assert_eq!(
            render(&["--camera", "2"]).picture.view.camera,
            Some(CameraChoice::Index(2))
        );
        assert_eq!(
            render(&["--camera", "info_intermission"])
                .picture
                .view
                .camera,
            Some(CameraChoice::Name("info_intermission".into()))
        );
        for wrong in ["1 2 3", "1 2 3 4 5 x", "-1", "", "1 2 3 4 5 inf"] {
            let error = fails(&["render", "--camera", wrong]);
            assert_eq!(error.exit_code(), 2, "{wrong}");
        }
    }

    #[test]
    fn wrong_values_name_the_option() {
        for (option, value) in [
            ("--size", "1280"),
            ("--size", "0x5"),
            ("--size", "99999x5"),
            ("--spp", "0"),
            ("--threshold", "1.5"),
            ("--time-limit", "-1"),
            ("--target-error", "nan"),
            ("--depth", "-1"),
            ("--estimator", "bdpt"),
            ("--lighting", "baked"),
            ("--fov", "180"),
            ("--aperture", "-1"),
            ("--focus", "0"),
            ("--exr-type", "double"),
        ] {
            let error = fails(&["render", &format!("{option}={value}")]);
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(option), "{error}");
        }
        let error = fails(&["render", "--layers", "albedo,shadow"]).to_string();
        assert!(
            error.contains("\"shadow\"") && error.contains("indirect"),
            "{error}"
        );
    }

    #[test]
    fn fog_is_written_as_in_worldspawn() {
        let fog = |text: &str| {
            render(&[&format!("--fog={text}")])
                .picture
                .scene
                .fog
                .unwrap()
        };
        assert_eq!(fog("off"), scene::import::FogKeys::OFF);
        let keys = fog("0.05 0.1 0.2 0.4");
        assert_eq!((keys.density, keys.color), (0.05, [0.1, 0.2, 0.4]));
        assert_eq!(fog("1").color, [0.3; 3]);
        for wrong in ["", "on", "-1", "nan", "0.1 2 0 0", "0.1 0 0 0 0", "1e9"] {
            let error = fails(&["render", &format!("--fog={wrong}")]);
            assert!(error.to_string().contains("fog is a density"), "{error}");
        }
        assert_eq!(render(&["--skyfog=0.25"]).picture.scene.skyfog, Some(0.25));
    }

    #[test]
    fn options_of_later_features_are_not_there() {
        assert_eq!(fails(&["edit"]).kind(), ErrorKind::InvalidSubcommand);
    }

    #[test]
    fn global_options_may_stand_anywhere_and_repeat() {
        let cli = Cli::try_parse_from([
            "runelight",
            "--game",
            "a",
            "info",
            "x.bsp",
            "--json",
            "--pak",
            "p",
            "--pak",
            "q",
            "-vv",
        ])
        .unwrap();
        assert!(cli.global.json);
        assert_eq!(cli.global.pak.len(), 2);
        assert_eq!((cli.global.game.len(), cli.global.verbose), (1, 2));
        assert_eq!(
            fails(&["devices", "-q", "-v"]).kind(),
            ErrorKind::ArgumentConflict
        );
    }
}
