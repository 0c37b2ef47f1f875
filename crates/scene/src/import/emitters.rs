//! Which light entities stand for lamps that are drawn, too.

use super::LightMode;
use super::lights::EntityLight;
use crate::emitter::Emitter;
use crate::mesh::distance_to_triangle;
use glam::Vec3;

/// A light entity within this distance (world units) of bright surfaces stands for them.
pub const LAMP_REACH: f32 = 32.0;
/// It is left out if those surfaces together have at least this part of its power: a stray bright
/// texel on a wall does not put out the torch before it.
pub const LAMP_SHARE: f32 = 1.0 / 16.0;

/// Most pairs of light and surface compared: real levels have a few millions. Beyond, all lights
/// stay.
const MAX_PAIRS: usize = 1 << 28;

/// A light entity that is left out in favour of bright surfaces beside it.
pub struct Twice {
    /// The light.
    pub light: EntityLight,
    /// Number of the nearest of those surfaces among the emitters.
    pub emitter: usize,
    /// Its distance, world units.
    pub distance: f32,
}

/// The lights that shine in `mode`, and those that are left out in favour of a surface. `is_lamp`
/// says of an emitter whether an entity can stand for it.
pub fn choose_lights(
    lights: Vec<EntityLight>,
    mode: LightMode,
    emitters: &[Emitter],
    is_lamp: impl Fn(&Emitter) -> bool,
) -> (Vec<EntityLight>, Vec<Twice>) {
    match mode {
        LightMode::Textures => return (Vec::new(), Vec::new()),
        LightMode::Entities | LightMode::All => return (lights, Vec::new()),
        LightMode::Auto => {}
    }
    let lamps: Vec<(usize, &Emitter)> = (emitters.iter().enumerate())
        .filter(|(_, t)| is_lamp(t))
        .collect();
    if lamps.len().saturating_mul(lights.len()) > MAX_PAIRS {
        return (lights, Vec::new());
    }
    let (mut kept, mut twice) = (Vec::new(), Vec::new());
    for light in lights {
        let beside: Vec<(usize, f32)> = (lamps.iter())
            .filter_map(|&(i, t)| Some((i, near(t, light.light.position)?)))
            .collect();
        let power: f32 = beside.iter().map(|&(i, _)| emitters[i].weight).sum();
        let nearest = beside.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        match nearest {
            Some((emitter, distance)) if power >= LAMP_SHARE * light.light.weight() => {
                twice.push(Twice {
                    light,
                    emitter,
                    distance,
                });
            }
            _ => kept.push(light),
        }
    }
    (kept, twice)
}

/// Distance of a point to an emitter, if it is within [`LAMP_REACH`].
fn near(e: &Emitter, p: Vec3) -> Option<f32> {
    let [min, max] = e.bounds();
    if !(p.cmpge(min - LAMP_REACH).all() && p.cmple(max + LAMP_REACH).all()) {
        return None;
    }
    let [a, b, c, d] = e.corners.map(|q| q.as_dvec3() - p.as_dvec3());
    let distance = distance_to_triangle([a, b, c]).min(distance_to_triangle([a, c, d]));
    (distance <= f64::from(LAMP_REACH)).then_some(distance as f32)
}
