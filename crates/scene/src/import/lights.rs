//! Light entities into small spheres.

use super::notes::Notes;
use super::suns::is_sky_light;
use super::targets::Targets;
use crate::light::{PointLight, Spot};
use bsp::bsp::contents;
use bsp::entity::{Entity, numbers};
use bsp::styles::{Blend, FIRST_SWITCHABLE, START_OFF};
use bsp::{Bsp, Level};
use glam::Vec3;
use std::f32::consts::PI;

/// Radius of the sphere that stands for a light entity, in world units: about a lamp's size, and
/// large enough that a surface next to it is not infinitely bright.
pub const LIGHT_RADIUS: f32 = 4.0;
/// `light` where an entity does not say, or says 0.
const DEFAULT_LIGHT: f32 = 300.0;
/// Full cone of a spotlight in degrees where it does not say.
const DEFAULT_CONE_DEG: f32 = 40.0;
/// Lights in solid are moved out by 2 units at least and this much at most.
const MAX_NUDGE: f32 = 16.0;

/// The falloff formulas of the light compilers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Falloff {
    /// `light - wait * distance`.
    Linear,
    /// `128 light / (wait * distance)`.
    Inverse,
    /// `light (128 / (wait * distance))^2`.
    InverseSquare,
    /// `light (128 / (wait * distance + 128))^2`.
    InverseSquareShifted,
}

/// Radiant intensity of a white light: the one that gives the compiler's irradiance, where a
/// lightmap value `v` stands for `pi / 128 * v` and the compiler halves each light.
///
/// Only the inverse square is exact. The others are matched at one distance: the linear falloff
/// halfway out, at `light / (2 wait)`; the rest at 128 units.
fn intensity(light: f32, wait: f32, falloff: Falloff) -> f32 {
    match falloff {
        Falloff::Linear => PI * light.powi(3) / (2048.0 * wait * wait),
        Falloff::Inverse => 64.0 * PI * light / wait,
        Falloff::InverseSquare => 64.0 * PI * light / (wait * wait),
        Falloff::InverseSquareShifted => 16.0 * PI * light / (wait * wait),
    }
}

/// All light entities that shine at `time`. `shallow` says that the level's tree can be asked.
pub fn lights(level: &Level, shallow: bool, time: f64, notes: &mut Notes) -> Vec<PointLight> {
    let targets = Targets::new(&level.entities);
    level
        .entities
        .iter()
        .skip(1)
        .filter(|e| e.classname().starts_with("light"))
        .filter_map(|e| light(e, level, &targets, shallow, time, notes))
        .collect()
}

fn light(
    entity: &Entity,
    level: &Level,
    targets: &Targets<'_>,
    shallow: bool,
    time: f64,
    notes: &mut Notes,
) -> Option<PointLight> {
    let number = |key| entity.float_loose(key).unwrap_or(0.0);
    if number("nostaticlight") != 0.0 || is_sky_light(entity) {
        return None;
    }
    if entity.get_loose("surface").is_some_and(|s| !s.is_empty()) {
        notes.add("surface lights", || {
            "light entities with _surface (templates for lamps on textures) are not modelled"
                .to_owned()
        });
        return None;
    }
    let (light, color) = strength(entity);
    if light <= 0.0 {
        notes.add("negative lights", || {
            "lights with a negative value are left out: light can't be taken away".to_owned()
        });
        return None;
    }
    let falloff = match number("delay") as i32 {
        0 => Falloff::Linear,
        1 => Falloff::Inverse,
        2 => Falloff::InverseSquare,
        5 => Falloff::InverseSquareShifted,
        delay => {
            notes.add("unphysical lights", || {
                format!("lights with delay {delay} are left out: no lamp shines like that")
            });
            return None;
        }
    };
    let mut wait = Some(number("wait")).filter(|&w| w > 0.0).unwrap_or(1.0);
    let reach = number("falloff");
    if reach > 0.0 && falloff == Falloff::Linear {
        wait = light / reach;
    }
    let brightness = style(entity, level, time);
    let intensity = color * intensity(light, wait, falloff) * brightness;
    // Dark at this moment, or beyond what floats hold.
    if !(intensity.max_element() > 0.0 && intensity.is_finite()) {
        return None;
    }
    let origin = Vec3::from(entity.origin());
    let position = if shallow {
        out_of_solid(&level.bsp, origin)
    } else {
        Some(origin)
    };
    let Some(position) = position else {
        notes.add("buried lights", || {
            format!("{} lies deep in solid and is left out", entity.classname())
        });
        return None;
    };
    Some(PointLight {
        position,
        radius: LIGHT_RADIUS,
        intensity,
        spot: spot(entity, targets, origin),
    })
}

/// `light` and its colour (largest sensible component 1).
pub fn strength(entity: &Entity) -> (f32, Vec3) {
    let values: Vec<f32> = entity.get_loose("light").map_or_else(Vec::new, |text| {
        numbers(text).take(4).map(|n| n.unwrap_or(0.0)).collect()
    });
    let or_default = |light: f32| if light == 0.0 { DEFAULT_LIGHT } else { light };
    let (light, mut color) = match values[..] {
        [r, g, b, light] => (or_default(light), color_of(Vec3::new(r, g, b))),
        [r, g, b] => {
            let rgb = Vec3::new(r, g, b);
            let light = or_default(rgb.max_element());
            (light, (rgb / light).max(Vec3::ZERO))
        }
        [light, ..] => (or_default(light), Vec3::ONE),
        [] => (DEFAULT_LIGHT, Vec3::ONE),
    };
    if let Some(key) = entity.vec3_loose("color").map(Vec3::from) {
        color = color_of(key);
    }
    if color.max_element() <= 0.0 {
        color = Vec3::ONE;
    }
    (light, color)
}

/// A colour as entities write it, 0 to 255, or 0 to 1 if no component is larger.
pub fn color_of(key: Vec3) -> Vec3 {
    let rgb = key.max(Vec3::ZERO);
    if rgb.max_element() <= 1.0 {
        rgb
    } else {
        rgb / 255.0
    }
}

/// Brightness at this moment; 0 for a lamp that starts switched off.
fn style(entity: &Entity, level: &Level, time: f64) -> f32 {
    let style = entity.int("style").or(entity.int("_style"));
    let style = match style {
        Some(style) => u16::try_from(style).unwrap_or(0),
        // The spark's own default.
        None if entity.classname() == "light_fluorospark" => 10,
        None => 0,
    };
    let switchable =
        style >= FIRST_SWITCHABLE || entity.get("targetname").is_some_and(|t| !t.is_empty());
    if switchable && entity.spawnflags() & START_OFF != 0 {
        return 0.0;
    }
    level.styles.brightness(style, time, Blend::Step)
}

fn spot(entity: &Entity, targets: &Targets<'_>, origin: Vec3) -> Option<Spot> {
    let aimed = targets.of(entity).map(|target| target - origin);
    // Yaw, pitch, roll here, and a positive pitch looks up.
    let mangled = entity.vec3_loose("mangle").map(|[yaw, pitch, _]| {
        let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
        Vec3::new(
            yaw.cos() * pitch.cos(),
            yaw.sin() * pitch.cos(),
            pitch.sin(),
        )
    });
    let direction = aimed.or(mangled)?.try_normalize()?;
    let number = |key| entity.float_loose(key).filter(|&v| v > 0.0);
    let outer = number("angle").unwrap_or(DEFAULT_CONE_DEG).min(360.0);
    let inner = number("softangle").map_or(outer, |a| a.min(outer));
    let half_cosine = |deg: f32| (deg / 2.0).to_radians().cos();
    Some(Spot {
        direction,
        cos_inner: half_cosine(inner),
        cos_outer: half_cosine(outer),
    })
}

/// The nearest place in the open along one of the six axes, if the light's own is solid.
fn out_of_solid(bsp: &Bsp, origin: Vec3) -> Option<Vec3> {
    let is_solid = |p: Vec3| bsp.point_contents(0, p.to_array()) == Some(contents::SOLID);
    if !is_solid(origin) {
        return Some(origin);
    }
    // Lamps hang from ceilings more often than they stand in floors: down comes first.
    let axes = [
        Vec3::NEG_Z,
        Vec3::Z,
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
    ];
    let steps = (1..=(MAX_NUDGE / 2.0) as u16).map(|i| f32::from(i) * 2.0);
    steps
        .flat_map(|d| axes.map(|axis| (origin + axis * d, axis)))
        .find(|&(q, _)| !is_solid(q))
        .map(|(q, axis)| {
            // Not in the very surface, which would hide half of the lamp.
            let clear = q + axis * 2.0;
            if is_solid(clear) { q } else { clear }
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightmap value that the compiler writes at `d` units straight below a light.
    fn baked(light: f32, d: f32, falloff: Falloff) -> f32 {
        0.5 * match falloff {
            Falloff::Linear => light - d,
            Falloff::Inverse => light * 128.0 / d,
            Falloff::InverseSquare => light * (128.0 / d).powi(2),
            Falloff::InverseSquareShifted => light * (128.0 / (d + 128.0)).powi(2),
        }
    }

    #[test]
    fn irradiance_is_the_compilers_where_the_falloffs_are_matched() {
        let at = |falloff, d: f32| {
            let irradiance = intensity(300.0, 1.0, falloff) / (d * d);
            (irradiance / (PI / 128.0), baked(300.0, d, falloff))
        };
        for (falloff, d) in [
            (Falloff::Linear, 150.0),
            (Falloff::Inverse, 128.0),
            (Falloff::InverseSquare, 128.0),
            (Falloff::InverseSquare, 700.0),
            (Falloff::InverseSquareShifted, 128.0),
        ] {
            let (traced, baked) = at(falloff, d);
            assert!((traced / baked - 1.0).abs() < 1e-5, "{falloff:?} at {d}");
        }
        // The values of the light compiler itself, 128 units below a light of 300.
        assert_eq!(baked(300.0, 128.0, Falloff::Linear) as u8, 86);
        assert_eq!(baked(300.0, 128.0, Falloff::InverseSquare) as u8, 150);
        assert_eq!(baked(300.0, 128.0, Falloff::InverseSquareShifted) as u8, 37);
        let (traced, _) = at(Falloff::Linear, 128.0);
        assert!((traced - 103.0).abs() < 0.1, "{traced}");
    }

    #[test]
    fn colors_are_bytes_or_parts_of_one() {
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 0.003;
        let half = color_of(Vec3::new(0.5, 1.0, 0.0));
        assert!(near(half, color_of(Vec3::new(128.0, 255.0, 0.0))));
        assert!(near(color_of(Vec3::ONE), Vec3::ONE));
    }
}
