//! `runelight view`.

use super::Context;
use crate::Outcome;
use crate::cli::View;
use crate::view::window;
use anyhow::Result;

/// Runs the command: shows the window until it is closed.
///
/// # Errors
/// When there is no display, no device that draws on it, or that fails.
pub fn run(args: &View, context: &Context) -> Result<Outcome> {
    args.render.picture.check()?;
    window::run(&context.global, &args.render, window::Options::default())?;
    Ok(Outcome::Done)
}
