//! Which light entities stand for lamps that are drawn, too.

use super::LightMode;
use crate::emitter::Emitter;
use crate::light::PointLight;
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

/// The lights that shine in `mode`, and how many were left out in favour of a surface. `is_lamp`
/// says of an emitter whether an entity can stand for it.
pub fn choose_lights(
    lights: Vec<PointLight>,
    mode: LightMode,
    emitters: &[Emitter],
    is_lamp: impl Fn(&Emitter) -> bool,
) -> (Vec<PointLight>, usize) {
    match mode {
        LightMode::Textures => (Vec::new(), 0),
        LightMode::Entities | LightMode::All => (lights, 0),
        LightMode::Auto => {
            let lamps: Vec<&Emitter> = emitters.iter().filter(|e| is_lamp(e)).collect();
            if lamps.len().saturating_mul(lights.len()) > MAX_PAIRS {
                return (lights, 0);
            }
            let before = lights.len();
            let kept: Vec<PointLight> = lights
                .into_iter()
                .filter(|light| {
                    let beside: f32 = lamps
                        .iter()
                        .filter(|t| is_near(t, light.position))
                        .map(|t| t.weight)
                        .sum();
                    beside < LAMP_SHARE * light.weight()
                })
                .collect();
            let left_out = before - kept.len();
            (kept, left_out)
        }
    }
}

fn is_near(e: &Emitter, p: Vec3) -> bool {
    let [min, max] = e.bounds();
    let [a, b, c, d] = e.corners.map(|q| q.as_dvec3() - p.as_dvec3());
    p.cmpge(min - LAMP_REACH).all()
        && p.cmple(max + LAMP_REACH).all()
        && distance_to_triangle([a, b, c]).min(distance_to_triangle([a, c, d]))
            <= f64::from(LAMP_REACH)
}
