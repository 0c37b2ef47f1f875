//! Pictures read from files, for comparing.

use crate::tonemap::srgb_decode;
use anyhow::{Context as _, Result, bail};
use exr::prelude::{FlatSamples, ReadChannels as _, ReadLayers as _};
use std::collections::BTreeSet;
use std::path::Path;

/// One layer of a picture file. Rows run from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across, > 0.
    pub width: usize,
    /// Pixels down, > 0.
    pub height: usize,
    /// Scene-linear RGB; layers with a single channel repeat it. The radiance of a PNG is its
    /// decoded display code.
    pub radiance: Vec<[f32; 3]>,
    /// Display codes in 0..=1 where the file holds these instead of radiance (PNG).
    pub codes: Option<Vec<[f32; 3]>>,
}

/// The layer that is the picture itself.
pub const BEAUTY: &str = "beauty";

/// Reads one layer of an EXR, or a PNG.
///
/// In an EXR a layer is the channels with the prefix `layer.`, in any part of the file, or a part
/// of that name. The layer `beauty` is also found as the channels R, G, B (or Y) without a prefix.
///
/// # Errors
/// When the file cannot be read or has no such layer; the sentence names the file and, for a
/// missing layer, those that exist.
pub fn read(path: &Path, layer: &str) -> Result<Picture> {
    let bytes =
        std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let at = || path.display().to_string();
    if bytes.starts_with(&0x0131_2f76u32.to_le_bytes()) {
        read_exr(&bytes, layer).with_context(at)
    } else if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        if layer != BEAUTY {
            bail!(
                "{}: a PNG has no layer {layer:?}, only {BEAUTY}",
                path.display()
            );
        }
        read_png(&bytes).with_context(at)
    } else {
        bail!("{}: neither an EXR nor a PNG", path.display())
    }
}

fn read_png(bytes: &[u8]) -> Result<Picture> {
    let mut reader =
        image::ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(1 << 30);
    reader.limits(limits);
    let decoded = reader.decode()?.into_rgb32f();
    let codes: Vec<[f32; 3]> = decoded.pixels().map(|p| p.0).collect();
    Ok(Picture {
        width: decoded.width() as usize,
        height: decoded.height() as usize,
        radiance: codes.iter().map(|c| c.map(srgb_decode)).collect(),
        codes: Some(codes),
    })
}

fn read_exr(bytes: &[u8], layer: &str) -> Result<Picture> {
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))?;
    let part_names: Vec<Option<String>> = (file.layer_data.iter())
        .map(|part| part.attributes.layer_name.as_ref().map(ToString::to_string))
        .collect();
    let several = part_names.len() > 1;
    let beauty_part = several && part_names.iter().flatten().any(|name| name == BEAUTY);
    let mut found = BTreeSet::new();
    for (part, part_name) in file.layer_data.iter().zip(&part_names) {
        let mut channels: Vec<(String, &FlatSamples)> = Vec::new();
        for channel in &part.channel_data.list {
            let full = channel.name.to_string();
            let (prefix, short) = full.rsplit_once('.').unwrap_or(("", &full));
            // Channels without a prefix belong to a part's name, or are the picture itself.
            let names = match (prefix, part_name) {
                ("", Some(part)) if beauty_part => vec![part.as_str()],
                ("", Some(part)) if several => vec![part.as_str(), BEAUTY],
                ("", _) => vec![BEAUTY],
                (prefix, _) => vec![prefix],
            };
            found.extend(names.iter().map(ToString::to_string));
            if names.contains(&layer) && channel.sampling == exr::math::Vec2(1, 1) {
                channels.push((short.to_owned(), &channel.sample_data));
            }
        }
        if let Some(planes) = pick_planes(&channels) {
            let pixels = part.size.area();
            let radiance = (0..pixels).map(|p| planes.map(|s| sample(s, p))).collect();
            return Ok(Picture {
                width: part.size.width(),
                height: part.size.height(),
                radiance,
                codes: None,
            });
        }
    }
    let names: Vec<String> = found.into_iter().collect();
    bail!("has no layer {layer:?}; it has {}", names.join(", "))
}

/// The three planes to read of a layer's channels. Of two, X and Y, the second one counts twice.
fn pick_planes<'a>(channels: &[(String, &'a FlatSamples)]) -> Option<[&'a FlatSamples; 3]> {
    let named = |name: &str| {
        (channels.iter())
            .find(|(n, _)| n.eq_ignore_ascii_case(name))
            .map(|(_, s)| *s)
    };
    for [a, b, c] in [["R", "G", "B"], ["X", "Y", "Z"]] {
        if let (Some(a), Some(b), Some(c)) = (named(a), named(b), named(c)) {
            return Some([a, b, c]);
        }
    }
    if let (Some(x), Some(y)) = (named("X"), named("Y")) {
        return Some([x, y, y]);
    }
    let only = named("Y").or(match channels {
        [(_, single)] => Some(*single),
        _ => None,
    })?;
    Some([only; 3])
}

fn sample(plane: &FlatSamples, index: usize) -> f32 {
    match plane {
        FlatSamples::F16(v) => v[index].to_f32(),
        FlatSamples::F32(v) => v[index],
        FlatSamples::U32(v) => v[index] as f32,
    }
}
