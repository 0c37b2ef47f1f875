//! Fog: worldspawn's keys `fog` and `skyfog`.
//!
//! Engines blend what they draw with a colour, by a share that grows with the squared distance:
//! `exp(-(density d / 64)^2)` of a surface is seen through it. Light that is absorbed and scattered on
//! its way knows no such law, since what is lost on two halves of a way must be lost on the whole. So
//! the medium is homogeneous, `exp(-extinction d)`, and half of the light is left where engines show
//! half: `(density d / 64)^2 = ln 2` at `d = 64 sqrt(ln 2) / density`, and so
//! `extinction = ln 2 / d = density sqrt(ln 2) / 64`. Nearer than that it hides more than in an engine,
//! farther away less. The colour, decoded like a texel, is what the fog scatters: it shines as far as
//! it is lit.

use super::notes::Notes;
use crate::fog::Fog;
use crate::material::decode_srgb;
use bsp::entity::{Entity, numbers};
use glam::Vec3;

/// Each missing number of the colour.
const GREY: f32 = 0.3;
/// Share of the sky that is fogged where the level does not say.
pub const SKY_FOG: f32 = 0.5;
/// Largest density: half of the light is left after half a unit.
pub const MAX_FOG_DENSITY: f32 = 100.0;
/// Distance that densities are counted in, world units.
const UNIT: f32 = 64.0;

/// Fog as levels ask for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogKeys {
    /// Density, 0 to [`MAX_FOG_DENSITY`]; 0 is no fog.
    pub density: f32,
    /// Colour as it is shown, 0 to 1.
    pub color: [f32; 3],
}

impl FogKeys {
    /// Fog of a density and a colour; what is out of its range is the nearest that is not, and what is no
    /// number is 0.
    #[must_use]
    pub fn new(density: f32, color: [f32; 3]) -> Self {
        let within = |x: f32, most: f32| if x > 0.0 { x.min(most) } else { 0.0 };
        Self {
            density: within(density, MAX_FOG_DENSITY),
            color: color.map(|x| within(x, 1.0)),
        }
    }

    /// No fog.
    pub const OFF: Self = Self {
        density: 0.0,
        color: [GREY; 3],
    };

    /// Reads "density red green blue"; missing colours are 0.3 each, as engines have it. Also says what
    /// of it could not be taken as it stands, once.
    #[must_use]
    pub fn read(text: &str) -> (Self, Option<String>) {
        let mut keys = Self::OFF;
        let mut odd = None;
        let mut number = |value: Option<f32>, what: &str, most: f32, instead: f32| {
            let taken = value.map_or(instead, |v| v.clamp(0.0, most));
            if value != Some(taken) {
                odd.get_or_insert(format!(
                    "its {what} is no number from 0 to {most}, {taken} is taken"
                ));
            }
            taken
        };
        let mut words = numbers(text);
        keys.density = number(words.next().flatten(), "density", MAX_FOG_DENSITY, 0.0);
        for (to, word) in keys.color.iter_mut().zip(words) {
            *to = number(word, "colour", 1.0, GREY);
        }
        (keys, odd)
    }

    /// The medium; `None` without fog.
    #[must_use]
    pub fn medium(&self) -> Option<Fog> {
        (self.density > 0.0).then(|| Fog {
            extinction: self.density * std::f32::consts::LN_2.sqrt() / UNIT,
            albedo: Vec3::from(self.color.map(|c| decode_srgb(f64::from(c)) as f32)),
        })
    }
}

/// The level's fog, and the share of its sky that is fogged.
pub fn of_level(world: Option<&Entity>, notes: &mut Notes) -> (FogKeys, f32) {
    let text = |key| world.and_then(|w| w.get_loose(key));
    let keys = text("fog").map_or(FogKeys::OFF, |text| {
        let (keys, odd) = FogKeys::read(text);
        if let Some(odd) = odd {
            notes.add("fog", || format!("worldspawn's fog is {text:?}: {odd}"));
        }
        keys
    });
    let share = text("skyfog").map_or(SKY_FOG, |text| {
        let number = numbers(text).next().flatten();
        let taken = number.map_or(SKY_FOG, |v| v.clamp(0.0, 1.0));
        if number != Some(taken) {
            notes.add("skyfog", || {
                format!("worldspawn's skyfog is {text:?}: no number from 0 to 1, {taken} is taken")
            });
        }
        taken
    });
    (keys, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::ClearSky;

    #[test]
    fn the_key_is_read_as_engines_do() {
        for (text, density, color) in [
            ("0.05", 0.05, [0.3; 3]),
            ("0.015 1 1 1", 0.015, [1.0; 3]),
            (" .1  .2\t1e-1 +1 junk", 0.1, [0.2, 0.1, 1.0]),
            ("0.05 0.5", 0.05, [0.5, 0.3, 0.3]),
            ("0", 0.0, [0.3; 3]),
        ] {
            let (keys, odd) = FogKeys::read(text);
            assert_eq!((keys.density, keys.color), (density, color), "{text}");
            assert_eq!(odd, None, "{text}");
        }
        for (text, density, color) in [
            ("-1", 0.0, [0.3; 3]),
            ("", 0.0, [0.3; 3]),
            ("nan -2 0.5 7", 0.0, [0.0, 0.5, 1.0]),
            ("1e300 1e300", 0.0, [0.3; 3]),
            ("1000 255 255 255", 100.0, [1.0; 3]),
        ] {
            let (keys, odd) = FogKeys::read(text);
            assert_eq!((keys.density, keys.color), (density, color), "{text}");
            assert!(odd.is_some(), "{text}");
        }
    }

    #[test]
    fn half_is_left_where_engines_show_half() {
        assert_eq!(FogKeys::OFF.medium(), None);
        for density in [0.015_f32, 0.05, 1.0] {
            let (keys, _) = FogKeys::read(&density.to_string());
            let distance = keys.medium().unwrap().half_distance();
            let engine = (-(density * distance / 64.0).powi(2)).exp();
            assert!((engine - 0.5).abs() < 1e-6, "{density}: {engine}");
        }
    }

    #[test]
    fn a_white_veil_keeps_the_mean_of_the_sky() {
        let sky = ClearSky {
            scale: [Vec3::splat(2.0), Vec3::splat(3.0)],
            mean: [Vec3::new(0.2, 0.3, 0.4), Vec3::ONE],
            share: 0.75,
        };
        let [scale, veil] = sky.in_fog(FogKeys::read("1 1 1 1").0.medium());
        for half in 0..2 {
            let seen = scale[half] * sky.mean[half] + veil[half];
            assert!(
                (seen - sky.scale[half] * sky.mean[half])
                    .abs()
                    .max_element()
                    < 1e-6
            );
        }
        assert_eq!(scale[0], Vec3::splat(0.5));
        assert_eq!(sky.in_fog(None), [sky.scale, [Vec3::ZERO; 2]]);
    }
}
