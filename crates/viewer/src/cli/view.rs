//! `runelight view`.

use super::Render;
use clap::Args;

const VIEW_EXAMPLES: &str = "\
Examples:
  runelight view
      fly through the bundled sample level
  runelight view demo1.dem --basedir ~/quake
      watch a demo, and leave the player's eye
  runelight view start --basedir ~/quake --fov 100
  runelight view my.bsp --threshold 0.3 --exposure 1

F1 shows what keys do. What is set in the window are these options; the picture that P saves can be
made again by the command that is then in the clipboard.";

/// `runelight view`
#[derive(Debug, Args)]
#[command(after_help = VIEW_EXAMPLES)]
#[command(mut_arg("spp", |arg| arg.default_value("65536")))]
#[command(mut_arg("layers", |arg| arg.default_value("all")))]
#[command(mut_arg("output", |arg| arg.hide(true)))]
#[command(mut_arg("size", |arg| arg.hide(true)))]
#[command(mut_arg("adaptive", |arg| arg.hide(true)))]
#[command(mut_arg("time_limit", |arg| arg.help("Seconds of work after which a picture is done")))]
pub struct View {
    /// What is shown, and how.
    #[command(flatten)]
    pub render: Render,
}
