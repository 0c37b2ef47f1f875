//! `runelight render`.

use super::shared::{
    EstimatorName, LightingName, SamplerName, SceneArgs, SelectionName, ViewArgs, number,
};
use crate::denoise::Denoise;
use crate::output::Layer;
use crate::tonemap::Tonemap;
use clap::{Args, ValueEnum};
use scene::render::{CANDIDATES, MOST_CANDIDATES};
use std::path::PathBuf;

const RENDER_EXAMPLES: &str = "\
Examples:
  runelight render start --basedir ~/quake --size 640x360 --spp 16
  runelight render start --camera \"544 288 54 10 90 0\" --exposure 1
  runelight render start --layers albedo,normal,depth -o start.exr
  runelight render start --target-error 0.005 --spp 100000
  runelight render dark.bsp --estimator naive --depth 3

The first Ctrl-C ends the picture after the samples under way and writes it; the
second one gives up and writes nothing.";

/// `runelight render`
#[derive(Clone, Debug, PartialEq, Args)]
#[command(after_help = RENDER_EXAMPLES)]
pub struct Render {
    /// A .bsp file, or a name such as e1m1 or maps/e1m1.bsp to look up; without it the bundled
    /// sample level
    pub level: Option<String>,

    /// File to write, .exr (scene-linear, all layers) or .png (tone-mapped, 8 bit); repeatable
    /// [default: LEVEL.exr and LEVEL.png here]
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,
    /// The picture.
    #[command(flatten)]
    pub picture: PictureArgs,
}

/// How a picture is made, and how it is encoded: all but what it shows and where it goes.
#[derive(Clone, Debug, PartialEq, Args)]
pub struct PictureArgs {
    /// Layers of the EXR besides beauty, separated by commas: albedo, normal, depth, position,
    /// emission, direct, indirect, motion (pixels to where it was in the frame before), variance,
    /// samples, id; or all. Besides, style: light by light style at brightness 1, as style.N, so that
    /// a picture can be relit: it is the sum over brightness times style.N, with the brightnesses of
    /// the attribute runelight:styles
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
    /// Filter the noise out of a PNG, and into the layer denoised of an EXR; its other layers stay what was traced.
    /// For looking: it blurs what it takes for noise, and no error is measured on it
    #[arg(
        long,
        value_name = "NAME",
        default_value = "none",
        help_heading = "Output"
    )]
    pub denoise: Denoise,
    /// Tone curve of a PNG
    #[arg(
        long,
        value_name = "NAME",
        default_value = "agx",
        help_heading = "Output"
    )]
    pub tonemap: Tonemap,

    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub spp: u32,
    /// Take no further samples this many seconds after the start, loading included
    #[arg(long, value_name = "S", help_heading = "Quality", value_parser = number(1e-3, 1e7))]
    pub time_limit: Option<f64>,
    /// Stop once the estimated relMSE of the picture is below this; --spp is still the most samples
    /// that are taken
    #[arg(long, value_name = "E", help_heading = "Quality", value_parser = number(1e-12, 1e6))]
    pub target_error: Option<f64>,
    /// Spread the samples by what the first ones (16 to 64) saw: more where neighbouring pixels are
    /// noisy. --spp is then the mean over the picture, which stays unbiased
    #[arg(long, help_heading = "Quality")]
    pub adaptive: bool,
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
    /// How a light is chosen by the estimators that sample lights
    #[arg(
        long,
        value_name = "NAME",
        default_value = "auto",
        help_heading = "Quality"
    )]
    pub selection: SelectionName,
    /// What lights the level. Other than physical is for comparison: compiler has light entities and
    /// suns by the light compilers' formulas, direct light alone (--depth 2 at most, --estimator
    /// nee); lightmap is the level's own baked light and fullbright its plain textures (--depth 1)
    #[arg(
        long,
        value_name = "MODEL",
        default_value = "physical",
        help_heading = "Light"
    )]
    pub lighting: LightingName,
    /// Light samples of which one is kept, by what each would add, and looked at with a shadow ray; by leaf on
    /// surfaces, four times as many lights are weighed and one is sampled
    #[arg(long, value_name = "N", default_value_t = CANDIDATES, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_CANDIDATES)))]
    pub candidates: u32,
    /// Darken samples that add more than this radiance to what is seen shining: fewer bright dots, and
    /// some light lost, which is reported [default: off]
    #[arg(long, value_name = "X", help_heading = "Quality", value_parser = number(1e-6, 1e6))]
    pub clamp: Option<f64>,
    /// Where random numbers come from
    #[arg(
        long,
        value_name = "NAME",
        default_value = "sobol",
        help_heading = "Quality"
    )]
    pub sampler: SamplerName,
    /// Same seed, same device, same picture bit for bit
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality")]
    pub seed: u64,

    /// The picture.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
}

/// `--exr-type`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExrType {
    /// 16 bits: smaller files, about three digits
    Half,
    /// 32 bits
    Float,
}

/// `--layers`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerList(pub Vec<Layer>);

fn parse_layers(text: &str) -> Result<LayerList, String> {
    Layer::parse_list(text).map(LayerList)
}
