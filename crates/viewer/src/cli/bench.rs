//! `runelight bench`.

use super::shared::{CameraChoice, SamplerName, SceneArgs, number, parse_camera, parse_size};
use clap::Args;
use scene::render::{CANDIDATES, Estimator, MOST_CANDIDATES, Selection};
use std::path::PathBuf;

const BENCH_EXAMPLES: &str = "\
Examples:
  runelight bench --quick
  runelight bench --suite --basedir ~/quake -o suite
  runelight bench start e1m1 --basedir ~/quake --cameras \"0;1\" --spp 16,64,256 --seconds 1,10
  runelight bench --quick --baseline before/bench.json
  runelight bench --hard --paths 1e9 -o hard

Errors are measured against a reference: a picture of the mis estimator with at least 8
independent batches, from whose spread its own error is known. It is made when it is missing or
too poor, wanted with a twentieth of the smallest error measured, and kept in
$XDG_CACHE_HOME/runelight/references. A reference of a level or settings that have changed since
is not used. Its own error is subtracted from mse, rmse and relmse (bench.json keeps both).

Intervals are of 95 %, Student's over the repeats. `speed-up` is the time of naive at the same
error over the time taken; `~` where naive's curve was continued to get there. The bias tests and
what p-values mean are described in docs/performance.md.

naive and uniform cannot find light entities: --quick and --suite light by textures unless
--lights says otherwise, and in a scene with light entities neither is called biased.

The first Ctrl-C ends the bench and writes what is finished. Exit codes: 3 if --baseline finds a
regression, --fail-on-bias a bias, or a case of --hard fails.";

/// `runelight bench`
#[derive(Debug, Args)]
#[command(after_help = BENCH_EXAMPLES)]
pub struct Bench {
    /// Levels, as for render; without any, the bundled one, or those of --suite
    #[arg(value_name = "LEVEL")]
    pub levels: Vec<String>,

    /// Two minutes on two processor cores: two views of the bundled level
    #[arg(long, conflicts_with = "suite", help_heading = "What is measured")]
    pub quick: bool,
    /// The full one: the bundled level and four of LibreQuake, as far as they are found
    #[arg(long, help_heading = "What is measured")]
    pub suite: bool,
    /// Scenes with known answers that are hard to compute, instead of pictures of levels
    #[arg(
        long,
        help_heading = "What is measured",
        conflicts_with_all = ["quick", "suite", "levels", "baseline"]
    )]
    pub hard: bool,
    /// Paths for all of --hard together [default: as many as a test takes]
    #[arg(
        long,
        value_name = "N",
        requires = "hard",
        help_heading = "What is measured"
    )]
    #[arg(value_parser = parse_count)]
    pub paths: Option<u64>,
    /// Cameras of every level, separated by semicolons: numbers, names, or poses as for
    /// render --camera [default: the first]
    #[arg(long, value_name = "LIST", help_heading = "What is measured")]
    #[arg(value_parser = parse_cameras, allow_hyphen_values = true)]
    pub cameras: Option<List<CameraChoice>>,
    /// Estimators, separated by commas
    #[arg(long, value_name = "LIST", default_value = "naive,uniform,nee,mis")]
    #[arg(value_parser = parse_estimators, help_heading = "What is measured")]
    pub estimators: List<Estimator>,
    /// How lights are chosen, separated by commas: power, uniform, leaf
    #[arg(long, value_name = "LIST", default_value = "power,leaf")]
    #[arg(value_parser = parse_selections, help_heading = "What is measured")]
    pub selections: List<Selection>,
    /// Light samples of which one is kept and looked at with a shadow ray; see render
    #[arg(long, value_name = "N", default_value_t = CANDIDATES, help_heading = "What is measured")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_CANDIDATES)))]
    pub candidates: u32,
    /// Where random numbers come from
    #[arg(
        long,
        value_name = "NAME",
        default_value = "independent",
        help_heading = "What is measured"
    )]
    pub sampler: SamplerName,
    /// Equal samples: samples per pixel, separated by commas [default: 16,64,256,1024]
    #[arg(long, value_name = "LIST", help_heading = "What is measured")]
    #[arg(value_parser = parse_spp)]
    pub spp: Option<List<u32>>,
    /// Equal time: seconds of rendering, separated by commas
    #[arg(long, value_name = "LIST", help_heading = "What is measured")]
    #[arg(value_parser = parse_seconds)]
    pub seconds: Option<List<f64>>,
    /// Picture size in pixels [default: 320x180]
    #[arg(long, value_name = "WxH", help_heading = "What is measured", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Path vertices after the camera, as for render [default: 8]
    #[arg(long, value_name = "N", help_heading = "What is measured")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub depth: Option<u32>,
    /// Independent runs of everything, from whose spread the intervals come [default: 4]
    #[arg(long, value_name = "N", help_heading = "What is measured")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: Option<u32>,
    /// Seed of the first run
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        help_heading = "What is measured"
    )]
    pub seed: u64,

    /// Seconds that a view's reference may take; said when that was too little [default: 120]
    #[arg(long, value_name = "S", help_heading = "Reference", value_parser = number(0.1, 1e7))]
    pub reference_seconds: Option<f64>,
    /// A reference to use as it is, for a single view; refused if it is not of this view
    #[arg(long, value_name = "FILE.exr", help_heading = "Reference")]
    pub reference: Option<PathBuf>,

    /// Folder for bench.json, bench.csv and the plots, made if it is missing [default: bench]; for
    /// hard.json and hard.txt of --hard, which writes them only where this says
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Start no further view, or picture of --hard, this many seconds after the start
    #[arg(long, value_name = "S", help_heading = "Output", value_parser = number(1.0, 1e7))]
    pub time_limit: Option<f64>,
    /// Take over the views that the folder's bench.json already holds
    #[arg(long, help_heading = "Output")]
    pub resume: bool,
    /// An earlier bench.json to compare with: exit with 3 if something became worse than noise
    /// explains
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub baseline: Option<PathBuf>,
    /// What a figure may become worse by besides noise, as a share
    #[arg(
        long,
        value_name = "X",
        default_value_t = 0.05,
        help_heading = "Output"
    )]
    #[arg(value_parser = number(0.0, 10.0))]
    pub tolerance: f64,
    /// Exit with 3 if a curve is called biased
    #[arg(long, help_heading = "Output")]
    pub fail_on_bias: bool,

    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
}

/// A list in one option.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T>(pub Vec<T>);

/// Splits at `separator` and reads every item.
fn list<T>(
    text: &str,
    separator: char,
    item: impl Fn(&str) -> Result<T, String>,
) -> Result<List<T>, String> {
    let items: Vec<T> = (text.split(separator).map(str::trim))
        .filter(|word| !word.is_empty())
        .map(item)
        .collect::<Result<_, _>>()?;
    if items.is_empty() {
        return Err("an empty list".to_owned());
    }
    Ok(List(items))
}

fn parse_cameras(text: &str) -> Result<List<CameraChoice>, String> {
    list(text, ';', parse_camera)
}

fn parse_estimators(text: &str) -> Result<List<Estimator>, String> {
    list(text, ',', |word| {
        named(word, &Estimator::ALL, Estimator::name)
    })
}

fn parse_selections(text: &str) -> Result<List<Selection>, String> {
    list(text, ',', |word| {
        named(word, &Selection::ALL, Selection::name)
    })
}

fn named<T: Copy>(word: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    (all.iter().copied().find(|x| name(*x) == word)).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|x| name(*x)).collect();
        format!("{word:?} is none of {}", names.join(", "))
    })
}

fn parse_spp(text: &str) -> Result<List<u32>, String> {
    list(text, ',', |word| {
        (word.parse().ok().filter(|n| (2..=1 << 24).contains(n)))
            .ok_or_else(|| format!("{word:?} is no number of samples from 2 to {}", 1 << 24))
    })
}

fn parse_seconds(text: &str) -> Result<List<f64>, String> {
    list(text, ',', number(1e-3, 1e6))
}

/// A whole number, also as 1e9.
fn parse_count(text: &str) -> Result<u64, String> {
    let number: f64 = (text.parse()).map_err(|_| "not a number".to_owned())?;
    if (1.0..=1e15).contains(&number) && number.fract() == 0.0 {
        Ok(number as u64)
    } else {
        Err("not a whole number from 1 to 1e15".to_owned())
    }
}
