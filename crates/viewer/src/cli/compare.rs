//! `runelight compare`.

use clap::Args;
use std::path::PathBuf;

const COMPARE_EXAMPLES: &str = "\
Examples:
  runelight compare truth.exr test.exr
  runelight compare truth.exr test.exr --max-relmse 0.01 --heatmap where.png
  runelight compare truth.exr test.exr --layer denoised --reference-layer beauty

With a --max option the exit code is 3 if the error is larger, or not a number.";

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
    /// Layer of the reference, where that is another one [default: that of --layer]
    #[arg(long, value_name = "NAME")]
    pub reference_layer: Option<String>,
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
