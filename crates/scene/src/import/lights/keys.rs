//! What light entities and worldspawn say about light, as numbers.
//!
//! Keys count with and without a leading `_`. Sources of the rules: the manual of ericw-tools'
//! `light`, and id Software's LIGHT.C for what both agree on.

use super::super::targets::Targets;
use bsp::entity::{Entity, numbers};
use bsp::styles::{FIRST_SWITCHABLE, START_OFF};
use glam::Vec3;

/// `light` where an entity does not say.
pub const DEFAULT_LIGHT: f32 = 300.0;
/// Full cone of a spotlight in degrees where it does not say.
const DEFAULT_CONE_DEG: f32 = 40.0;
/// Lights that `_deviance` makes of one, where it does not say.
const DEFAULT_SAMPLES: f32 = 16.0;
/// Most of them.
const MAX_SAMPLES: f32 = 256.0;
/// Distance of a template's lights from their face.
const SURFACE_OFFSET: f32 = 2.0;

/// The falloff formulas of the light compilers, by the key `delay`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formula {
    /// 0: `light - d`, or `light (1 - d / falloff)`.
    Linear,
    /// 1: `128 light / d`.
    Inverse,
    /// 2: `light (128 / d)^2`.
    InverseSquare,
    /// 3: `light`.
    Infinite,
    /// 4: at least `light`, where nothing is between.
    Minimum,
    /// 5: `light (128 / (d + 128))^2`.
    InverseSquareShifted,
}

/// What a light entity asks for.
#[derive(Clone, Debug)]
pub struct LightKeys {
    /// Number of the entity in the level.
    pub entity: usize,
    /// Its class.
    pub classname: String,
    /// Where it is.
    pub origin: Vec3,
    /// Strength in the compilers' unit: negative ones take light away.
    pub light: f32,
    /// Colour, 1 is full.
    pub color: Vec3,
    /// Factor of the distance, > 0.
    pub wait: f32,
    /// Which formula; `None` for numbers that no compiler knows.
    pub formula: Option<Formula>,
    /// Distance at which a linear light ends; 0 without.
    pub falloff: f32,
    /// Light style.
    pub style: u16,
    /// Whether it is switched off when the level starts.
    pub starts_off: bool,
    /// Direction it is aimed to, if it is.
    pub aim: Option<Vec3>,
    /// Full outer cone in degrees.
    pub cone_deg: f32,
    /// Full inner cone in degrees, at most the outer one.
    pub soft_deg: f32,
    /// Share of the cosine, if it says.
    pub angle_scale: Option<f32>,
    /// Half the side of the cube that it is scattered over; 0 without.
    pub deviance: f32,
    /// Lights that it is scattered into; 1 without.
    pub samples: u32,
    /// Texture on whose faces copies of it stand instead.
    pub surface: Option<String>,
    /// Whether those copies shine along their face's normal.
    pub surface_spotlight: bool,
    /// Their distance from the face.
    pub surface_offset: f32,
    /// Whether it is a sun or a dome, or is not to light anything.
    pub elsewhere: bool,
}

impl LightKeys {
    /// What entity number `entity` asks for; `None` if it is no light.
    pub fn of(entity: &Entity, number: usize, targets: &Targets<'_>) -> Option<Self> {
        let classname = entity.classname();
        if !classname.starts_with("light") {
            return None;
        }
        let value = |key| entity.float_loose(key).unwrap_or(0.0);
        let is_set = |key| value(key) != 0.0;
        let origin = Vec3::from(entity.origin());
        let (light, color) = strength(entity);
        let formula = match value("delay") as i32 {
            0 => Some(Formula::Linear),
            1 => Some(Formula::Inverse),
            2 => Some(Formula::InverseSquare),
            3 => Some(Formula::Infinite),
            4 => Some(Formula::Minimum),
            5 => Some(Formula::InverseSquareShifted),
            _ => None,
        };
        let cone_deg = [2.0 * value("cone"), value("angle")]
            .into_iter()
            .find(|&v| v > 0.0)
            .unwrap_or(DEFAULT_CONE_DEG)
            .min(360.0);
        let soft = value("softangle");
        let (style, starts_off) = style(entity);
        let deviance = value("deviance").max(0.0);
        let samples = Some(value("samples"))
            .filter(|&s| s > 0.0)
            .unwrap_or(DEFAULT_SAMPLES)
            .min(MAX_SAMPLES);
        Some(Self {
            entity: number,
            classname: classname.to_owned(),
            origin,
            light,
            color,
            wait: Some(value("wait")).filter(|&w| w > 0.0).unwrap_or(1.0),
            formula,
            falloff: value("falloff").max(0.0),
            style,
            starts_off,
            aim: aim(entity, targets, origin),
            cone_deg,
            soft_deg: if soft > 0.0 && soft < cone_deg {
                soft
            } else {
                cone_deg
            },
            angle_scale: ["anglesense", "anglescale"]
                .into_iter()
                .find_map(|key| entity.float_loose(key))
                .filter(|a| (0.0..=1.0).contains(a)),
            deviance,
            samples: if deviance > 0.0 { samples as u32 } else { 1 },
            surface: (entity.get_loose("surface"))
                .filter(|s| !s.is_empty())
                .map(str::to_owned),
            surface_spotlight: is_set("surface_spotlight"),
            surface_offset: Some(value("surface_offset"))
                .filter(|&o| o != 0.0)
                .unwrap_or(SURFACE_OFFSET),
            elsewhere: ["nostaticlight", "sun", "sunlight2", "sunlight3"]
                .into_iter()
                .any(is_set),
        })
    }

    /// Cosines of half the inner and half the outer cone.
    pub fn cone_cosines(&self) -> [f32; 2] {
        [self.soft_deg, self.cone_deg].map(|deg| (deg / 2.0).to_radians().cos())
    }
}

/// What worldspawn asks for, for all lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldKeys {
    /// `_dist`: factor of all distances.
    pub distance: f32,
    /// `_range`: factor of all light.
    pub range: f32,
    /// `_gamma` of the lightmaps.
    pub gamma: f32,
    /// `_anglescale` of lights that do not say.
    pub angle_scale: f32,
    /// `light` or `_minlight`: least light of all surfaces.
    pub least: f32,
    /// Its colour, 1 is full.
    pub least_color: Vec3,
}

impl WorldKeys {
    /// The keys of worldspawn.
    pub fn of(world: Option<&Entity>) -> Self {
        let value = |key| world.and_then(|w| w.float_loose(key));
        let positive = |key, default| value(key).filter(|&v| v > 0.0).unwrap_or(default);
        Self {
            distance: positive("dist", 1.0),
            range: positive("range", 0.5),
            gamma: positive("gamma", 1.0),
            angle_scale: ["anglesense", "anglescale"]
                .into_iter()
                .find_map(value)
                .filter(|a| (0.0..=1.0).contains(a))
                .unwrap_or(0.5),
            least: ["light", "minlight"]
                .into_iter()
                .find_map(value)
                .unwrap_or(0.0)
                .max(0.0),
            least_color: world.map_or(Vec3::ONE, least_color),
        }
    }
}

/// Colour of an entity's least light, 1 is full.
pub fn least_color(entity: &Entity) -> Vec3 {
    (["minlight_color", "mincolor"].into_iter())
        .find_map(|key| entity.vec3_loose(key))
        .map_or(Vec3::ONE, |key| color_of(Vec3::from(key)))
}

/// `light` and its colour (largest sensible component 1).
pub fn strength(entity: &Entity) -> (f32, Vec3) {
    let values: Vec<f32> = entity.get_loose("light").map_or_else(Vec::new, |text| {
        numbers(text).take(4).map(|n| n.unwrap_or(0.0)).collect()
    });
    let (light, mut color) = match values[..] {
        [r, g, b, light] => (light, color_of(Vec3::new(r, g, b))),
        [r, g, b] => {
            let rgb = Vec3::new(r, g, b);
            let light = rgb.max_element();
            let color = (rgb / light).max(Vec3::ZERO);
            (light, if light > 0.0 { color } else { Vec3::ONE })
        }
        [light, ..] => (light, Vec3::ONE),
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

/// The light style, and whether it is a lamp that starts switched off.
fn style(entity: &Entity) -> (u16, bool) {
    let style = match entity.int("style").or(entity.int("_style")) {
        Some(style) => u16::try_from(style).unwrap_or(0),
        // The spark's own default.
        None if entity.classname() == "light_fluorospark" => 10,
        None => 0,
    };
    let switchable =
        style >= FIRST_SWITCHABLE || entity.get("targetname").is_some_and(|t| !t.is_empty());
    (style, switchable && entity.spawnflags() & START_OFF != 0)
}

fn aim(entity: &Entity, targets: &Targets<'_>, origin: Vec3) -> Option<Vec3> {
    let aimed = targets.of(entity).map(|target| target - origin);
    let mangled = entity.vec3_loose("mangle").map(mangle_direction);
    aimed.or(mangled)?.try_normalize()
}

/// The direction of `mangle`: yaw, pitch, roll in degrees, and a positive pitch looks up.
pub fn mangle_direction([yaw, pitch, _]: [f32; 3]) -> Vec3 {
    let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
    Vec3::new(
        yaw.cos() * pitch.cos(),
        yaw.sin() * pitch.cos(),
        pitch.sin(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_bytes_or_parts_of_one() {
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 0.003;
        let half = color_of(Vec3::new(0.5, 1.0, 0.0));
        assert!(near(half, color_of(Vec3::new(128.0, 255.0, 0.0))));
        assert!(near(color_of(Vec3::ONE), Vec3::ONE));
    }
}
