//! `runelight view`.

use super::{Cli, Render};
use clap::{Args, CommandFactory as _};
use std::ffi::OsString;
use std::path::Path;

const VIEW_EXAMPLES: &str = "\
Examples:
  runelight view
      fly through the bundled sample level
  runelight view demo1.dem --basedir ~/quake
      watch a demo, and leave the player's eye
  runelight my.bsp
      without a command, a level's or a demo's file is shown
  runelight view start --basedir ~/quake --fov 100
  runelight view my.bsp --threshold 0.3 --exposure 1

F1 shows what keys do. What is set in the window are these options; the picture that P saves can be
made again by the command that is then in the clipboard.";

/// The arguments with `view` before a level's or a demo's file where no command is named: `runelight my.bsp`
/// is `runelight view my.bsp`.
#[must_use]
pub fn with_view(mut args: Vec<OsString>) -> Vec<OsString> {
    let cli = Cli::command();
    let is_command = |arg: &OsString| cli.find_subcommand(arg).is_some() || arg == "help";
    // Their values are no files to show.
    let takes_value = |arg: &OsString| {
        let known = ["--basedir", "--game", "--pak", "--device", "--color"];
        known.iter().any(|k| arg == k)
    };
    for i in 1..args.len() {
        if takes_value(&args[i - 1]) {
            continue;
        }
        let file = Path::new(&args[i]).extension();
        if is_command(&args[i]) {
            break;
        }
        if file.is_some_and(|e| e.eq_ignore_ascii_case("bsp") || e.eq_ignore_ascii_case("dem")) {
            args.insert(1, "view".into());
            break;
        }
    }
    args
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_a_command_is_shown() {
        for (given, taken) in [
            ("my.bsp", "view my.bsp"),
            ("a/My.DEM --fov 80", "view a/My.DEM --fov 80"),
            (
                "--basedir q --threshold 0.3 x.bsp",
                "view --basedir q --threshold 0.3 x.bsp",
            ),
            ("render my.bsp", "render my.bsp"),
            ("--json info my.bsp", "--json info my.bsp"),
            ("--pak old.bsp", "--pak old.bsp"),
            ("my.txt", "my.txt"),
            ("", ""),
        ] {
            let args = |text: &str| -> Vec<OsString> {
                let words = text.split_whitespace();
                ["runelight"]
                    .into_iter()
                    .chain(words)
                    .map(Into::into)
                    .collect()
            };
            assert_eq!(with_view(args(given)), args(taken), "{given}");
        }
    }
}
