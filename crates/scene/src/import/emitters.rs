//! Emissive triangles of a scene, and which light entities stand for the same lamps.

use super::LightMode;
use crate::emitter::EmissiveTriangle;
use crate::light::PointLight;
use crate::material::Material;
use crate::mesh::{Instance, Mesh};
use glam::Vec3;

/// A light entity within this distance (world units) of bright surfaces stands for them.
pub const LAMP_REACH: f32 = 32.0;
/// It is left out if those surfaces together have at least this part of its power: a stray bright
/// texel on a wall does not put out the torch before it.
pub const LAMP_SHARE: f32 = 1.0 / 16.0;

/// Most pairs of light and surface compared: real levels have a few millions. Beyond, all lights
/// stay.
const MAX_PAIRS: usize = 1 << 28;

/// All emissive triangles of placed meshes, in order of instances and triangles.
pub fn emissive_triangles(
    meshes: &[Mesh],
    instances: &[Instance],
    materials: &[Material],
) -> Vec<EmissiveTriangle> {
    let mut out = Vec::new();
    for (i, instance) in instances.iter().enumerate() {
        let mesh = &meshes[instance.mesh];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let density = materials[triangle.material.0 as usize].emission_weight;
            if density <= 0.0 {
                continue;
            }
            let [p0, p1, p2] = triangle.vertices.map(|v| {
                instance
                    .transform
                    .transform_point3(mesh.positions[v as usize])
            });
            let [a, b, c] = [p0, p1, p2].map(|p| p.as_dvec3());
            let area = (b - a).cross(c - a).length() / 2.0;
            let weight = (area * f64::from(density)) as f32;
            if weight > 0.0 && weight.is_finite() {
                out.push(EmissiveTriangle {
                    instance: i as u32,
                    triangle: t as u32,
                    p0,
                    p1,
                    p2,
                    weight,
                });
            }
        }
    }
    out
}

/// The lights that shine in `mode`, and how many were left out in favour of a surface. `is_lamp`
/// says of an emissive triangle whether an entity can stand for it.
pub fn choose_lights(
    lights: Vec<PointLight>,
    mode: LightMode,
    triangles: &[EmissiveTriangle],
    is_lamp: impl Fn(&EmissiveTriangle) -> bool,
) -> (Vec<PointLight>, usize) {
    match mode {
        LightMode::Textures => (Vec::new(), 0),
        LightMode::Entities | LightMode::All => (lights, 0),
        LightMode::Auto => {
            let lamps: Vec<&EmissiveTriangle> = triangles.iter().filter(|t| is_lamp(t)).collect();
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

fn is_near(t: &EmissiveTriangle, p: Vec3) -> bool {
    let lo = t.p0.min(t.p1).min(t.p2) - LAMP_REACH;
    let hi = t.p0.max(t.p1).max(t.p2) + LAMP_REACH;
    p.cmpge(lo).all()
        && p.cmple(hi).all()
        && closest_on_triangle(p, [t.p0, t.p1, t.p2]).distance_squared(p) <= LAMP_REACH * LAMP_REACH
}

/// The point of a triangle nearest to `p`: the projection if it falls inside, else the nearest
/// point of the three sides.
fn closest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let inside = |u: Vec3, v: Vec3| normal.dot((v - u).cross(p - u)) >= 0.0;
    if normal.length_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return p - normal * (normal.dot(p - a) / normal.length_squared());
    }
    let on_side = |u: Vec3, v: Vec3| {
        let side = v - u;
        let t = (p - u).dot(side) / side.length_squared().max(f32::MIN_POSITIVE);
        u + side * t.clamp(0.0, 1.0)
    };
    [on_side(a, b), on_side(b, c), on_side(c, a)]
        .into_iter()
        .min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p)))
        .unwrap_or(a)
}
