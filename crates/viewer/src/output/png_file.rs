//! Tone-mapped PNG with 8 bits per channel.

use super::Style;
use crate::tonemap::display_u8;
use anyhow::Result;
use image::ImageEncoder as _;
use scene::render::Film;
use std::io::{BufWriter, Write as _};

/// Writes the beauty layer as a display shows it.
pub(super) fn write(file: &mut std::fs::File, film: &Film, style: &Style) -> Result<()> {
    let bytes: Vec<u8> = (film.beauty.iter())
        .flat_map(|p| display_u8(*p, style.exposure, style.tonemap))
        .collect();
    write_rgb8(file, &bytes, film.width, film.height)
}

/// Writes `width * height` RGB triples of display codes, rows from the top, as PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn write_rgb8(file: &mut std::fs::File, bytes: &[u8], width: u32, height: u32) -> Result<()> {
    let mut writer = BufWriter::new(file);
    image::codecs::png::PngEncoder::new(&mut writer).write_image(
        bytes,
        width,
        height,
        image::ExtendedColorType::Rgb8,
    )?;
    writer.flush()?;
    Ok(())
}
