//! `runelight info`.

mod level;
mod model;

use super::Context;
use crate::cli::Info;
use crate::level::{Source, search_path};
use crate::{Outcome, demo};
use anyhow::{Context as _, Result, bail};
use bsp::lmp::{FIRST_FULLBRIGHT, Palette, Picture};
use bsp::pak::PakFile;
use bsp::wad::{Wad, lump_type};
use bsp::{FileKind, Limits, Warnings, sniff};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Runs the command. A file that cannot be read does not keep the others from being told of.
///
/// # Errors
/// When one of several files cannot be read, after all others; of a single file its own error.
pub fn run(args: &Info, context: &Context) -> Result<Outcome> {
    let mut failed = 0;
    for (index, file) in args.files.iter().enumerate() {
        match describe(file, args, context) {
            Ok(found) if context.json => context.print(&Value::Object(found).to_string())?,
            Ok(found) => {
                let gap = if index > 0 { "\n" } else { "" };
                context.print(&format!("{gap}{}", text(&found)))?;
            }
            Err(error) if args.files.len() == 1 => return Err(error),
            Err(error) => {
                eprintln!("error: {error:#}");
                failed += 1;
            }
        }
    }
    if failed > 0 {
        bail!("{failed} of {} files could not be read", args.files.len());
    }
    Ok(Outcome::Done)
}

/// What one file holds.
fn describe(file: &str, args: &Info, context: &Context) -> Result<Map<String, Value>> {
    let limits = Limits::default();
    let path = Path::new(file);
    if path.is_dir() {
        bail!("{file} is a directory");
    }
    let bytes = if path.is_file() {
        let mut warnings = Warnings::new();
        if let Ok(pak) = PakFile::open(path, &limits, &mut warnings) {
            return Ok(describe_pak(file, &pak, &warnings));
        }
        let size = path.metadata().map_or(0, |m| m.len());
        limits.check_file(size).map_err(|e| e.in_file(file))?;
        std::fs::read(path).with_context(|| format!("{file} cannot be read"))?
    } else {
        let search = search_path(&context.global)?;
        match search.read_optional(file) {
            Ok(Some(found)) => found.bytes,
            // A name without extension is a level's.
            _ => return level::describe(file, Source::new(Some(file), &context.global)?, args),
        }
    };
    let kind = sniff(&bytes);
    let size = bytes.len();
    let mut warnings = Warnings::new();
    let told = match kind {
        FileKind::Bsp(_) | FileKind::BspHalfLife | FileKind::BspQuake64 | FileKind::BspQuake2 => {
            return level::describe(file, Source::new(Some(file), &context.global)?, args);
        }
        // The file was no archive that could be opened: this says why.
        FileKind::Pak => bail!(
            bsp::pak::Directory::parse(&bytes, &limits, &mut warnings)
                .map_or_else(|e| e, |_| unreadable_pak())
                .in_file(file)
        ),
        FileKind::Wad2 | FileKind::Wad3 => describe_wad(
            &bytes,
            &Wad::parse(&bytes, &limits, &mut warnings).map_err(|e| e.in_file(file))?,
            &limits,
        ),
        FileKind::Mdl => {
            model::describe_mdl(&bytes, &limits, &mut warnings).map_err(|e| e.in_file(file))?
        }
        FileKind::Spr => {
            model::describe_spr(&bytes, &limits, &mut warnings).map_err(|e| e.in_file(file))?
        }
        FileKind::Demo => {
            Value::Object(demo::describe(&bytes, false, &mut warnings).context(file.to_owned())?)
        }
        FileKind::Palette => {
            describe_palette(&Palette::parse(&bytes).map_err(|e| e.in_file(file))?)
        }
        FileKind::Picture => {
            let picture = Picture::parse(&bytes, &limits, &mut warnings);
            let picture = picture.map_err(|e| e.in_file(file))?;
            json!({ "size": format!("{}x{}", picture.width, picture.height) })
        }
        other => bail!(
            "{file}: this is {}, which info does not read",
            other.describe()
        ),
    };
    Ok(with_head(file, kind, size as u64, told, &warnings))
}

/// An archive that could be parsed from memory but not opened.
fn unreadable_pak() -> bsp::FormatError {
    bsp::FormatError::new(
        bsp::ErrorKind::Truncated,
        "PAK directory",
        "a file that changes while it is read",
        "one that stays",
    )
}

/// The head common to all files, then what was found, then the warnings.
fn with_head(
    file: &str,
    kind: FileKind,
    size: u64,
    told: Value,
    warnings: &Warnings,
) -> Map<String, Value> {
    let mut map = Map::new();
    map.insert("file".into(), file.into());
    map.insert("kind".into(), short_name(kind).into());
    map.insert("bytes".into(), size.into());
    if let Value::Object(told) = told {
        map.extend(told);
    }
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    map.insert("warnings".into(), warnings.into());
    map
}

fn short_name(kind: FileKind) -> &'static str {
    match kind {
        FileKind::Pak => "PAK",
        FileKind::Wad2 => "WAD2",
        FileKind::Wad3 => "WAD3",
        FileKind::Mdl => "MDL",
        FileKind::Spr => "SPR",
        FileKind::Demo => "DEM",
        FileKind::Palette => "palette",
        FileKind::Picture => "picture",
        other => other.describe(),
    }
}

fn describe_pak(file: &str, pak: &PakFile, warnings: &Warnings) -> Map<String, Value> {
    let entries = pak.directory().entries();
    let files: Vec<Value> = (entries.iter())
        .map(|e| json!({ "name": e.name, "bytes": e.length }))
        .collect();
    let levels: Vec<&str> = (entries.iter().map(|e| e.name.as_str()))
        .filter(|n| n.starts_with("maps/") && n.ends_with(".bsp") && !n.starts_with("maps/b_"))
        .collect();
    let told = json!({ "entries": entries.len(), "levels": levels, "files": files });
    let size = pak.path().metadata().map_or(0, |m| m.len());
    with_head(file, FileKind::Pak, size, told, warnings)
}

fn describe_wad(bytes: &[u8], wad: &Wad, limits: &Limits) -> Value {
    let lumps: Vec<Value> = (wad.entries.iter())
        .map(|e| {
            let mut lump = json!({ "name": e.name, "type": lump_name(e.kind), "bytes": e.length });
            if wad.is_texture(e)
                && let Ok(texture) = wad.read_texture(bytes, e, limits)
            {
                lump["size"] = format!("{}x{}", texture.width, texture.height).into();
            }
            lump
        })
        .collect();
    let textures = wad.entries.iter().filter(|e| wad.is_texture(e)).count();
    json!({ "entries": wad.entries.len(), "textures": textures, "lumps": lumps })
}

fn lump_name(kind: u8) -> String {
    match kind {
        lump_type::PALETTE => "palette".into(),
        lump_type::QPIC => "picture".into(),
        lump_type::MIPTEX | lump_type::SOUND_OR_MIPTEX3 => "miptex".into(),
        other => format!("type {other}"),
    }
}

fn describe_palette(palette: &Palette) -> Value {
    let black = palette.0.iter().filter(|c| **c == [0; 3]).count();
    let fullbright: Vec<String> = (palette.0.iter().skip(FIRST_FULLBRIGHT.into()))
        .map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"))
        .collect();
    json!({ "colours": palette.0.len(), "black": black, "fullbright": fullbright })
}

/// The same for people: one line a key, lists below their key.
pub(super) fn text(map: &Map<String, Value>) -> String {
    let mut lines = Vec::new();
    for (key, value) in map {
        match value {
            Value::Array(items) if items.is_empty() => {}
            Value::Array(items) if items.iter().all(Value::is_number) => {
                lines.push(format!("{key:<20}{}", inline(value)));
            }
            Value::Array(items) => {
                lines.push(key.clone());
                lines.extend(items.iter().map(|item| format!("  {}", inline(item))));
            }
            _ => lines.push(format!("{key:<20}{}", inline(value))),
        }
    }
    lines.join("\n")
}

/// A value on one line. Objects that begin with a name show it in a column.
fn inline(value: &Value) -> String {
    match value {
        Value::String(s) => s.clone(),
        Value::Array(items) => items.iter().map(inline).collect::<Vec<_>>().join(" "),
        Value::Object(fields) => {
            let all: Vec<(&String, &Value)> = fields.iter().collect();
            let pairs = |of: &[(&String, &Value)]| {
                let pairs: Vec<String> = (of.iter())
                    .map(|(k, v)| format!("{k} {}", inline(v)))
                    .collect();
                pairs.join(", ")
            };
            match all.as_slice() {
                [(_, Value::String(name)), (_, value)] => format!("{name:<32} {}", inline(value)),
                [(_, Value::String(name)), rest @ ..] => {
                    format!("{name:<32} {}", pairs(rest)).trim_end().to_owned()
                }
                fields => pairs(fields),
            }
        }
        other => other.to_string(),
    }
}
