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
use scene::render::Film;
use std::io::{BufWriter, Write as _};

/// Writes the film's layers that `style` names, with its notes as attributes `runelight:NAME`.
pub(super) fn write(file: &mut std::fs::File, film: &Film, style: &Style) -> Result<()> {
    let mut channels = Vec::new();
    for &layer in &style.layers {
        let half = style.half && layer.may_be_half();
        let samples: Vec<FlatSamples> = match layer.plane(film) {
            Plane::Rgb(values) => (0..3)
                .map(|c| floats(values.iter().map(|p| p[c]), half))
                .collect(),
            Plane::Float(values) => vec![floats(values.iter().copied(), half)],
            Plane::Uint(values) => vec![FlatSamples::U32(values.to_vec())],
            Plane::Constant(value) => vec![FlatSamples::U32(vec![value; film.beauty.len()])],
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
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(film.width as usize, film.height as usize);
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let mut image = Image::from_layer(Part::new(size, attributes, encoding, channels));
    // The primaries and the white point of ITU-R BT.709, which are sRGB's.
    image.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.3, 0.6),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.329),
    });
    let mut writer = BufWriter::new(file);
    image.write().to_buffered(&mut writer)?;
    writer.flush()?;
    Ok(())
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
