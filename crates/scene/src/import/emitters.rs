//! Emissive triangles of a scene, and which light entities stand for the same lamps.

use super::LightMode;
use crate::emitter::EmissiveTriangle;
use crate::light::PointLight;
use crate::material::Material;
use crate::mesh::{Instance, Mesh, distance_to_triangle};
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
        && distance_to_triangle([t.p0, t.p1, t.p2].map(|q| q.as_dvec3() - p.as_dvec3()))
            <= f64::from(LAMP_REACH)
}
