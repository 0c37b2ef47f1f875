//! The command line: names, defaults, help. What the options mean in full is said in their help.

use crate::output::Layer;
use crate::tonemap::Tonemap;
use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, ColorChoice, Parser, Subcommand, ValueEnum};
use scene::render::Estimator;
use std::path::PathBuf;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Yellow.on_default().bold())
    .usage(AnsiColor::Yellow.on_default().bold())
    .literal(AnsiColor::Green.on_default())
    .placeholder(AnsiColor::Cyan.on_default());

const EXAMPLES: &str = "\
Examples:
  runelight render
      the bundled sample level, to sample.exr and sample.png
  runelight render e1m1 --basedir ~/quake --spp 256
      a level out of the PAKs of a Quake installation
  runelight render my.bsp -o my.png --time-limit 60 --device cpu
      as good as a minute of the processor makes it
  runelight info e1m1.bsp
  runelight compare reference.exr image.exr --max-relmse 0.01

Exit codes: 0 done, 1 could not do it (a sentence says why), 2 wrong usage,
3 a limit given to compare is exceeded.";

const RENDER_EXAMPLES: &str = "\
Examples:
  runelight render start --basedir ~/quake --size 640x360 --spp 16
  runelight render start --camera \"544 288 54 10 90 0\" --exposure 1
  runelight render start --layers albedo,normal,depth -o start.exr
  runelight render start --target-error 0.005 --spp 100000
  runelight render dark.bsp --estimator naive --depth 3

The first Ctrl-C ends the picture after the samples under way and writes it; the
second one gives up and writes nothing.";

const COMPARE_EXAMPLES: &str = "\
Examples:
  runelight compare truth.exr test.exr
  runelight compare truth.exr test.exr --max-relmse 0.01 --heatmap where.png

With a --max option the exit code is 3 if the error is larger, or not a number.";

/// Path-traced pictures of Quake levels
#[derive(Debug, Parser)]
#[command(name = "runelight", version, styles = STYLES, after_help = EXAMPLES)]
#[command(infer_long_args = false, max_term_width = 100)]
pub struct Cli {
    /// What to do; nothing prints this help.
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
    /// Path-trace one picture of a level
    Render(Box<Render>),
    /// Say what files hold: BSP, PAK, WAD, MDL, SPR, DEM, palettes
    Info(Info),
    /// Measure how far an image is from a reference
    Compare(Box<Compare>),
    /// List what can compute: Vulkan devices, and the processor
    Devices,
}

/// `runelight render`
#[derive(Debug, Args)]
#[command(after_help = RENDER_EXAMPLES)]
pub struct Render {
    /// A .bsp file, or a name such as e1m1 or maps/e1m1.bsp to look up; without it the bundled
    /// sample level
    pub level: Option<String>,

    /// File to write, .exr (scene-linear, all layers) or .png (tone-mapped, 8 bit); repeatable
    /// [default: LEVEL.exr and LEVEL.png here]
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,
    /// Layers of the EXR besides beauty, separated by commas: albedo, normal, depth, position,
    /// emission, direct, indirect, variance, samples, id; or all
    #[arg(
        long,
        value_name = "LIST",
        default_value = "beauty",
        help_heading = "Output"
    )]
    #[arg(value_parser = parse_layers)]
    pub layers: LayerList,
    /// How an EXR stores colours; distances, positions, variances and numbers always have 32 bits
    #[arg(
        long,
        value_name = "TYPE",
        default_value = "float",
        help_heading = "Output"
    )]
    pub exr_type: ExrType,
    /// Exposure of a PNG in stops
    #[arg(
        long,
        value_name = "EV",
        default_value_t = 0.0,
        help_heading = "Output"
    )]
    #[arg(allow_negative_numbers = true, value_parser = number(-64.0, 64.0))]
    pub exposure: f64,
    /// Tone curve of a PNG
    #[arg(
        long,
        value_name = "NAME",
        default_value = "agx",
        help_heading = "Output"
    )]
    pub tonemap: Tonemap,

    /// Picture size in pixels
    #[arg(
        long,
        value_name = "WxH",
        default_value = "1280x720",
        help_heading = "Picture"
    )]
    #[arg(value_parser = parse_size)]
    pub size: (u32, u32),
    /// Where from: "X Y Z PITCH YAW ROLL" in Quake units and degrees (the eye, 22 above what an
    /// engine's viewpos prints), or the number or name of a camera that `runelight info` lists
    /// [default: the player's start]
    #[arg(
        long,
        value_name = "CAMERA",
        help_heading = "Picture",
        allow_hyphen_values = true
    )]
    #[arg(value_parser = parse_camera)]
    pub camera: Option<CameraChoice>,
    /// Field of view in degrees, horizontally at 4:3; wider pictures show more at the sides
    /// [default: the camera's, 90]
    #[arg(long, value_name = "DEG", help_heading = "Picture", value_parser = number(1.0, 170.0))]
    pub fov: Option<f64>,
    /// Level time in seconds: animated and scrolling textures
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        help_heading = "Picture"
    )]
    #[arg(value_parser = number(0.0, 1e6))]
    pub at: f64,

    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub spp: u32,
    /// Take no further samples this many seconds after the start, loading included
    #[arg(long, value_name = "S", help_heading = "Quality", value_parser = number(1e-3, 1e7))]
    pub time_limit: Option<f64>,
    /// Stop once the estimated relMSE of the picture is below this
    #[arg(long, value_name = "E", help_heading = "Quality", value_parser = number(1e-12, 1e6))]
    pub target_error: Option<f64>,
    /// Path vertices after the camera: 1 shows what emits, 2 adds direct light, ...; 0 is without
    /// limit (Russian roulette)
    #[arg(long, value_name = "N", default_value_t = 8, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub depth: u32,
    /// How light is found
    #[arg(
        long,
        value_name = "NAME",
        default_value = "mis",
        help_heading = "Quality"
    )]
    pub estimator: EstimatorName,
    /// Same seed, same device, same picture bit for bit
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality")]
    pub seed: u64,

    /// What is lit
    #[arg(
        long,
        value_name = "WHICH",
        default_value = "auto",
        help_heading = "Light"
    )]
    pub lights: Lights,
    /// Relative luminance from which a fullbright texel emits, 0 to 1
    #[arg(long, value_name = "T", default_value_t = 0.5, help_heading = "Light")]
    #[arg(value_parser = number(0.0, 1.0))]
    pub threshold: f64,
    /// Radiance of a white emitting texel
    #[arg(long, value_name = "X", default_value_t = 4.0, help_heading = "Light")]
    #[arg(value_parser = number(0.0, 1e6))]
    pub emission_scale: f64,
}

/// `runelight info`
#[derive(Debug, Args)]
pub struct Info {
    /// Files, or names to look up in the search path
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<String>,
    /// Relative luminance from which a fullbright texel emits, as for render
    #[arg(long, value_name = "T", default_value_t = 0.5, value_parser = number(0.0, 1.0))]
    pub threshold: f64,
}

/// `runelight compare`
#[derive(Debug, Args)]
#[command(after_help = COMPARE_EXAMPLES)]
pub struct Compare {
    /// The truth, EXR or PNG
    pub reference: PathBuf,
    /// What is measured against it
    pub image: PathBuf,
    /// Layer to compare
    #[arg(long, value_name = "NAME", default_value = "beauty")]
    pub layer: String,
    /// Write the FLIP error of every pixel as a picture, black (0) to bright (1)
    #[arg(long, value_name = "FILE.png")]
    pub heatmap: Option<PathBuf>,
    /// The limits.
    #[command(flatten)]
    pub limits: Maxima,
}

/// The limits of `runelight compare`, one for each metric.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Limits: exit with 3 if exceeded")]
pub struct Maxima {
    /// Mean squared error
    #[arg(long, value_name = "X")]
    pub max_mse: Option<f64>,
    /// Root of the mean squared error
    #[arg(long, value_name = "X")]
    pub max_rmse: Option<f64>,
    /// Relative mean squared error
    #[arg(long, value_name = "X")]
    pub max_relmse: Option<f64>,
    /// Mean absolute error relative to the reference
    #[arg(long, value_name = "X")]
    pub max_mape: Option<f64>,
    /// Mean absolute error relative to both
    #[arg(long, value_name = "X")]
    pub max_smape: Option<f64>,
    /// Mean FLIP error
    #[arg(long, value_name = "X")]
    pub max_flip: Option<f64>,
    /// Mean of the image over mean of the reference
    #[arg(long, value_name = "X", alias = "max-mean_ratio")]
    pub max_mean_ratio: Option<f64>,
    /// Largest difference
    #[arg(long, value_name = "X", alias = "max-max_abs", alias = "max-abs")]
    pub max_max_abs: Option<f64>,
    /// Pixels that are not finite
    #[arg(long, value_name = "X")]
    pub max_nonfinite: Option<f64>,
}

impl Maxima {
    /// The limits given, by metric.
    pub fn given(&self) -> impl Iterator<Item = (&'static str, f64)> {
        [
            ("mse", self.max_mse),
            ("rmse", self.max_rmse),
            ("relmse", self.max_relmse),
            ("mape", self.max_mape),
            ("smape", self.max_smape),
            ("flip", self.max_flip),
            ("mean_ratio", self.max_mean_ratio),
            ("max_abs", self.max_max_abs),
            ("nonfinite", self.max_nonfinite),
        ]
        .into_iter()
        .filter_map(|(name, limit)| limit.map(|l| (name, l)))
    }
}

/// `--exr-type`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExrType {
    /// 16 bits: smaller files, about three digits
    Half,
    /// 32 bits
    Float,
}

/// `--estimator`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorName {
    /// Walk on in a direction weighted by the cosine, find light by hitting it
    Naive,
    /// Walk on in any direction of the hemisphere, find light by hitting it
    Uniform,
    /// Choose lights and look whether they are seen
    Nee,
    /// Both, each weighted by how likely it was
    Mis,
}

impl From<EstimatorName> for Estimator {
    fn from(name: EstimatorName) -> Self {
        match name {
            EstimatorName::Naive => Self::Naive,
            EstimatorName::Uniform => Self::Uniform,
            EstimatorName::Nee => Self::Nee,
            EstimatorName::Mis => Self::Mis,
        }
    }
}

/// `--lights`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lights {
    /// Bright surfaces, and those light entities that stand for none of them
    Auto,
    /// Bright surfaces alone: fullbright texels, glowing liquids, sky
    Textures,
    /// Light entities alone, and the sky
    Entities,
    /// Both, even where they are one lamp
    All,
}

impl Lights {
    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Textures => "textures",
            Self::Entities => "entities",
            Self::All => "all",
        }
    }
}

impl From<Lights> for scene::import::LightMode {
    fn from(lights: Lights) -> Self {
        match lights {
            Lights::Auto => Self::Auto,
            Lights::Textures => Self::Textures,
            Lights::Entities => Self::Entities,
            Lights::All => Self::All,
        }
    }
}

/// `--layers`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerList(pub Vec<Layer>);

/// `--camera`
#[derive(Clone, Debug, PartialEq)]
pub enum CameraChoice {
    /// Eye in Quake units; pitch, yaw and roll in degrees.
    Pose([f32; 6]),
    /// Number among the level's cameras.
    Index(usize),
    /// Name of one of the level's cameras.
    Name(String),
}

fn parse_layers(text: &str) -> Result<LayerList, String> {
    Layer::parse_list(text).map(LayerList)
}

/// Largest side of a picture, in pixels.
const MAX_SIDE: u32 = 32_768;

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || format!("a size is WIDTHxHEIGHT in pixels, 1 to {MAX_SIDE} each, as 1280x720");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    side(w).zip(side(h)).ok_or_else(wrong)
}

fn parse_camera(text: &str) -> Result<CameraChoice, String> {
    let words: Vec<&str> = (text.split(|c: char| c.is_whitespace() || c == ','))
        .filter(|w| !w.is_empty())
        .collect();
    let numbers: Option<Vec<f32>> = (words.iter())
        .map(|w| w.parse().ok().filter(|v: &f32| v.is_finite()))
        .collect();
    match (numbers.as_deref(), words.as_slice()) {
        (Some(&[x, y, z, pitch, yaw, roll]), _) => {
            Ok(CameraChoice::Pose([x, y, z, pitch, yaw, roll]))
        }
        (Some(_), [index]) => (index.parse().map(CameraChoice::Index))
            .map_err(|_| "a camera's number is 0 or more".to_owned()),
        (None, [name]) => Ok(CameraChoice::Name((*name).to_owned())),
        _ => Err(
            "a camera is six numbers \"X Y Z PITCH YAW ROLL\", or the number or name of a \
                  camera of the level"
                .to_owned(),
        ),
    }
}

/// A parser of finite numbers from `min` to `max`.
fn number(min: f64, max: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        (text.parse().ok())
            .filter(|v| (min..=max).contains(v))
            .ok_or_else(|| format!("not a number from {min} to {max}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert_eq!((r.size, r.spp, r.depth, r.seed), ((1280, 720), 64, 8, 0));
        assert_eq!((r.threshold, r.exposure, r.at), (0.5, 0.0, 0.0));
        let import = scene::import::ImportOptions::default();
        assert_eq!(r.emission_scale as f32, import.emission_scale);
        assert_eq!(r.threshold as f32, import.threshold);
        assert_eq!(r.estimator, EstimatorName::Mis);
        assert_eq!((r.lights, r.tonemap), (Lights::Auto, Tonemap::Agx));
        assert_eq!(r.layers, LayerList(vec![Layer::Beauty]));
        assert!(r.level.is_none() && r.output.is_empty() && r.camera.is_none());
    }

    #[test]
    fn cameras_are_poses_numbers_or_names() {
        let pose = CameraChoice::Pose([-1.5, 2.0, 3.0, 0.0, -90.0, 5.0]);
        assert_eq!(
            render(&["--camera", "-1.5 2 3 0 -90 5"]).camera,
            Some(pose.clone())
        );
        assert_eq!(render(&["--camera=-1.5,2,3, 0,-90,5"]).camera, Some(pose));
        assert_eq!(
            render(&["--camera", "2"]).camera,
            Some(CameraChoice::Index(2))
        );
        assert_eq!(
            render(&["--camera", "info_intermission"]).camera,
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
            ("--fov", "180"),
            ("--exr-type", "double"),
        ] {
            let error = fails(&["render", &format!("{option}={value}")]);
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(option), "{error}");
        }
        let error = fails(&["render", "--layers", "albedo,motion"]).to_string();
        assert!(
            error.contains("\"motion\"") && error.contains("indirect"),
            "{error}"
        );
    }

    #[test]
    fn options_of_later_features_are_not_there() {
        for option in [
            "--denoise=svgf",
            "--materials=a.toml",
            "--lighting=compiler",
        ] {
            assert_eq!(
                fails(&["render", option]).kind(),
                ErrorKind::UnknownArgument
            );
        }
        for command in ["demo", "view", "bench", "export"] {
            assert_eq!(fails(&[command]).kind(), ErrorKind::InvalidSubcommand);
        }
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
