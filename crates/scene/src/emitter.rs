//! Emissive triangles and the choice among them.

use crate::light::PointLight;
use glam::Vec3;

/// One emissive triangle, in world space.
#[derive(Clone, Copy, Debug)]
pub struct EmissiveTriangle {
    /// Index into `Scene::instances`.
    pub instance: u32,
    /// Index into the triangles of that instance's mesh.
    pub triangle: u32,
    /// Corner, world space.
    pub p0: Vec3,
    /// Corner, world space.
    pub p1: Vec3,
    /// Corner, world space.
    pub p2: Vec3,
    /// Area times the material's emission weight: the estimated power divided by pi.
    pub weight: f32,
}

/// Everything that can be chosen as a light, with one alias table over the estimated powers
/// (Walker 1977, Vose 1991).
///
/// The table's entries are the emissive triangles, then the point lights of the scene. An entry is
/// chosen with probability `weight / total_weight`. A point on a triangle is chosen uniformly by
/// area, so the density at a point of an emissive surface is `emission_weight / total_weight` of
/// its material per unit area, whichever triangle it lies on.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    /// The triangles.
    pub triangles: Vec<EmissiveTriangle>,
    /// Per entry the probability to keep it, and the entry to take otherwise. Triangles first, then
    /// `Scene::lights`.
    pub alias: Vec<(f32, u32)>,
    /// Sum of all weights; 0 if nothing emits.
    pub total_weight: f32,
}

impl Emitters {
    /// Builds the alias table over `triangles` and `lights`. Triangles with a weight that is not
    /// positive are left out.
    #[must_use]
    pub fn new(mut triangles: Vec<EmissiveTriangle>, lights: &[PointLight]) -> Self {
        triangles.retain(|t| t.weight > 0.0 && t.weight.is_finite());
        let weights: Vec<f64> = (triangles.iter().map(|t| t.weight))
            .chain(lights.iter().map(PointLight::weight))
            .map(f64::from)
            .collect();
        let total: f64 = weights.iter().sum();
        let alias = alias_table(&weights, total);
        Self {
            triangles,
            alias,
            total_weight: total as f32,
        }
    }
}

/// Vose's alias table over `weights` that sum to `total`.
pub(crate) fn alias_table(weights: &[f64], total: f64) -> Vec<(f32, u32)> {
    let n = weights.len();
    let mut scaled: Vec<f64> = weights.iter().map(|w| w * n as f64 / total).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    let mut table: Vec<(f32, u32)> = (0..n).map(|i| (1.0, i as u32)).collect();
    while let (Some(s), Some(l)) = (small.pop(), large.pop()) {
        table[s] = (scaled[s] as f32, l as u32);
        scaled[l] = (scaled[l] + scaled[s]) - 1.0;
        if scaled[l] < 1.0 {
            small.push(l)
        } else {
            large.push(l)
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alias_table_gives_each_weight_its_share() {
        let weights = [1.0, 5.0, 0.25, 3.0, 0.75, 10.0, 1e-3];
        let total: f64 = weights.iter().sum();
        let table = alias_table(&weights, total);
        let n = weights.len() as f64;
        let mut share = vec![0.0; weights.len()];
        for (i, &(keep, other)) in table.iter().enumerate() {
            share[i] += f64::from(keep) / n;
            share[other as usize] += (1.0 - f64::from(keep)) / n;
        }
        for (s, w) in share.iter().zip(weights) {
            assert!((s - w / total).abs() < 1e-6, "share {s}, weight {w}");
        }
    }
}
