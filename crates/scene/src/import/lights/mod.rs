//! Light entities: what they ask for (`keys`, `templates`, `suns`), and what is made of it for the
//! physical light model (`physical`) and for that of the light compilers (`compiler`).

mod compiler;
mod keys;
mod moment;
mod physical;
mod suns;
mod templates;

pub use compiler::{CompilerLights, IRRADIANCE_PER_VALUE, LeastLight};
pub use keys::{WorldKeys, color_of, least_color, strength};
pub use moment::Moment;
pub use physical::{CLEARANCE, LIGHT_RADIUS, MIN_LIGHT_RADIUS, make_room};
pub use suns::SUN_SAMPLES;

use super::notes::Notes;
use super::targets::Targets;
use crate::import::ImportOptions;
use crate::light::{CompilerLight, Falloff, LightSums, PointLight, StyleSum};
use bsp::Level;
use bsp::entity::Entity;
use glam::Vec3;
use keys::LightKeys;

/// A light that shines now, and whose it is.
#[derive(Clone, Debug)]
pub struct EntityLight {
    /// What it makes.
    pub light: PointLight,
    /// Number of its entity.
    pub entity: usize,
    /// Its class.
    pub classname: String,
}

/// What the level's light entities ask for, with templates replaced by their copies. Suns, and
/// lights that light nothing, are left out.
fn keys(level: &Level, notes: &mut Notes) -> Vec<LightKeys> {
    let targets = Targets::new(&level.entities);
    let mut out = Vec::new();
    let mut copies = 0;
    for (number, entity) in level.entities.iter().enumerate().skip(1) {
        let Some(light) = LightKeys::of(entity, number, &targets).filter(|l| !l.elsewhere) else {
            continue;
        };
        if light.surface.is_none() {
            out.push(light);
            continue;
        }
        let room = templates::MAX_COPIES - copies;
        let made = templates::copies(&level.bsp, &light, room, notes);
        if made.is_empty() && room > 0 {
            notes.add("idle templates", || {
                let texture = light.surface.as_deref().unwrap_or_default();
                format!("a light for faces with texture {texture:?} lights nothing: there are none")
            });
        }
        copies += made.len();
        out.extend(made);
    }
    out
}

/// All light entities that shine at a moment, as spheres. `is_shallow` says that the level's tree can
/// be asked.
pub fn spheres(
    level: &Level,
    is_shallow: bool,
    moment: &Moment<'_>,
    notes: &mut Notes,
) -> Vec<EntityLight> {
    let world = WorldKeys::of(level.entities.first());
    let bsp = is_shallow.then_some(&level.bsp);
    (keys(level, notes).into_iter())
        .filter(|k| !k.starts_off || moment.is_apart(k.style) || moment.is_set(k.style))
        .filter_map(|k| {
            let mut light = physical::sphere(&k, &world, bsp, notes)?;
            light.intensity *= moment.brightness(k.style);
            let shines = light.intensity.max_element() > 0.0 && light.intensity.is_finite();
            shines.then_some(EntityLight {
                light,
                entity: k.entity,
                classname: k.classname,
            })
        })
        .collect()
}

/// All that the light compilers light the level with, whatever the time; their intensities lack the
/// brightness of their styles. `sun_samples` is how many suns stand for a penumbra or a dome,
/// [`SUN_SAMPLES`] unless the compiler was told otherwise.
pub fn compiler_lights(
    level: &Level,
    is_shallow: bool,
    sun_samples: u32,
    notes: &mut Notes,
) -> CompilerLights {
    let world = WorldKeys::of(level.entities.first());
    let keys = keys(level, notes);
    compiler::lights(
        &level.bsp,
        &level.entities,
        &keys,
        world,
        is_shallow,
        sun_samples,
        notes,
    )
}

/// The lights of the light compilers that shine at a moment.
pub fn compiler_lights_at(
    level: &Level,
    is_shallow: bool,
    moment: &Moment<'_>,
    notes: &mut Notes,
) -> Vec<EntityLight> {
    let all = compiler_lights(level, is_shallow, SUN_SAMPLES, notes);
    if moment.is_of_frames() && (!all.least.is_empty() || adds_up_in_part(&all.world)) {
        notes.add("least light", || {
            "least light (delay 4, and worldspawn's light) and _gamma are not drawn in frames"
                .to_owned()
        });
    }
    let least = (all.least.into_iter())
        .filter(|_| !moment.is_of_frames())
        .map(|least| {
            let light = PointLight {
                position: least.position,
                intensity: least.irradiance,
                style: least.style,
                compiler: Some(CompilerLight {
                    falloff: Falloff::Least,
                    angle_scale: 0.0,
                }),
                ..PointLight::default()
            };
            (light, least.entity)
        });
    (all.lights.into_iter().zip(all.entities))
        .chain(least)
        .filter_map(|(mut light, entity)| {
            light.intensity *= moment.brightness(light.style);
            let shines = light.intensity.abs().max_element() > 0.0 && light.intensity.is_finite();
            let classname = level.entities.get(entity)?.classname().to_owned();
            shines.then_some(EntityLight {
                light,
                entity,
                classname,
            })
        })
        .collect()
}

/// Whether worldspawn asks for what does not add up.
fn adds_up_in_part(world: &WorldKeys) -> bool {
    world.least > 0.0 || world.gamma != 1.0
}

/// How compiler lights become one at a moment, and puts them in the order for that; `None` if all simply
/// add up.
/// `of_models` says that brush models have least light of their own.
pub fn sums(
    level: &Level,
    moment: &Moment<'_>,
    lights: &mut [PointLight],
    of_models: bool,
) -> Option<LightSums> {
    let world = WorldKeys::of(level.entities.first());
    let is_least = |l: &PointLight| l.compiler.is_some_and(|c| c.falloff == Falloff::Least);
    let is_plain =
        !adds_up_in_part(&world) && !lights.iter().any(|l| is_least(l) || l.is_negative());
    if is_plain && !of_models || moment.is_of_frames() {
        return None;
    }
    lights.sort_by_key(|l| (l.style, l.is_negative(), is_least(l)));
    let mut styles: Vec<StyleSum> = Vec::new();
    let begin = |style: u16, first: u32| {
        let brightness = moment.brightness(style);
        let least = match style {
            0 => {
                world.least_color * (world.least * world.range * IRRADIANCE_PER_VALUE * brightness)
            }
            _ => Vec3::ZERO,
        };
        StyleSum {
            style,
            brightness,
            least,
            first,
            count: 0,
        }
    };
    if (world.least > 0.0 || of_models) && moment.brightness(0) > 0.0 {
        styles.push(begin(0, 0));
    }
    for (light, number) in lights.iter().zip(0..) {
        if styles.last().is_none_or(|s| s.style != light.style) {
            styles.push(begin(light.style, number));
        }
        if let Some(last) = styles.last_mut() {
            last.count += 1;
        }
    }
    Some(LightSums {
        gamma: world.gamma,
        styles,
    })
}

/// Least irradiance of a brush model of its own, where that is more than the world's; black otherwise, and where
/// frames say how bright styles are.
pub fn least_of_model(level: &Level, entity: &Entity, options: &ImportOptions) -> Vec3 {
    let world = WorldKeys::of(level.entities.first());
    let least = entity.float_loose("minlight").unwrap_or(0.0);
    if least <= world.least || !least.is_finite() || options.frames {
        return Vec3::ZERO;
    }
    let steady = Moment::of(level, options).brightness(0);
    least_color(entity) * (least * world.range * IRRADIANCE_PER_VALUE * steady)
}

/// Whether a brush model casts shadows for the light compilers. Those that do on themselves alone do not count, and
/// those that do on the world alone do.
pub fn casts_shadows(entity: &Entity) -> bool {
    let is_set = |key| entity.float_loose(key).is_some_and(|v| v != 0.0);
    is_set("shadow") || is_set("shadowworldonly")
}
