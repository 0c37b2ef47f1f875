//! Light entities as small spheres whose light falls with the squared distance.

use super::keys::{Formula, LightKeys, WorldKeys};
use crate::import::notes::Notes;
use crate::light::{PointLight, Spot};
use crate::mesh::nearest_on_triangle;
use bsp::Bsp;
use bsp::bsp::contents;
use glam::Vec3;
use std::f32::consts::PI;

/// Radius of the sphere that stands for a light entity, in world units: about a lamp's size, and
/// large enough that a surface next to it is not infinitely bright. `_deviance` makes it larger.
/// Where a surface is nearer even after the lamp is moved off, the sphere shrinks down to [`MIN_LIGHT_RADIUS`].
pub const LIGHT_RADIUS: f32 = 4.0;
/// A sphere is never smaller than this, world units, even if it then sticks in a surface.
pub const MIN_LIGHT_RADIUS: f32 = 0.5;
/// How far lamps are moved from surfaces, world units, where there is room: the light on a wall is then
/// at most a few times what the compilers' falloffs give there.
pub const CLEARANCE: f32 = 16.0;
/// Lights in solid are moved out by 2 units at least and this much at most.
const MAX_NUDGE: f32 = 16.0;
/// Most pairs of light and triangle compared: real levels have a few millions. Beyond, spheres keep
/// their size.
const MAX_PAIRS: usize = 1 << 30;

/// Radiant intensity of a white light: the one that gives the compiler's irradiance, where a
/// lightmap value `v` stands for `pi / 128 * v` and the compiler halves each light.
///
/// Only the inverse square is exact. The others are matched at one distance: the linear falloff
/// halfway out, at `light / (2 wait)`; the rest at 128 units.
fn intensity(light: f32, wait: f32, formula: Formula) -> Option<f32> {
    Some(match formula {
        Formula::Linear => PI * light.powi(3) / (2048.0 * wait * wait),
        Formula::Inverse => 64.0 * PI * light / wait,
        Formula::InverseSquare => 64.0 * PI * light / (wait * wait),
        Formula::InverseSquareShifted => 16.0 * PI * light / (wait * wait),
        Formula::Infinite | Formula::Minimum => return None,
    })
}

/// The sphere that stands for a light; `None`, with a remark, if no lamp shines like that. Its
/// intensity lacks the brightness of its style.
pub fn sphere(
    keys: &LightKeys,
    world: &WorldKeys,
    bsp: Option<&Bsp>,
    notes: &mut Notes,
) -> Option<PointLight> {
    if keys.light <= 0.0 {
        if keys.light < 0.0 {
            notes.add("negative lights", || {
                "lights with a negative value are left out: light can't be taken away".to_owned()
            });
        }
        return None;
    }
    let mut wait = keys.wait * world.distance;
    if keys.falloff > 0.0 && keys.formula == Some(Formula::Linear) {
        wait = keys.light / keys.falloff;
    }
    let Some(intensity) = keys.formula.and_then(|f| intensity(keys.light, wait, f)) else {
        notes.add("unphysical lights", || {
            "lights with delay 3 or 4, or one that no compiler knows, are left out: no lamp shines \
             like that"
                .to_owned()
        });
        return None;
    };
    // The compilers share a scattered light's strength among its parts, but not a linear one's.
    let parts = match keys.formula {
        Some(Formula::Linear) => keys.samples as f32,
        _ => 1.0,
    };
    let intensity = keys.color * (intensity * parts * world.range / 0.5);
    // Beyond what floats hold.
    if !(intensity.max_element() > 0.0 && intensity.is_finite()) {
        return None;
    }
    let position = match bsp {
        Some(bsp) => out_of_solid(bsp, keys.origin),
        None => Some(keys.origin),
    };
    let Some(position) = position else {
        notes.add("buried lights", || {
            format!("{} lies deep in solid and is left out", keys.classname)
        });
        return None;
    };
    let [cos_inner, cos_outer] = keys.cone_cosines();
    Some(PointLight {
        position,
        radius: LIGHT_RADIUS.max(keys.deviance),
        intensity,
        spot: keys.aim.map(|direction| Spot {
            direction,
            cos_inner,
            cos_outer,
        }),
        style: keys.style,
        compiler: None,
    })
}

/// Gives lamps room: moves those that are nearer than [`CLEARANCE`] to a surface away from it, as far
/// as there is room, and shrinks the spheres that then still stick in one, where half of their light
/// would be lost and what is left would be noise.
///
/// Mappers put light entities on the very surface of a lamp they drew, for a compiler whose light does
/// not grow without bounds as it comes near. Half of such a lamp's light would fall on a spot of a few
/// units, thousands of times as bright as its surroundings, that paths find by chance alone.
pub fn make_room<'a>(
    lights: impl ExactSizeIterator<Item = &'a mut PointLight>,
    triangles: &[[Vec3; 3]],
) {
    if lights.len().saturating_mul(triangles.len()) > MAX_PAIRS {
        return;
    }
    let boxes: Vec<[Vec3; 2]> = (triangles.iter())
        .map(|[a, b, c]| [a.min(*b).min(*c), a.max(*b).max(*c)])
        .collect();
    for light in lights {
        let reach = Vec3::splat(light.radius.max(CLEARANCE) + CLEARANCE);
        let (low, high) = (light.position - reach, light.position + reach);
        let around: Vec<[Vec3; 3]> = (triangles.iter().zip(&boxes))
            .filter(|(_, [min, max])| min.cmple(high).all() && max.cmpge(low).all())
            .map(|(corners, _)| *corners)
            .collect();
        let (position, room) = roomiest(light.position, &around);
        light.position = position;
        light.radius = light.radius.min(room).max(MIN_LIGHT_RADIUS);
    }
}

/// Where a lamp has [`CLEARANCE`] from all `triangles`, or most of it, at most as far from `start`; and
/// its distance from the nearest one.
///
/// Each step leads away from the nearest surface and stays in the sphere that no surface enters: it
/// passes through none.
fn roomiest(start: Vec3, triangles: &[[Vec3; 3]]) -> (Vec3, f32) {
    /// A step's share of the free sphere.
    const SHARE: f32 = 0.9;
    const MOST_STEPS: u32 = 16;
    let nearest = |p: Vec3| {
        let points = (triangles.iter())
            .map(|corners| nearest_on_triangle(corners.map(|c| (c - p).as_dvec3())).as_vec3());
        let away = points.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        away.unwrap_or(Vec3::INFINITY)
    };
    let (mut best, mut to_surface) = (start, nearest(start));
    let mut room = to_surface.length();
    let (mut at, mut free) = (best, room);
    for _ in 0..MOST_STEPS {
        if !(free > 0.0 && free < CLEARANCE) {
            break;
        }
        at -= to_surface * ((CLEARANCE - free).min(SHARE * free) / free);
        if at.distance(start) > CLEARANCE {
            break;
        }
        to_surface = nearest(at);
        free = to_surface.length();
        if free > room {
            (best, room) = (at, free);
        }
    }
    (best, room)
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
    fn baked(light: f32, d: f32, formula: Formula) -> f32 {
        0.5 * match formula {
            Formula::Linear => light - d,
            Formula::Inverse => light * 128.0 / d,
            Formula::InverseSquare => light * (128.0 / d).powi(2),
            Formula::InverseSquareShifted => light * (128.0 / (d + 128.0)).powi(2),
            Formula::Infinite | Formula::Minimum => light,
        }
    }

    #[test]
    fn irradiance_is_the_compilers_where_the_falloffs_are_matched() {
        let at = |formula, d: f32| {
            let irradiance = intensity(300.0, 1.0, formula).unwrap() / (d * d);
            (irradiance / (PI / 128.0), baked(300.0, d, formula))
        };
        for (formula, d) in [
            (Formula::Linear, 150.0),
            (Formula::Inverse, 128.0),
            (Formula::InverseSquare, 128.0),
            (Formula::InverseSquare, 700.0),
            (Formula::InverseSquareShifted, 128.0),
        ] {
            let (traced, baked) = at(formula, d);
            assert!((traced / baked - 1.0).abs() < 1e-5, "{formula:?} at {d}");
        }
        // The values of the light compiler itself, 128 units below a light of 300.
        assert_eq!(baked(300.0, 128.0, Formula::Linear) as u8, 86);
        assert_eq!(baked(300.0, 128.0, Formula::InverseSquare) as u8, 150);
        assert_eq!(baked(300.0, 128.0, Formula::InverseSquareShifted) as u8, 37);
        let (traced, _) = at(Formula::Linear, 128.0);
        assert!((traced - 103.0).abs() < 0.1, "{traced}");
    }

    #[test]
    fn lamps_move_away_from_surfaces_and_shrink_where_there_is_no_room() {
        let wall = |z: f32| {
            [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]]
                .map(|[x, y]| Vec3::new(x, y, 0.0) * 500.0 + Vec3::Z * z)
        };
        let at = |z: f32, radius: f32| PointLight {
            position: Vec3::new(8.0, 8.0, z),
            radius,
            ..PointLight::default()
        };
        let made = |mut light: PointLight, triangles: &[[Vec3; 3]]| {
            make_room(std::iter::once(&mut light), triangles);
            assert_eq!(light.position.truncate(), glam::Vec2::splat(8.0));
            (light.position.z, light.radius)
        };
        let floor = [wall(0.0)];
        assert_eq!(made(at(100.0, 4.0), &floor), (100.0, 4.0));
        assert_eq!(made(at(20.0, 32.0), &floor), (20.0, 20.0));
        let (z, radius) = made(at(2.0, 4.0), &floor);
        assert!(
            (z - CLEARANCE).abs() < 1e-4 && radius == 4.0,
            "{z} {radius}"
        );
        assert_eq!(made(at(-2.0, 4.0), &floor).0, -z, "each side is its own");
        // In the very surface there is no side to prefer.
        assert_eq!(made(at(0.0, 4.0), &floor), (0.0, MIN_LIGHT_RADIUS));
        // Between two walls it comes to rest about the middle, in no more room than there is.
        let (z, radius) = made(at(1.0, 4.0), &[wall(0.0), wall(6.0)]);
        assert!(
            (2.5..=3.5).contains(&z) && (radius - z.min(6.0 - z)).abs() < 1e-5,
            "{z} {radius}"
        );
    }
}
