//! `runelight export`.

use super::shared::{SceneArgs, ViewArgs};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const EXPORT_EXAMPLES: &str = "\
Examples:
  runelight export -o sample-mitsuba
      the bundled sample level for Mitsuba 3; then: mitsuba -m llvm_ad_rgb scene.xml
  runelight export e1m1 --basedir ~/quake --camera 2 --size 640x360 --spp 256 -o e1m1-mitsuba
  runelight export e1m1 --format gltf -o e1m1-gltf
      for Blender and others, a directory with scene.gltf, scene.bin and PNGs
  runelight export e1m1 --format gltf -o e1m1.glb
      the same in one file

The directory is written beside its place and moved there when it is complete. It
may be missing, empty, or an earlier export, which is replaced; files in it that the
export did not write stay. Any other directory is refused.

runelight-export.json in it lists the files, the offset of the coordinates, and what
the other renderer shows otherwise (\"exact\", \"differences\").";

/// `runelight export`
#[derive(Debug, Args)]
#[command(after_help = EXPORT_EXAMPLES)]
pub struct Export {
    /// A .bsp file, or a name such as e1m1 or maps/e1m1.bsp to look up; without it the bundled
    /// sample level
    pub level: Option<String>,

    /// For whom
    #[arg(
        long,
        value_name = "NAME",
        default_value = "mitsuba",
        help_heading = "Output"
    )]
    pub format: ExportFormat,
    /// Directory to write; for glTF also a file that ends in .glb
    /// [default: LEVEL-FORMAT here]
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub output: Option<PathBuf>,

    /// Samples per pixel that Mitsuba takes
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub spp: u32,
    /// Path vertices after the camera, as for render; 0 is without limit (Russian roulette)
    #[arg(long, value_name = "N", default_value_t = 8, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub depth: u32,
    /// Seed that Mitsuba starts with
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=0x7fff_ffff))]
    pub seed: u32,

    /// The picture.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
}

/// `--format`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// Mitsuba 3: the same picture, as a second opinion
    Mitsuba,
    /// glTF 2.0: geometry, textures, lights and cameras, for editors
    Gltf,
}

impl ExportFormat {
    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mitsuba => "mitsuba",
            Self::Gltf => "gltf",
        }
    }
}
