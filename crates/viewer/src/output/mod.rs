//! Pictures written to files: multi-layer EXR, and tone-mapped PNG.

mod exr_file;
pub mod layers;
mod part;
mod png_file;
pub mod screen;

pub use exr_file::write_rgb_layers;
pub use layers::{Layer, Plane};
pub use part::{PartFile, part_of, remove_unfinished};
pub use png_file::write_rgb8;
pub use screen::Screen;

use crate::tonemap::Tonemap;
use anyhow::{Context as _, Result, bail};
use scene::render::Film;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Formats a picture can be written in, by extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Scene-linear, all layers.
    Exr,
    /// Tone-mapped, 8 bits, the picture alone.
    Png,
}

impl Format {
    /// The format the extension of `path` stands for.
    ///
    /// # Errors
    /// When it stands for none.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => bail!("{}: an output ends in .exr or .png", path.display()),
        }
    }
}

/// Everything about a picture besides its pixels: how it is encoded, and what is noted in it.
#[derive(Clone, Debug, Default)]
pub struct Style {
    /// Layers of an EXR.
    pub layers: Vec<Layer>,
    /// Colours of an EXR as 16-bit floats.
    pub half: bool,
    /// Exposure of a PNG in stops.
    pub exposure: f32,
    /// Tone curve of a PNG.
    pub tonemap: Tonemap,
    /// What a PNG shows besides the light.
    pub screen: Screen,
    /// Notes by name, in order; attributes of an EXR, texts of a PNG.
    pub notes: Vec<(&'static str, Note)>,
}

/// A note's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// Text.
    Text(String),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f32),
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(v) => v.fmt(f),
            Self::Int(v) => v.fmt(f),
            Self::Float(v) => v.fmt(f),
        }
    }
}

/// The bytes of a file. The same picture with the same notes is the same file.
///
/// # Errors
/// When the picture has no size.
pub fn encode(format: Format, film: &Film, style: &Style) -> Result<Vec<u8>> {
    match format {
        Format::Exr => exr_file::encode_film(film, style),
        Format::Png => png_file::encode(
            &screen::codes(film, style),
            [film.width, film.height],
            &style.notes,
        ),
    }
}

/// Outputs that were opened and wait for their picture.
#[derive(Debug)]
pub struct Outputs(Vec<(Format, PartFile)>);

impl Outputs {
    /// Opens every output, so that what cannot be written is known before the work.
    ///
    /// # Errors
    /// On the first path that has no known extension, appears twice, or cannot be written.
    pub fn open(paths: &[PathBuf]) -> Result<Self> {
        let mut outputs: Vec<(Format, PartFile)> = Vec::new();
        for path in paths {
            if outputs.iter().any(|(_, o)| o.path() == path) {
                bail!("--output {} is given twice", path.display());
            }
            outputs.push((Format::of(path)?, PartFile::create(path)?));
        }
        Ok(Self(outputs))
    }

    /// Encodes the picture into every output, and moves all into place once all are complete.
    /// Returns their paths.
    ///
    /// # Errors
    /// When one cannot be written; then none is moved into place.
    pub fn write(mut self, film: &Film, style: &Style) -> Result<Vec<PathBuf>> {
        for (format, part) in &mut self.0 {
            let path = part.path().to_owned();
            encode(*format, film, style)
                .and_then(|bytes| Ok(part.file().write_all(&bytes)?))
                .with_context(|| format!("{} cannot be written", path.display()))?;
        }
        let paths = self.0.iter().map(|(_, p)| p.path().to_owned()).collect();
        for (_, part) in self.0 {
            part.commit()?;
        }
        Ok(paths)
    }
}

#[cfg(test)]
mod tests;
