//! `runelight compare-light`.

use clap::Args;
use scene::import::SUN_SAMPLES;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  runelight compare-light my.bsp
  runelight compare-light e1m1 --basedir ~/quake --extra 2 -o where.png -o light.exr
  runelight compare-light my.bsp --json --max-median 1 --max-p99 3

Differences are in units of lightmap bytes (1/255), the largest of a luxel's channels, for
each light style by itself. What radiosity (-bounce) and dirt (-dirt) add or take away is in
them: the light compilers' direct light alone is traced.

With a --max option the exit code is 3 if a figure over all luxels is larger.";

/// `runelight compare-light`
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompareLight {
    /// A .bsp file, or a name such as e1m1 or maps/e1m1.bsp to look up
    pub level: String,
    /// File to write, all faces' luxels side by side; repeatable: .png is a heat map of the
    /// differences, black (0) to bright (16 and more), green beside faces and in solid; .exr has the
    /// layers traced, baked and difference, where 1 shows a texture as it is stored
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Points to each side that stand for a luxel, as the level was compiled: 2 for -extra, 4 for
    /// -extra4
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=8))]
    pub extra: u32,
    /// Suns that stand for a sun with a penumbra, and about so many for a sky dome, as the level was
    /// compiled (-sunsamples)
    #[arg(long, value_name = "N", default_value_t = SUN_SAMPLES)]
    #[arg(value_parser = clap::value_parser!(u32).range(8..=2048))]
    pub sun_samples: u32,
    /// Most that half of the differences may be
    #[arg(
        long,
        value_name = "X",
        help_heading = "Limits: exit with 3 if exceeded"
    )]
    pub max_median: Option<f32>,
    /// Most that 99 of a hundred differences may be
    #[arg(
        long,
        value_name = "X",
        help_heading = "Limits: exit with 3 if exceeded"
    )]
    pub max_p99: Option<f32>,
}
