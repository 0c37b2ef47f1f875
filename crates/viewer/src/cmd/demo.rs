//! `runelight demo`.

use super::{Context, info};
use crate::cli::Demo;
use crate::{Outcome, clip, demo};
use anyhow::{Context as _, Result};
use bsp::Warnings;
use serde_json::{Map, Value};

/// Runs the command: renders frames, or lists what the demo holds.
///
/// # Errors
/// When the demo is not found or is none that can be read; what [`clip::run`] says.
pub fn run(args: &Demo, context: &Context) -> Result<Outcome> {
    if !args.output.is_empty() {
        return clip::run(args, context);
    }
    let bytes = demo::read(args.demo.as_deref(), &context.global)?;
    let mut warnings = Warnings::new();
    let told = demo::describe(&bytes, context.json, &mut warnings)
        .with_context(|| args.name().to_owned())?;
    let mut map = Map::new();
    map.insert("demo".into(), args.name().into());
    map.extend(told);
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    map.insert("warnings".into(), warnings.into());
    context.print(&if context.json {
        Value::Object(map).to_string()
    } else {
        info::text(&map)
    })?;
    Ok(Outcome::Done)
}
