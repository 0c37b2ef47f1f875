//! Pictures of an export: EXR for numbers, PNG for codes.

use anyhow::Result;
use exr::math::Vec2;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, WritableImage as _,
};
use image::ImageEncoder as _;
use image::codecs::png::PngEncoder;
use std::io::{Cursor, Write};

/// Writes linear RGB as a 32-bit EXR, rows from the top.
pub fn write_exr(out: &mut impl Write, pixels: &[[f32; 3]], width: u32, height: u32) -> Result<()> {
    let channels = ["R", "G", "B"].into_iter().enumerate().map(|(c, name)| {
        let samples = pixels.iter().map(|p| p[c]).collect();
        AnyChannel::new(name, FlatSamples::F32(samples))
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(width as usize, height as usize);
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes)?;
    out.write_all(&bytes.into_inner())?;
    Ok(())
}

/// Writes one byte per pixel as a grey PNG, rows from the top.
pub fn write_gray(out: &mut impl Write, pixels: &[u8], width: u32, height: u32) -> Result<()> {
    let kind = image::ExtendedColorType::L8;
    Ok(PngEncoder::new(out).write_image(pixels, width, height, kind)?)
}

/// Writes red, green, blue and alpha as PNG, rows from the top.
pub fn write_rgba(out: &mut impl Write, pixels: &[[u8; 4]], width: u32, height: u32) -> Result<()> {
    let kind = image::ExtendedColorType::Rgba8;
    Ok(PngEncoder::new(out).write_image(pixels.as_flattened(), width, height, kind)?)
}
