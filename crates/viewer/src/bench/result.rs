//! What a bench found, as it stands in `bench.json`.

use super::stats::{Estimate, finite};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the file's form; a file of another version is not read.
pub const FORMAT: u32 = 1;

/// A whole run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Bench {
    /// [`FORMAT`].
    pub format: u32,
    /// Version of the program.
    pub program: String,
    /// What it ran on.
    pub machine: Machine,
    /// The device that rendered.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Whether everything that was planned was measured.
    pub complete: bool,
    /// Wall seconds of the whole run, references included.
    pub seconds: f64,
    /// One per level and camera.
    pub views: Vec<View>,
}

/// A computer, as far as it matters for speed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor.
    pub cpu: String,
    /// Threads that may run at once.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// A level from a camera.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct View {
    /// Level's name.
    pub level: String,
    /// Camera's name, and its number among the level's cameras if it is one of them.
    pub camera: String,
    /// Eye in Quake units; pitch, yaw and roll in degrees.
    pub pose: [f32; 6],
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Path vertices after the camera.
    pub depth: u32,
    /// What was lit (`--lights`).
    pub lights: String,
    /// SHA-256 of the scene; see [`super::identity`].
    pub level_hash: String,
    /// SHA-256 of the settings; see [`super::identity`].
    pub settings_hash: String,
    /// SHA-256 of what was planned for this view: curves, budgets, repeats, seed, device.
    pub plan_hash: String,
    /// Triangles as rays can meet them.
    pub triangles: usize,
    /// Emissive triangles and light entities.
    pub emitters: usize,
    /// Whether no ray should leave the level.
    pub sealed: bool,
    /// Processor cores that the program had while it was measured, on average. On a machine that
    /// does other work it is less than the renderer would use.
    #[serde(with = "finite")]
    pub cores: f64,
    /// What it was measured against.
    pub reference: ReferenceNote,
    /// One per estimator and way to choose lights.
    pub curves: Vec<Curve>,
}

/// About a reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceNote {
    /// The file.
    pub file: String,
    /// The device that made it.
    pub device: String,
    /// Estimator.
    pub estimator: String,
    /// Seed of its first batch.
    pub seed: u64,
    /// Samples per pixel over all batches.
    pub samples: u64,
    /// Independent batches.
    pub batches: u32,
    /// Its own relMSE, from the variance between its batches.
    #[serde(with = "finite")]
    pub relmse: f64,
    /// The relMSE that was wanted: a twentieth of the smallest measured.
    #[serde(with = "finite")]
    pub wanted: f64,
    /// Seconds spent on it in this run.
    pub seconds: f64,
}

impl ReferenceNote {
    /// Whether it is as good as wanted.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.relmse <= self.wanted
    }
}

/// An estimator with a way to choose lights, over all budgets.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Curve {
    /// Estimator.
    pub estimator: String,
    /// How lights are chosen; `-` for estimators that choose none.
    pub selection: String,
    /// Whether it finds all the light that the reference holds. Where it does not (`naive` and
    /// `uniform` in scenes with light entities), its error is also what it lacks, and neither a
    /// bias nor a speed-up is given.
    pub sees_all_light: bool,
    /// One per budget, sample budgets first.
    pub points: Vec<Point>,
    /// Whether its expectation is the reference's.
    pub bias: Option<Bias>,
}

impl Curve {
    /// `mis power`, `naive`.
    #[must_use]
    pub fn name(&self) -> String {
        match self.selection.as_str() {
            "-" => self.estimator.clone(),
            selection => format!("{} {selection}", self.estimator),
        }
    }
}

/// How long to render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// Samples per pixel.
    Samples(u32),
    /// Seconds of rendering.
    Seconds(f64),
}

impl std::fmt::Display for Budget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Samples(n) => write!(f, "{n} spp"),
            Self::Seconds(s) => write!(f, "{s} s"),
        }
    }
}

/// One budget of a curve. Intervals are Student's over the independent repeats; with a single
/// repeat those of the metrics are over the pixels, and the others are missing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// What was allowed.
    pub budget: Budget,
    /// Samples per pixel that were taken; the mean of the repeats.
    pub samples: f64,
    /// Seconds of rendering: no loading, no pipelines, no first dispatch, no read-back.
    pub seconds: Estimate,
    /// Paths of a repeat.
    pub paths: f64,
    /// Rays of a repeat.
    pub rays: f64,
    /// Millions of paths a second.
    pub mpaths_per_s: Estimate,
    /// Millions of rays a second.
    pub mrays_per_s: Estimate,
    /// The metrics of `compare` against the reference as it is, its own error included.
    pub metrics: BTreeMap<String, Estimate>,
    /// `mse`, `rmse` and `relmse` less what the reference's own error adds in expectation:
    /// `E (I - R)^2 = var I + var R + bias^2`.
    pub corrected: BTreeMap<String, Estimate>,
    /// `1 / (relmse seconds)`, with the corrected relMSE.
    pub efficiency: Estimate,
    /// Over `naive`.
    pub speedup: Option<Speedup>,
    /// The renderer's own estimate of its relMSE, without any reference.
    #[serde(with = "finite")]
    pub estimated_relmse: f64,
    /// Samples that were not finite, over all repeats.
    pub nonfinite: u64,
    /// Rays that left the level, over all repeats.
    pub escaped: u64,
    /// The same per 1e9 rays.
    #[serde(with = "finite")]
    pub escaped_per_1e9: f64,
    /// Corrected relMSE of every repeat.
    pub relmse_runs: Vec<f64>,
    /// Seconds of every repeat.
    pub seconds_runs: Vec<f64>,
}

impl Point {
    /// The corrected relMSE.
    #[must_use]
    pub fn relmse(&self) -> Estimate {
        self.corrected
            .get("relmse")
            .copied()
            .unwrap_or(Estimate::NONE)
    }
}

/// How much faster than `naive` the same error is reached.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Speedup {
    /// Seconds of `naive` at this point's error, over this point's seconds.
    pub factor: Estimate,
    /// Whether `naive` was not measured at this error, so that its curve was continued as 1/N.
    pub beyond_curve: bool,
}

/// Whether a curve's expectation is the reference's; see [`super::bias`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Bias {
    /// Slope of log relMSE over log N; -1 without bias.
    pub slope: Estimate,
    /// p-value of that slope being -1.
    #[serde(with = "finite")]
    pub slope_p: f64,
    /// Growth of relMSE times N per factor of ten in N, as a share of it; 0 without bias.
    pub growth: Estimate,
    /// p-value of no such growth.
    #[serde(with = "finite")]
    pub growth_p: f64,
    /// Difference of the mean radiance from the reference's in standard errors, by channel.
    pub mean_z: [f64; 3],
    /// p-value of the largest of these (Sidak over the channels).
    #[serde(with = "finite")]
    pub mean_p: f64,
    /// Mean radiance over the reference's.
    pub mean_ratio: Estimate,
    /// Tiles of the picture that were tested.
    pub tiles: usize,
    /// The largest difference of a tile's mean in standard errors.
    #[serde(with = "finite")]
    pub tile_z: f64,
    /// p-value of that (Sidak over tiles and channels).
    #[serde(with = "finite")]
    pub tile_p: f64,
    /// Share of the pixels' channels that noise explains at 0.01 (Sidak over all). Told, not
    /// judged: a pixel whose samples all missed a lamp has no variance to explain anything.
    #[serde(with = "finite")]
    pub pixels_within: f64,
    /// Relative shift of the mean radiance that the mean's test finds nine times in ten.
    #[serde(with = "finite")]
    pub detects: f64,
    /// p-value of all of these together.
    #[serde(with = "finite")]
    pub p: f64,
    /// Whether that is significant, at 0.01 over all curves of the run.
    pub biased: bool,
}
