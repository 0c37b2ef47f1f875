//! The commands, one file each.

pub mod bench;
pub mod compare;
pub mod compare_light;
pub mod demo;
pub mod devices;
pub mod export;
pub mod info;
pub mod render;
pub mod view;

use crate::Outcome;
use crate::cli::{Cli, Command, Global};
use anyhow::Result;
use clap::Parser as _;
use std::io::Write as _;
use std::time::Instant;

/// What every command is given besides its own options.
#[derive(Clone, Debug)]
pub struct Context {
    /// Options of every command.
    pub global: Global,
    /// Results as JSON.
    pub json: bool,
    /// When the process started.
    pub start: Instant,
}

impl Context {
    /// Prints a result and a line feed on stdout.
    ///
    /// # Errors
    /// When stdout is closed.
    pub fn print(&self, text: &str) -> Result<()> {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{text}")?;
        out.flush()?;
        Ok(())
    }
}

/// Runs the command asked for.
///
/// # Errors
/// What the command says.
pub fn run(cli: &Cli, start: Instant) -> Result<Outcome> {
    let context = Context {
        global: cli.global.clone(),
        json: cli.global.json,
        start,
    };
    match &cli.command {
        None => {
            // Its options with their defaults.
            let usual = Cli::try_parse_from(["runelight", "view"])?;
            match &usual.command {
                Some(Command::View(args)) => view::run(args, &context),
                _ => Ok(Outcome::Done),
            }
        }
        Some(Command::Compare(args)) => compare::run(args, &context),
        Some(Command::CompareLight(args)) => compare_light::run(args, &context),
        Some(Command::Bench(args)) => bench::run(args, &context),
        Some(Command::View(args)) => view::run(args, &context),
        Some(Command::Render(args)) => render::run(args, &context),
        Some(Command::Demo(args)) => demo::run(args, &context),
        Some(Command::Info(args)) => info::run(args, &context),
        Some(Command::Export(args)) => export::run(args, &context),
        Some(Command::Devices) => devices::run(&context),
    }
}
