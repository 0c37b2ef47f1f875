//! Suns and sky domes as the light compilers take them: parallel light on what sees a sky face.

use super::compiler::{IRRADIANCE_PER_VALUE, scattered};
use super::keys::{WorldKeys, color_of, mangle_direction};
use crate::import::targets::Targets;
use crate::light::{CompilerLight, Falloff, PointLight};
use bsp::entity::Entity;
use glam::Vec3;
use std::f32::consts::TAU;

/// Suns that a penumbra is made of, and about so many a dome, as ericw-tools has it since 0.15; older
/// ones took 100.
pub const SUN_SAMPLES: u32 = 64;
/// Most of them.
pub const MAX_SUN_SAMPLES: u32 = 2048;

/// All suns of a level, each with the number of its entity. `samples` is [`SUN_SAMPLES`], or what
/// the compiler was told.
pub fn suns(entities: &[Entity], world: &WorldKeys, samples: u32) -> Vec<(usize, PointLight)> {
    let samples = samples.clamp(8, MAX_SUN_SAMPLES);
    let mut out = Vec::new();
    if let Some(keys) = entities.first() {
        let value = |key| keys.float_loose(key).unwrap_or(0.0);
        let color = |key| {
            keys.vec3_loose(key)
                .map_or(Vec3::ONE, |c| color_of(Vec3::from(c)))
        };
        let direction = |names: &[&str]| {
            (names.iter())
                .find_map(|key| keys.vec3_loose(key))
                .map_or(Vec3::NEG_Z, mangle_direction)
        };
        let spread = value("sunlight_penumbra");
        let mut add = |light: f32, color: Vec3, direction: Vec3, spread: f32| {
            let maker = Maker {
                value: light,
                color,
                angle_scale: world.angle_scale,
                range: world.range,
                style: 0,
                samples,
            };
            out.extend(maker.sun(direction, spread).map(|s| (0, s)));
        };
        let mangle = direction(&["sunlight_mangle", "sun_mangle"]);
        add(value("sunlight"), color("sunlight_color"), mangle, spread);
        add(
            value("sun2"),
            color("sun2_color"),
            direction(&["sun2_mangle"]),
            spread,
        );
        let upper = ["sunlight2_color", "sunlight_color2"];
        let lower = ["sunlight3_color", "sunlight_color3"];
        for (key, down) in [("sunlight2", Vec3::NEG_Z), ("sunlight3", Vec3::Z)] {
            // The lower dome has the upper one's colour unless it has its own.
            let own = lower.iter().filter(|_| key == "sunlight3");
            let name = own
                .chain(&upper)
                .find(|name| keys.get_loose(name).is_some());
            let maker = Maker {
                value: value(key),
                color: name.map_or(Vec3::ONE, |name| color(name)),
                angle_scale: world.angle_scale,
                range: world.range,
                style: 0,
                samples,
            };
            out.extend(maker.dome(down).map(|s| (0, s)));
        }
    }
    let targets = Targets::new(entities);
    for (number, entity) in entities.iter().enumerate().skip(1) {
        let is_set = |key| entity.float_loose(key).is_some_and(|v| v != 0.0);
        let (sun, above, below) = (is_set("sun"), is_set("sunlight2"), is_set("sunlight3"));
        if !(sun || above || below) || is_set("nostaticlight") {
            continue;
        }
        let Some(keys) = super::keys::LightKeys::of(entity, number, &targets) else {
            continue;
        };
        let maker = Maker {
            value: keys.light,
            color: keys.color,
            angle_scale: keys.angle_scale.unwrap_or(world.angle_scale),
            range: world.range,
            style: keys.style,
            samples,
        };
        if sun {
            let direction = keys
                .aim
                .or_else(|| (-keys.origin).try_normalize())
                .unwrap_or(Vec3::NEG_Z);
            out.extend(maker.sun(direction, keys.deviance).map(|s| (number, s)));
        } else {
            let down = if above { Vec3::NEG_Z } else { Vec3::Z };
            out.extend(maker.dome(down).map(|s| (number, s)));
        }
    }
    out
}

/// What suns are made with.
struct Maker {
    value: f32,
    color: Vec3,
    angle_scale: f32,
    range: f32,
    style: u16,
    samples: u32,
}

impl Maker {
    /// Parallel light along `direction` with this share of the strength.
    fn one(&self, direction: Vec3, share: f32) -> PointLight {
        PointLight {
            intensity: self.color * (self.value * share * self.range * IRRADIANCE_PER_VALUE),
            style: self.style,
            compiler: Some(CompilerLight {
                falloff: Falloff::Sun(direction),
                angle_scale: self.angle_scale,
            }),
            ..PointLight::default()
        }
    }

    /// A sun that shines along `direction`. Spread over `spread_deg` to each side it is many, which
    /// scatter evenly over that square of angles, where the compilers take random ones.
    fn sun(&self, direction: Vec3, spread_deg: f32) -> impl Iterator<Item = PointLight> {
        let count = match (self.value, spread_deg) {
            (0.0, _) => 0,
            (_, s) if s > 0.0 => self.samples,
            _ => 1,
        };
        let direction = direction.try_normalize().unwrap_or(Vec3::NEG_Z);
        let (yaw, pitch) = (
            direction.y.atan2(direction.x),
            direction.z.clamp(-1.0, 1.0).asin(),
        );
        let spread = spread_deg.max(0.0).to_radians();
        (0..count).map(move |i| {
            let off = scattered(i) * spread;
            let (yaw, pitch) = (yaw + off.x, pitch + off.y);
            let at = Vec3::new(
                yaw.cos() * pitch.cos(),
                yaw.sin() * pitch.cos(),
                pitch.sin(),
            );
            self.one(at, 1.0 / count as f32)
        })
    }

    /// A dome of suns about `down`, the way they shine at its top: n rings of 4 n suns each, evenly
    /// spaced in elevation from half a step on, each turned by an n-th of a step against the one
    /// before, and one sun at the top. With 100 samples these are 101 suns.
    fn dome(&self, down: Vec3) -> impl Iterator<Item = PointLight> {
        let elevations = (f64::from((self.samples - 1) / 4).sqrt().round() as u32).max(1);
        let around = 4 * elevations;
        let rings = if self.value > 0.0 { elevations } else { 0 };
        let share = 1.0 / (around * elevations + 1) as f32;
        let step = TAU / around as f32;
        let elevation_step = (90.0 / (elevations + 1) as f32).to_radians();
        let ring = (0..rings).flat_map(move |i| {
            let elevation = elevation_step * (i as f32 + 0.5);
            (0..around).map(move |j| {
                let angle = step * (j as f32 + i as f32 / elevations as f32);
                let flat = elevation.cos();
                Vec3::new(angle.cos() * flat, angle.sin() * flat, 0.0) + down * elevation.sin()
            })
        });
        let top = (rings > 0).then_some(down);
        ring.chain(top)
            .map(move |direction| self.one(direction, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dome_is_a_hundred_and_one_suns_of_the_strength_asked_for() {
        let maker = Maker {
            value: 128.0,
            color: Vec3::ONE,
            angle_scale: 0.5,
            range: 0.5,
            style: 0,
            samples: 100,
        };
        let dome: Vec<PointLight> = maker.dome(Vec3::NEG_Z).collect();
        assert_eq!(dome.len(), 101);
        let sum: f32 = dome.iter().map(|s| s.intensity.x).sum();
        assert!(
            (sum / (64.0 * IRRADIANCE_PER_VALUE) - 1.0).abs() < 1e-5,
            "{sum}"
        );
        let height = |s: &PointLight| match s.compiler.unwrap().falloff {
            Falloff::Sun(d) => -d.z,
            _ => f32::NAN,
        };
        assert!(dome.iter().all(|s| height(s) > 0.13 && height(s) <= 1.0));
        assert_eq!(maker.sun(Vec3::NEG_Z, 0.0).count(), 1);
        assert_eq!(maker.sun(Vec3::NEG_Z, 4.0).count(), 100);
        let dark = Maker {
            value: 0.0,
            ..maker
        };
        assert_eq!(
            dark.dome(Vec3::Z).count() + dark.sun(Vec3::X, 4.0).count(),
            0
        );
    }
}
