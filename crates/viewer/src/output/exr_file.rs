//! Multi-layer EXR.
//!
//! One part, so that every reader opens it: beauty is the plain R, G, B; other layers are channels
//! with a prefix (`albedo.R`, `depth.Z`, `id.V`).

use super::{Note, Plane, Style};
use anyhow::Result;
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Chromaticities};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer as Part,
    LayerAttributes, LineOrder, Text, WritableImage as _, f16,
};
use scene::render::{Film, StyleLayer};
use std::io::Write as _;

/// The channels of one light style, `style.N.R` and so on.
fn style_channels(style: &StyleLayer, half: bool) -> [AnyChannel<FlatSamples>; 3] {
    [0, 1, 2].map(|c| {
        let name = format!("style.{}.{}", style.number, ["R", "G", "B"][c]);
        let values = style.radiance.iter().map(|p| p[c]);
        AnyChannel::new(name.as_str(), floats(values, half))
    })
}

/// The film's layers that `style` names, with its notes as attributes `runelight:NAME`.
pub(super) fn encode_film(film: &Film, style: &Style) -> Result<Vec<u8>> {
    let mut channels = Vec::new();
    for &layer in &style.layers {
        if let Plane::Styles(styles) = layer.plane(film) {
            channels.extend(styles.iter().flat_map(|s| style_channels(s, style.half)));
            continue;
        }
        let half = style.half && layer.may_be_half();
        let samples: Vec<FlatSamples> = match layer.plane(film) {
            Plane::Rgb(values) => (0..3)
                .map(|c| floats(values.iter().map(|p| p[c]), half))
                .collect(),
            Plane::Xy(values) => (0..2)
                .map(|c| floats(values.iter().map(|p| p[c]), half))
                .collect(),
            Plane::Float(values) => vec![floats(values.iter().copied(), half)],
            Plane::Uint(values) => vec![FlatSamples::U32(values.to_vec())],
            Plane::Constant(value) => vec![FlatSamples::U32(vec![value; film.beauty.len()])],
            Plane::Styles(_) => Vec::new(),
        };
        for (name, data) in layer.channels().into_iter().zip(samples) {
            channels.push(AnyChannel::new(name.as_str(), data));
        }
    }
    let mut attributes = LayerAttributes {
        software_name: Some(Text::from(concat!("runelight ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, note) in &style.notes {
        let value = match note {
            Note::Text(v) => AttributeValue::Text(Text::from(v.as_str())),
            Note::Float(v) => AttributeValue::F32(*v),
            // EXR's whole numbers have 32 bits; what needs more is kept exactly as text.
            Note::Int(v) => i32::try_from(*v).map_or_else(
                |_| AttributeValue::Text(Text::from(v.to_string().as_str())),
                AttributeValue::I32,
            ),
        };
        let name = Text::from(format!("runelight:{name}").as_str());
        attributes.other.insert(name, value);
    }
    encode([film.width, film.height], channels, attributes)
}

/// Writes layers of `width * height` RGB values each, rows from the top; one without a name is plain
/// R, G, B.
///
/// # Errors
/// When the file cannot be written.
pub fn write_rgb_layers(
    file: &mut std::fs::File,
    [width, height]: [u32; 2],
    layers: &[(&str, &[[f32; 3]])],
) -> Result<()> {
    let channels = (layers.iter())
        .flat_map(|(name, values)| {
            (0..3).zip(["R", "G", "B"]).map(move |(c, letter)| {
                let channel = match *name {
                    "" => letter.to_owned(),
                    name => format!("{name}.{letter}"),
                };
                let samples = floats(values.iter().map(|p| p[c]), false);
                AnyChannel::new(channel.as_str(), samples)
            })
        })
        .collect();
    let bytes = encode([width, height], channels, LayerAttributes::default())?;
    Ok(file.write_all(&bytes)?)
}

fn encode(
    [width, height]: [u32; 2],
    channels: Vec<AnyChannel<FlatSamples>>,
    attributes: LayerAttributes,
) -> Result<Vec<u8>> {
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(width as usize, height as usize);
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let mut image = Image::from_layer(Part::new(size, attributes, encoding, channels));
    // The primaries and the white point of ITU-R BT.709, which are sRGB's.
    image.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.3, 0.6),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.329),
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Sorts the attributes of the only header of an EXR by name, as the OpenEXR library writes them.
/// They come out of a hash map, in an order that changes from run to run, and the same picture
/// should be the same file.
fn sort_attributes(file: &mut [u8]) {
    // Magic number and version, then attributes (name, type, size, value) up to an empty name.
    const START: usize = 8;
    let text_end = |from: usize| Some(from + file.get(from..)?.iter().position(|b| *b == 0)? + 1);
    let mut spans = Vec::new();
    let mut at = START;
    while file.get(at).is_some_and(|b| *b != 0) {
        let end = text_end(at).and_then(text_end).and_then(|size_at| {
            let size = file.get(size_at..)?.first_chunk::<4>()?;
            size_at.checked_add(4 + u32::from_le_bytes(*size) as usize)
        });
        match end {
            Some(end) if end < file.len() => spans.push(at..end),
            _ => return,
        }
        at = spans[spans.len() - 1].end;
    }
    spans.sort_by(|a, b| file[a.clone()].cmp(&file[b.clone()]));
    let sorted: Vec<u8> = spans.into_iter().flat_map(|s| &file[s]).copied().collect();
    file[START..at].copy_from_slice(&sorted);
}

/// A channel of floats, in half precision with finite values kept finite if `half`.
fn floats(values: impl Iterator<Item = f32>, half: bool) -> FlatSamples {
    if !half {
        return FlatSamples::F32(values.collect());
    }
    let largest = f16::MAX.to_f32();
    FlatSamples::F16(
        values
            .map(|v| {
                f16::from_f32(if v.is_finite() {
                    v.clamp(-largest, largest)
                } else {
                    v
                })
            })
            .collect(),
    )
}
