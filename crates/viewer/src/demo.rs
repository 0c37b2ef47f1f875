//! Demos by their names on the command line, and what they hold.

use crate::bundled;
use crate::cli::Global;
use crate::level::search_path;
use anyhow::{Context as _, Result, bail};
use bsp::dem::{LevelSummary, Summary, flag};
use bsp::mdl::MdlHeader;
use bsp::{Limits, Warnings};
use scene::timeline::Timeline;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The bytes of a demo: a file, or a name to look up, with or without `.dem`; `None` is the bundled demo.
///
/// # Errors
/// When there is none, or it cannot be read.
pub fn read(wanted: Option<&str>, global: &Global) -> Result<Vec<u8>> {
    let Some(wanted) = wanted else {
        return Ok(bundled::DEMO.to_vec());
    };
    let path = Path::new(wanted);
    if path.is_file() {
        let size = path.metadata().map_or(0, |m| m.len());
        let limits = Limits::default();
        limits.check_file(size).map_err(|e| e.in_file(wanted))?;
        return std::fs::read(path).with_context(|| format!("{wanted} cannot be read"));
    }
    let search = search_path(global)?;
    for name in [wanted.to_owned(), format!("{wanted}.dem")] {
        if let Some(found) = search.read_optional(&name)? {
            return Ok(found.bytes);
        }
    }
    if search.is_empty() {
        bail!(
            "{wanted}: there is no such file, and without --basedir or --pak there is nowhere to \
             look the name up"
        );
    }
    bail!("{wanted}: there is no such demo")
}

/// A demo as a function of time.
///
/// # Errors
/// When the bytes are no demo that is read here, or show nothing.
pub fn timeline(bytes: &[u8], global: &Global) -> Result<Timeline> {
    let mut warnings = Warnings::new();
    let demo = bsp::dem::Demo::parse(bytes, &Limits::default(), &mut warnings)?;
    let search = search_path(global)?;
    let flags = |model: &str| {
        let found = search.read_optional(model).ok()??;
        Some(MdlHeader::parse(&found.bytes).ok()?.flags)
    };
    let timeline = Timeline::new(&demo, &flags, &mut warnings);
    for warning in warnings.iter() {
        tracing::warn!("{warning}");
    }
    if timeline.messages() == 0 {
        bail!("the demo shows no moment of a level");
    }
    Ok(timeline)
}

/// What a demo holds. `entities` lists how many there are in each second.
///
/// # Errors
/// When the bytes are no demo that is read here.
pub fn describe(
    bytes: &[u8],
    entities: bool,
    warnings: &mut Warnings,
) -> Result<Map<String, Value>> {
    let demo = bsp::dem::Demo::parse(bytes, &Limits::default(), warnings)?;
    let summary = Summary::of(&demo, warnings);
    let mut map = Map::new();
    map.insert("cd_track".into(), summary.cd_track.into());
    map.insert("protocol".into(), protocols(&summary).into());
    map.insert("seconds".into(), rounded(summary.seconds()));
    map.insert("blocks".into(), summary.blocks.into());
    let messages: u64 = summary.messages.values().sum();
    map.insert("messages".into(), messages.into());
    let levels: Vec<Value> = summary.levels.iter().map(|l| level(l, entities)).collect();
    map.insert("levels".into(), levels.into());
    let mut kinds: Vec<(&str, u64)> = summary.messages.iter().map(|(k, n)| (*k, *n)).collect();
    kinds.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let kinds: Map<String, Value> = (kinds.into_iter())
        .map(|(kind, n)| (kind.to_owned(), n.into()))
        .collect();
    map.insert("message_kinds".into(), kinds.into());
    Ok(map)
}

/// Milliseconds are enough.
fn rounded(seconds: f64) -> Value {
    ((seconds * 1000.0).round() / 1000.0).into()
}

/// The protocols of the levels, each once.
fn protocols(summary: &Summary) -> String {
    let mut names: Vec<String> = summary.levels.iter().map(protocol).collect();
    names.dedup();
    names.join(", ")
}

/// A protocol as engines name it: `999 (32-bit coordinates, 16-bit angles)`.
fn protocol(level: &LevelSummary) -> String {
    let flags = [
        (flag::SHORT_ANGLE, "16-bit angles"),
        (flag::FLOAT_ANGLE, "float angles"),
        (flag::COORD_24BIT, "24-bit coordinates"),
        (flag::FLOAT_COORD, "float coordinates"),
        (flag::INT32_COORD, "32-bit coordinates"),
    ];
    let told: Vec<&str> = (flags.into_iter())
        .filter(|(bit, _)| level.flags & bit != 0)
        .map(|(_, name)| name)
        .collect();
    let fte = if level.extensions == [0; 2] {
        ""
    } else {
        "fte"
    };
    let number = level.protocol;
    if told.is_empty() {
        return format!("{fte}{number}");
    }
    format!("{fte}{number} ({})", told.join(", "))
}

fn level(level: &LevelSummary, entities: bool) -> Value {
    let [first, last] = level.clock;
    let mut told = json!({
        "map": level.map,
        "title": level.title.trim(),
        "protocol": level.protocol,
        "flags": level.flags,
        "seconds": rounded(level.seconds),
        "clock": [rounded(first.into()), rounded(last.into())],
        "blocks": level.blocks,
        "models": level.models,
        "sounds": level.sounds,
        "max_players": level.max_players,
        "entities": level.entities,
        "most_entities": level.entities_per_second.iter().max().copied().unwrap_or(0),
        "statics": level.statics,
    });
    if entities {
        told["entities_per_second"] = level.entities_per_second.clone().into();
    }
    told
}
