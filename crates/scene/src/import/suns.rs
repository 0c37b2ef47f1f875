//! Suns and sky domes: worldspawn's keys, and light entities that stand for them.

use super::lights::{color_of, strength};
use super::notes::Notes;
use super::targets::Targets;
use crate::sky::Sun;
use bsp::entity::{Entity, numbers};
use glam::Vec3;
use std::f32::consts::PI;

/// Angular radius of a sun that does not say how soft its shadows are, in degrees: ours.
pub const SUN_RADIUS_DEG: f32 = 0.27;
/// Largest angular radius, in degrees: half of the sky.
const MAX_RADIUS_DEG: f32 = 89.0;
/// Irradiance of a surface that faces a sun of strength 1: a lightmap value `v` stands for
/// `pi / 128 * v`, and the compilers halve every light.
const SUN_IRRADIANCE: f32 = PI / 256.0;
/// Radiance of a dome of strength 1: what the compilers' hundred weak suns come to.
pub const DOME_RADIANCE: f32 = 0.003;
/// Suns of a level; each sky face is asked for each of them.
const MAX_SUNS: usize = 16;
/// What the level's keys ask of the sky.
#[derive(Clone, Debug, Default)]
pub struct SkyLight {
    /// The suns, without their weights.
    pub suns: Vec<Sun>,
    /// Radiance of the upper and the lower half of the sky, linear RGB; 0 where nothing is asked.
    pub domes: [Vec3; 2],
}

/// Reads worldspawn's `_sunlight*` and `_sun2*` keys, and the light entities with `_sun`,
/// `_sunlight2` or `_sunlight3`.
pub fn sky_light(entities: &[Entity], notes: &mut Notes) -> SkyLight {
    let mut light = SkyLight::default();
    let mut suns = Vec::new();
    if let Some(world) = entities.first() {
        let number = |key| world.float_loose(key).unwrap_or(0.0);
        let color = |keys: &[&str]| {
            let key = keys.iter().find_map(|key| world.vec3_loose(key));
            (key.map(|k| color_of(Vec3::from(k)))).unwrap_or(Vec3::ONE)
        };
        let width = number("sunlight_penumbra");
        for (strength, mangle, tint) in [
            (
                "sunlight",
                &["sunlight_mangle", "sun_mangle"][..],
                &["sunlight_color"][..],
            ),
            ("sun2", &["sun2_mangle"][..], &["sun2_color"][..]),
        ] {
            let travels = (world.get_any(mangle)).map_or(Vec3::NEG_Z, direction_of);
            suns.push((number(strength), color(tint), travels, width));
        }
        let tints = [
            ["sunlight2_color", "sunlight_color2"],
            ["sunlight3_color", "sunlight_color3"],
        ];
        for ((dome, key), tint) in (light.domes.iter_mut())
            .zip(["sunlight2", "sunlight3"])
            .zip(tints)
        {
            *dome = number(key).max(0.0) * DOME_RADIANCE * color(&tint);
        }
    }
    let targets = Targets::new(entities);
    for entity in entities.iter().skip(1).filter(|e| is_sky_light(e)) {
        let (n, tint) = strength(entity);
        if is_set(entity, "sun") {
            let aimed = (targets.of(entity))
                .and_then(|t| (t - Vec3::from(entity.origin())).try_normalize());
            let mangled = || entity.get_loose("mangle").map(direction_of);
            let travels = aimed.or_else(mangled).unwrap_or(Vec3::NEG_Z);
            let width = entity.float_loose("deviance").unwrap_or(0.0);
            suns.push((n, tint, travels, width));
        } else {
            let which = usize::from(!is_set(entity, "sunlight2"));
            light.domes[which] = n.max(0.0) * DOME_RADIANCE * tint;
        }
    }
    suns.retain(|&(n, tint, ..)| n > 0.0 && tint.max_element() > 0.0);
    if suns.len() > MAX_SUNS {
        notes.add("too many suns", || {
            format!("the level has {} suns: {MAX_SUNS} shine", suns.len())
        });
        suns.truncate(MAX_SUNS);
    }
    light.suns = (suns.into_iter())
        .map(|(n, tint, travels, width)| {
            // The key says how wide the penumbra is, from one edge of the sun to the other.
            let radius = if width > 0.0 {
                (width / 2.0).clamp(1e-3, MAX_RADIUS_DEG)
            } else {
                SUN_RADIUS_DEG
            };
            Sun::new(-travels, radius.to_radians(), tint * n * SUN_IRRADIANCE)
        })
        .collect();
    light
}

/// Whether a light entity speaks of the sky and is no lamp.
pub fn is_sky_light(entity: &Entity) -> bool {
    entity.classname().starts_with("light")
        && ["sun", "sunlight2", "sunlight3"]
            .iter()
            .any(|key| is_set(entity, key))
}

fn is_set(entity: &Entity, key: &str) -> bool {
    entity.float_loose(key).unwrap_or(0.0) != 0.0
}

/// The unit vector of "yaw pitch roll", where a positive pitch looks up; straight down if there are
/// not two numbers.
fn direction_of(text: &str) -> Vec3 {
    let mut angles = numbers(text).map(|n| n.unwrap_or(0.0));
    let (Some(yaw), Some(pitch)) = (angles.next(), angles.next()) else {
        return Vec3::NEG_Z;
    };
    let (yaw, pitch) = (f64::from(yaw).to_radians(), f64::from(pitch).to_radians());
    glam::DVec3::new(
        yaw.cos() * pitch.cos(),
        yaw.sin() * pitch.cos(),
        pitch.sin(),
    )
    .normalize()
    .as_vec3()
}
