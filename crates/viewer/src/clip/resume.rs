//! Frames that are there already: what they were made of, and whether they are whole.

use super::target::Targets;
use crate::cli::{ClipArgs, PictureArgs};
use crate::output::Format;
use crate::picture::{self, BEAUTY};
use anyhow::{Context as _, Result, bail};
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use rayon::prelude::*;
use scene::timeline::Unseen;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The note that holds [`settings`].
pub const MADE: &str = "made";
/// The note that holds the digest of a level and its models.
pub const STAGE: &str = "stage";

/// All that every frame of a clip depends on besides its number and its level's files: equal texts, equal
/// frames. `demo` is a digest of the demo, `read` one of the other files that options name.
#[must_use]
pub fn settings(
    clip: &ClipArgs,
    picture: &PictureArgs,
    unseen: Unseen,
    demo: &str,
    read: &str,
) -> String {
    /// Printed by its names, so that a difference can be told.
    #[derive(Debug)]
    #[expect(dead_code, reason = "printed")]
    struct Made<'a> {
        version: &'a str,
        demo: &'a str,
        materials_and_camera_path: &'a str,
        fps: String,
        from: String,
        shutter: f64,
        unseen: Unseen,
        no_tint: bool,
        picture: PictureArgs,
    }
    let made = Made {
        version: env!("CARGO_PKG_VERSION"),
        demo,
        materials_and_camera_path: read,
        fps: clip.fps.to_string(),
        from: clip.from.map_or("0".to_owned(), |f| f.to_string()),
        shutter: clip.shutter,
        unseen,
        no_tint: clip.no_tint,
        picture: PictureArgs {
            // It ends a run between frames, and changes none.
            time_limit: None,
            ..picture.clone()
        },
    };
    format!("{made:?}")
}

/// Frames that need not be made, with the digest of the level they were made of.
pub type Found = BTreeMap<u32, String>;

/// Looks for the complete ones of `frames`: all their files are there, were made with the same settings
/// ([`settings`]), and can be read to the end. Removes what killed runs left beside the others.
///
/// # Errors
/// When a file was made with other settings, or is none of a clip.
pub fn find(targets: &Targets, frames: &Range<u32>, made: &str) -> Result<Found> {
    let each: Vec<Result<Option<String>>> = (frames.clone().into_par_iter())
        .map(|frame| whole(targets, frame, made))
        .collect();
    let mut found = Found::new();
    // The first of them in order is the one that is told of, and not the one that was looked at first.
    for (frame, stage) in frames.clone().zip(each) {
        if let Some(stage) = stage? {
            found.insert(frame, stage);
        }
    }
    // Of frames that are whole, too: a run that made one anew for its other file may have been killed.
    remove_parts((frames.clone()).flat_map(|f| targets.files(f).map(|(path, _)| path)));
    Ok(found)
}

/// The digest of the level that a frame was made of, if all its files are whole.
fn whole(targets: &Targets, frame: u32, made: &str) -> Result<Option<String>> {
    let mut stages = BTreeSet::new();
    let mut all = true;
    for (path, format) in targets.files(frame) {
        // An empty file is what some file systems leave of a machine that lost its power.
        if path.metadata().map_or(0, |m| m.len()) == 0 {
            all = false;
            continue;
        }
        let shown = path.display();
        let notes = notes(&path, format)
            .with_context(|| format!("--resume: {shown} is there, and cannot be read"))?;
        let (Some(there), Some(stage)) = (notes.get(MADE), notes.get(STAGE)) else {
            bail!("--resume: {shown} is there, and is no frame of a demo")
        };
        if there != made {
            bail!(
                "--resume: {shown} was made with other settings ({}); remove it, or write elsewhere",
                difference(there, made)
            );
        }
        if let Err(why) = picture::read(&path, BEAUTY) {
            tracing::warn!("{why:#}; it is made again");
            all = false;
        }
        stages.insert(stage.clone());
    }
    Ok(stages.pop_first().filter(|_| all && stages.is_empty()))
}

/// Where two texts of [`settings`] differ first: `spp: 16 there, 64 asked for`.
fn difference(there: &str, asked: &str) -> String {
    let same = there.chars().zip(asked.chars()).take_while(|(a, b)| a == b);
    let same: usize = same.map(|(a, _)| a.len_utf8()).sum();
    let name_end = asked[..same].rfind(": ").unwrap_or(0);
    let name_begin = asked[..name_end].rfind(' ').map_or(0, |at| at + 1);
    let value = |text: &str| {
        let rest = text.get(name_end + 2..).unwrap_or_default();
        let end = rest.find([',', '}']).unwrap_or(rest.len());
        rest[..end].trim_end().to_owned()
    };
    let name = &asked[name_begin..name_end];
    format!("{name}: {} there, {} asked for", value(there), value(asked))
}

/// The notes of a picture, by their names without `runelight:`.
///
/// # Errors
/// When the file can't be read.
pub(crate) fn notes(path: &Path, format: Format) -> Result<BTreeMap<String, String>> {
    const PREFIX: &str = "runelight:";
    let file = std::io::BufReader::new(std::fs::File::open(path)?);
    let mut notes = BTreeMap::new();
    let mut note = |name: &str, text: String| {
        if let Some(name) = name.strip_prefix(PREFIX) {
            notes.insert(name.to_owned(), text);
        }
    };
    match format {
        Format::Exr => {
            let meta = MetaData::read_from_buffered(file, false)?;
            let attributes = meta.headers.iter().flat_map(|h| &h.own_attributes.other);
            for (name, value) in attributes {
                if let AttributeValue::Text(text) = value {
                    note(&name.to_string(), text.to_string());
                }
            }
        }
        Format::Png => {
            let reader = png::Decoder::new(file).read_info()?;
            for chunk in &reader.info().utf8_text {
                note(&chunk.keyword, chunk.get_text()?);
            }
        }
    }
    Ok(notes)
}

/// Removes unfinished files of processes that are gone.
fn remove_parts(paths: impl Iterator<Item = PathBuf>) {
    let names: BTreeSet<PathBuf> = paths.collect();
    let dirs: BTreeSet<PathBuf> = names.iter().map(|p| directory(p)).collect();
    for dir in dirs {
        for entry in std::fs::read_dir(&dir).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let Some(of) = name.to_str().and_then(|n| crate::output::part_of(n)) else {
                continue;
            };
            if names.contains(&dir.join(of)) || names.contains(Path::new(of)) {
                // If it cannot be removed it is in nobody's way.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// The directory of a file.
fn directory(path: &Path) -> PathBuf {
    match path.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir.to_owned(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_told_by_its_name() {
        let text =
            |seed: u32, size: &str| format!("Made {{ size: {size}, seed: {seed}, x: true }}");
        assert_eq!(
            difference(&text(16, "a"), &text(64, "a")),
            "seed: 16 there, 64 asked for"
        );
        assert_eq!(
            difference(&text(64, "\"é\""), &text(64, "\"è\"")),
            "size: \"é\" there, \"è\" asked for"
        );
        assert!(difference("", "Made { a: 1 }").contains("asked for"));
    }
}
