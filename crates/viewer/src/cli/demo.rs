//! `runelight demo`.

use clap::Args;

const DEMO_EXAMPLES: &str = "\
Examples:
  runelight demo demo1 --basedir ~/quake
      what the first demo of a Quake installation holds
  runelight demo my.dem --json
      the same as JSON, with the entities of every second";

/// `runelight demo`
#[derive(Debug, Args)]
#[command(after_help = DEMO_EXAMPLES)]
pub struct Demo {
    /// A .dem file, or a name such as demo1 to look up
    pub demo: String,
}
