//! The command line of Runelight: everything between people and the renderers.

pub mod adaptive;
pub mod bench;
pub mod bundled;
pub mod cli;
pub mod clip;
pub mod cmd;
pub mod demo;
pub mod denoise;
pub mod device;
pub mod escapes;
pub mod export;
pub mod interrupt;
pub mod job;
pub mod level;
pub mod luxels;
pub mod metrics;
pub mod output;
pub mod picture;
pub mod progress;
mod shot;
pub mod tonemap;
pub mod view;

use clap::{ColorChoice, CommandFactory as _, FromArgMatches as _};
use std::io::IsTerminal as _;
use std::process::ExitCode;
use std::time::Instant;
use tracing::Level;

/// How a command that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It did what it was asked.
    Done,
    /// `compare`: a limit given is exceeded; `bench`: a regression, a bias or a hard case that fails.
    LimitExceeded,
}

/// What was asked makes no sense, whatever the files hold.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Usage {}

/// Runs the program with the process's arguments: 0 done, 1 could not do it, 2 wrong usage, 3 a
/// limit of `compare` or `bench` is exceeded.
#[must_use]
pub fn main() -> ExitCode {
    let start = Instant::now();
    let args = cli::with_view(std::env::args_os().collect());
    let command = cli::Cli::command().color(color_asked());
    let matches = match command.try_get_matches_from(args) {
        Ok(matches) => matches,
        Err(error) => {
            // Help and version come this way too, with the code 0. A closed pipe is no error.
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    let cli = match cli::Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    start_logging(&cli.global);
    match cmd::run(&cli, start) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::LimitExceeded) => ExitCode::from(3),
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.is::<Usage>() { 2 } else { 1 })
        }
    }
}

/// The value of `--color`, needed before the arguments are parsed: errors are coloured too.
fn color_asked() -> ColorChoice {
    let args: Vec<_> = std::env::args_os().collect();
    let value = args.iter().enumerate().find_map(|(i, arg)| {
        let arg = arg.to_str()?;
        if arg == "--color" {
            return args.get(i + 1)?.to_str();
        }
        arg.strip_prefix("--color=")
    });
    match value {
        Some("always") => ColorChoice::Always,
        Some("never") => ColorChoice::Never,
        _ => ColorChoice::Auto,
    }
}

/// Sends messages of all rooms to stderr: warnings, and more with `-v`.
fn start_logging(global: &cli::Global) {
    let level = match (global.quiet, global.verbose) {
        (true, _) => Level::ERROR,
        (_, 0) => Level::WARN,
        (_, 1) => Level::INFO,
        (_, 2) => Level::DEBUG,
        (_, _) => Level::TRACE,
    };
    let ansi = match global.color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => std::io::stderr().is_terminal(),
    };
    // A second start in one process (tests) keeps the first.
    let _ = tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_max_level(level)
        .with_ansi(ansi)
        .with_target(false)
        .without_time()
        .try_init();
}

fn is_closed_pipe(error: &anyhow::Error) -> bool {
    (error.downcast_ref::<std::io::Error>())
        .is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}
