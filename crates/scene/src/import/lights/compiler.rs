//! Light entities as the light compilers take them: points with a formula.

use super::keys::{Formula, LightKeys, WorldKeys};
use super::suns;
use crate::import::notes::Notes;
use crate::light::{CompilerLight, Falloff, PointLight, Spot};
use bsp::Bsp;
use bsp::entity::Entity;
use glam::Vec3;

pub use crate::light::IRRADIANCE_PER_VALUE;

/// How far a light in solid is moved along one axis, world units.
const NUDGE: f32 = 2.0;
/// A light nearer to solid than this counts as in it, world units.
const TOUCHING: f64 = 0.1;

/// A light of `delay` 4: where nothing is between, its style's light is at least this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastLight {
    /// Number of its entity.
    pub entity: usize,
    /// Where it is, world space.
    pub position: Vec3,
    /// Least irradiance, without the brightness of its style.
    pub irradiance: Vec3,
    /// Light style.
    pub style: u16,
}

/// All that the light compilers light a level with.
#[derive(Clone, Debug)]
pub struct CompilerLights {
    /// Lights and suns that add up, in order of the entities. Their intensities lack the brightness
    /// of their styles.
    pub lights: Vec<PointLight>,
    /// For each of [`CompilerLights::lights`] the number of its entity.
    pub entities: Vec<usize>,
    /// Lights that set a least light.
    pub least: Vec<LeastLight>,
    /// Worldspawn's keys.
    pub world: WorldKeys,
}

/// What the compilers make of `keys` and of the level's sun keys.
pub fn lights(
    bsp: &Bsp,
    entities: &[Entity],
    keys: &[LightKeys],
    world: WorldKeys,
    is_shallow: bool,
    sun_samples: u32,
    notes: &mut Notes,
) -> CompilerLights {
    let mut out = CompilerLights {
        lights: Vec::new(),
        entities: Vec::new(),
        least: Vec::new(),
        world,
    };
    for light in keys {
        let place = |p: Vec3| if is_shallow { out_of_solid(bsp, p) } else { p };
        let value = light.color * (light.light * world.range * IRRADIANCE_PER_VALUE);
        if light.formula == Some(Formula::Minimum) {
            out.least.push(LeastLight {
                entity: light.entity,
                position: place(light.origin),
                irradiance: value,
                style: light.style,
            });
            continue;
        }
        let Some((falloff, divided)) = falloff(light, &world) else {
            notes.add("unknown delay", || {
                "lights with a delay that no compiler knows are left out".to_owned()
            });
            continue;
        };
        if light.light == 0.0 {
            continue;
        }
        let share = if divided {
            1.0 / light.samples as f32
        } else {
            1.0
        };
        let [cos_inner, cos_outer] = light.cone_cosines();
        for part in 0..light.samples {
            let position = light.origin + scattered(part) * light.deviance;
            out.entities.push(light.entity);
            out.lights.push(PointLight {
                position: place(position),
                radius: 1.0,
                intensity: value * share,
                spot: light.aim.map(|direction| Spot {
                    direction,
                    cos_inner,
                    cos_outer,
                }),
                style: light.style,
                compiler: Some(CompilerLight {
                    falloff,
                    angle_scale: light.angle_scale.unwrap_or(world.angle_scale),
                }),
            });
        }
    }
    for (entity, sun) in suns::suns(entities, &world, sun_samples) {
        out.entities.push(entity);
        out.lights.push(sun);
    }
    out
}

/// The formula of a light, and whether the strength of its scattered parts is shared among them.
fn falloff(light: &LightKeys, world: &WorldKeys) -> Option<(Falloff, bool)> {
    let scale = light.wait * world.distance;
    Some(match light.formula? {
        Formula::Linear if light.falloff > 0.0 => (
            Falloff::Linear {
                reach: light.falloff,
            },
            false,
        ),
        Formula::Linear => {
            let reach = light.light.abs() / scale;
            (
                Falloff::Linear {
                    reach: reach.max(f32::MIN_POSITIVE),
                },
                false,
            )
        }
        Formula::Inverse => (Falloff::Inverse { scale }, true),
        Formula::InverseSquare => (Falloff::InverseSquare { scale }, true),
        Formula::InverseSquareShifted => (Falloff::InverseSquareShifted { scale }, true),
        Formula::Infinite => (Falloff::Constant, true),
        Formula::Minimum => return None,
    })
}

/// Where part `i` of a scattered light is in the cube from -1 to 1: the first one in the middle, the
/// others by a Halton sequence, since the compilers take random places.
pub fn scattered(i: u32) -> Vec3 {
    let radical_inverse = |base: u32| {
        let (mut n, mut digit, mut sum) = (i, 1.0, 0.0);
        while n > 0 {
            digit /= base as f32;
            sum += digit * (n % base) as f32;
            n /= base;
        }
        sum
    };
    if i == 0 {
        return Vec3::ZERO;
    }
    2.0 * Vec3::new(radical_inverse(2), radical_inverse(3), radical_inverse(5)) - 1.0
}

/// A light in solid is moved by two units along the first axis that leads out, as ericw-tools does;
/// where none does it stays, and lights nothing.
fn out_of_solid(bsp: &Bsp, origin: Vec3) -> Vec3 {
    let is_solid = |p: Vec3| bsp.touches_solid(0, p.as_dvec3().to_array(), TOUCHING);
    if !is_solid(origin) {
        return origin;
    }
    [
        Vec3::NEG_X,
        Vec3::X,
        Vec3::NEG_Y,
        Vec3::Y,
        Vec3::NEG_Z,
        Vec3::Z,
    ]
    .into_iter()
    .map(|axis| origin + axis * NUDGE)
    .find(|&p| !is_solid(p))
    .unwrap_or(origin)
}
