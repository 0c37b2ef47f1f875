//! Gloss and metal: what both renderers mean by it, and the table that keeps its energy.
//!
//! A glossy surface has microfacets distributed by GGX (Walter et al. 2007) with height-correlated
//! Smith shadowing (Heitz 2014) and Schlick's Fresnel term, over a Lambertian body that gets what the
//! facets do not reflect. Light that facets reflect more than once is given back by scaling (Turquin,
//! "Practical multiple scattering compensation for microfacet models", 2019), for which one has to
//! know how much one reflection gives: that is the table.

use crate::material::TextureId;
use std::f64::consts::PI;
use std::sync::OnceLock;

/// A gloss over a painted surface, or metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// How rough the surface looks, 0 to 1; GGX's width is its square, of at least
    /// [`MIN_ROUGHNESS`].
    pub roughness: f32,
    /// Share that is metal: it reflects its base colour and has no body. 0 to 1.
    pub metallic: f32,
    /// Reflectance of what is no metal, seen straight on, is 0.08 times this. 0 to 1.
    pub specular: f32,
    /// Factor of the roughness by texel: the red byte / 255. Of the base texture's size.
    pub roughness_map: Option<TextureId>,
}

/// Smoother surfaces count as this rough: a mirror's peak cannot be told in single precision.
pub const MIN_ROUGHNESS: f32 = 0.05;

/// Rows and columns of the table.
pub const TABLE_SIDE: usize = 40;

/// Share of light that one reflection by the facets gives back, as two numbers `[a, b]`: with
/// reflectance `f0` straight on it is `f0 a + b`.
///
/// Entry `i + TABLE_SIDE j` is for the cosine `(i / (TABLE_SIDE - 1))^2` with the normal and the
/// roughness `j / (TABLE_SIDE - 1)`, [`MIN_ROUGHNESS`] at least. Between them it is linear in the
/// square root of the cosine and in the roughness.
#[must_use]
pub fn table() -> &'static [[f32; 2]] {
    static TABLE: OnceLock<Vec<[f32; 2]>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let at = |i: usize| i as f64 / (TABLE_SIDE - 1) as f64;
        (0..TABLE_SIDE * TABLE_SIDE)
            .map(|entry| {
                let root = at(entry % TABLE_SIDE);
                let roughness = at(entry / TABLE_SIDE).max(f64::from(MIN_ROUGHNESS));
                reflected(root * root, roughness * roughness).map(|v| v as f32)
            })
            .collect()
    })
}

/// The integral behind an entry, for GGX's width `alpha`.
fn reflected(cos: f64, alpha: f64) -> [f64; 2] {
    /// Facets along each of the two numbers that choose them; the integrand is smooth.
    const STEPS: [usize; 2] = [48, 128];
    // At the horizon itself nothing is seen: a hair above stands for it.
    let cos = cos.max(1e-4);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let shadow = |cos: f64| {
        let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        ((1.0 + alpha * alpha * tan2).sqrt() - 1.0) / 2.0
    };
    // Facets that are seen, by the projection of a cap (Dupuy and Benyoub 2023). The two halves of
    // the cap mirror each other.
    let seen = {
        let (x, z) = (sin * alpha, cos);
        let length = x.hypot(z);
        [x / length, z / length]
    };
    let mut sums = [0.0; 2];
    for i in 0..STEPS[0] {
        let phi = PI * (i as f64 + 0.5) / STEPS[0] as f64;
        for j in 0..STEPS[1] {
            let z = 1.0 - (j as f64 + 0.5) / STEPS[1] as f64 * (1.0 + seen[1]);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let half = [
                (r * phi.cos() + seen[0]) * alpha,
                r * phi.sin() * alpha,
                z + seen[1],
            ];
            let length = (half[0] * half[0] + half[1] * half[1] + half[2] * half[2]).sqrt();
            let to_facet = (sin * half[0] + cos * half[2]) / length;
            let out = 2.0 * to_facet * half[2] / length - cos;
            if out > 0.0 && to_facet > 0.0 {
                // Height-correlated shadowing over that of the viewer's side alone.
                let kept = (1.0 + shadow(cos)) / (1.0 + shadow(cos) + shadow(out));
                let grazing = (1.0 - to_facet).max(0.0).powi(5);
                sums[0] += kept * (1.0 - grazing);
                sums[1] += kept * grazing;
            }
        }
    }
    sums.map(|s| s / (STEPS[0] * STEPS[1]) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_lies_between_nothing_and_everything() {
        let table = table();
        assert_eq!(table.len(), TABLE_SIDE * TABLE_SIDE);
        for [a, b] in table {
            assert!(*a >= 0.0 && *b >= 0.0 && a + b <= 1.0 + 1e-6, "{a} {b}");
        }
        // Almost a mirror straight on. At the width 1 facets face every way alike, and the integral is
        // that of 2 - 1/x from 1/2 to 1.
        let whole = |i: usize| table[i][0] + table[i][1];
        assert!((whole(TABLE_SIDE - 1) - 1.0).abs() < 1e-4);
        let roughest = whole(TABLE_SIDE * TABLE_SIDE - 1);
        let expected = 1.0 - std::f32::consts::LN_2;
        assert!((roughest - expected).abs() < 2e-4, "{roughest}");
    }
}
