//! What models and sprites hold.

use bsp::mdl::{Frame, Mdl, flags};
use bsp::spr::{Spr, SpriteType, Times};
use bsp::{Cycle, FormatError, Limits, Warnings};
use serde_json::{Value, json};

/// An alias model: sizes, effects, skins, and its frames as sequences of poses of one name.
pub fn describe_mdl(
    bytes: &[u8],
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Value, FormatError> {
    let model = Mdl::parse(bytes, limits, warnings)?;
    let header = &model.header;
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let poses = model.frames.iter().flat_map(|f| &f.poses);
    for &vertex in poses.flat_map(|p| &p.vertices) {
        for (axis, c) in model.position(vertex).into_iter().enumerate() {
            low[axis] = low[axis].min(c);
            high[axis] = high[axis].max(c);
        }
    }
    let skins: Vec<usize> = model.skins.iter().map(|s| s.pictures.len()).collect();
    let names = effects(header.flags);
    Ok(json!({
        "vertices": model.skin_vertices.len(),
        "triangles": model.triangles.len(),
        "frames": model.frames.len(),
        "poses": model.pose_count(),
        "skins": model.skins.len(),
        "skin_pictures": skins,
        "skin_size": format!("{}x{}", header.skin_width, header.skin_height),
        "smallest_corner": low.map(|c| (f64::from(c) * 10.0).round() / 10.0),
        "largest_corner": high.map(|c| (f64::from(c) * 10.0).round() / 10.0),
        "starts_at_random": header.sync_type != 0,
        "flags": format!("{:#x}", header.flags),
        "effects": if names.is_empty() { "none".to_owned() } else { names.join(", ") },
        "bytes_after_end": model.trailing,
        "sequences": sequences(&model.frames),
    }))
}

fn effects(bits: u32) -> Vec<&'static str> {
    [
        (flags::ROCKET, "rocket's trail and light"),
        (flags::GRENADE, "smoke"),
        (flags::GIB, "blood"),
        (flags::ROTATE, "turns"),
        (flags::TRACER, "green trail"),
        (flags::ZOMBIE_GIB, "a little blood"),
        (flags::TRACER2, "orange trail"),
        (flags::TRACER3, "purple trail"),
        (flags::HOLES, "holes"),
    ]
    .into_iter()
    .filter_map(|(bit, name)| (bits & bit != 0).then_some(name))
    .collect()
}

/// Frames in a row whose names differ in their number alone are one sequence.
fn sequences(frames: &[Frame]) -> Vec<Value> {
    let mut out: Vec<(String, usize, usize, Option<&Cycle>)> = Vec::new();
    for (i, frame) in frames.iter().enumerate() {
        let name = frame.poses.first().map_or("", |p| p.name.as_str());
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        match (out.last_mut(), &frame.cycle) {
            (Some((last, _, count, None)), None) if last == stem => *count += 1,
            (_, cycle) => out.push((stem.to_owned(), i, 1, cycle.as_ref())),
        }
    }
    (out.into_iter())
        .map(|(name, first, count, cycle)| {
            let mut value = json!({ "name": name, "first": first, "frames": count });
            if let Some(cycle) = cycle {
                value["group_of"] = cycle.parts().into();
                value["seconds"] = seconds(cycle).into();
            }
            value
        })
        .collect()
}

/// How long a group takes, to the millisecond.
fn seconds(cycle: &Cycle) -> f64 {
    (f64::from(cycle.seconds()) * 1000.0).round() / 1000.0
}

/// A sprite: how it turns, and its frames.
pub fn describe_spr(
    bytes: &[u8],
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Value, FormatError> {
    let sprite = Spr::parse(bytes, limits, warnings)?;
    let frames: Vec<Value> = (sprite.frames.iter())
        .map(|frame| {
            let sizes: Vec<String> = (frame.pictures.iter())
                .map(|p| format!("{}x{}", p.width, p.height))
                .collect();
            match &frame.times {
                Times::Single => json!({ "frame": "picture", "sizes": sizes }),
                Times::Group(cycle) => {
                    json!({ "frame": "group", "sizes": sizes, "seconds": seconds(cycle) })
                }
                Times::Angled => json!({ "frame": "by direction", "sizes": sizes }),
            }
        })
        .collect();
    Ok(json!({
        "type": match sprite.header.sprite_type {
            SpriteType::ParallelUpright => "parallel to the view, upright",
            SpriteType::FacingUpright => "facing the eye, upright",
            SpriteType::Parallel => "parallel to the view",
            SpriteType::Oriented => "as the entity lies",
            SpriteType::ParallelOriented => "parallel to the view, rolled as the entity",
        },
        "frames": sprite.frames.len(),
        "pictures": sprite.picture_count(),
        "largest_size": format!("{}x{}", sprite.header.max_width, sprite.header.max_height),
        "starts_at_random": sprite.header.sync_type != 0,
        "bytes_after_end": sprite.trailing,
        "list": frames,
    }))
}
