//! Tone-mapped PNG with 8 bits per channel.

use super::Note;
use anyhow::Result;
use std::io::Write as _;

/// RGB triples of display codes, rows from the top, as a PNG with its notes as texts `runelight:NAME`.
pub(super) fn encode(
    codes: &[[u8; 3]],
    [width, height]: [u32; 2],
    notes: &[(&'static str, Note)],
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    for (name, note) in notes {
        encoder.add_itxt_chunk(format!("runelight:{name}"), note.to_string())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}

/// Writes `width * height` RGB triples of display codes, rows from the top, as PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn write_rgb8(file: &mut std::fs::File, bytes: &[u8], width: u32, height: u32) -> Result<()> {
    let (codes, _) = bytes.as_chunks::<3>();
    file.write_all(&encode(codes, [width, height], &[])?)?;
    Ok(())
}
