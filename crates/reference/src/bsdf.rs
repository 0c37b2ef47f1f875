//! How painted surfaces scatter light: Lambert's law, and microfacets over it.
//!
//! Directions are unit vectors away from the surface, `wo` towards the viewer. What the facets mean is
//! said in [`scene::gloss`].

use crate::shading::{
    eval_diffuse, orthonormal_basis, pdf_cosine_hemisphere, pdf_uniform_hemisphere,
    sample_cosine_hemisphere, sample_uniform_hemisphere,
};
use glam::DVec3;
use scene::gloss::{MIN_ROUGHNESS, TABLE_SIDE, table};
use std::f64::consts::{PI, TAU};

/// Scattering at a point, as seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf {
    /// Unit normal for shading, on the viewer's side.
    normal: DVec3,
    /// Unit normal of the face, on the viewer's side.
    face: DVec3,
    /// Unit normal of the round surface that a facet stands for, on the viewer's side.
    round: Option<DVec3>,
    wo: DVec3,
    /// Albedo of the Lambertian body.
    body: DVec3,
    gloss: Option<Facets>,
}

/// Microfacets.
#[derive(Clone, Copy, Debug)]
struct Facets {
    /// Width of GGX.
    width: f64,
    /// Reflectance straight on.
    f0: DVec3,
    /// What their light is scaled by, for what they reflect more than once.
    gain: DVec3,
    /// Probability of choosing them.
    share: f64,
}

/// What the materials say of a glossy point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GlossHere {
    pub roughness: f64,
    pub metallic: f64,
    pub specular: f64,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub direction: DVec3,
    /// Density per steradian.
    pub pdf: f64,
    /// BSDF times cosine over the density.
    pub weight: DVec3,
}

impl Bsdf {
    /// At a point of this colour; `normal` may be bent, and is bent back as far as it is not seen.
    pub fn new(
        base: DVec3,
        gloss: Option<GlossHere>,
        face: DVec3,
        normal: DVec3,
        wo: DVec3,
    ) -> Self {
        /// Least cosine between a bent normal and the viewer, before it is made a unit again.
        const SEEN: f64 = 0.02;
        let mut out = Self {
            normal,
            face,
            round: None,
            wo,
            body: base,
            gloss: None,
        };
        let cos = normal.dot(wo);
        if normal != face && cos < SEEN {
            out.normal = (normal + wo * (SEEN - cos)).normalize();
        }
        if let Some(gloss) = gloss {
            let roughness = gloss.roughness.clamp(f64::from(MIN_ROUGHNESS), 1.0);
            let f0 = DVec3::splat(0.08 * gloss.specular).lerp(base, gloss.metallic);
            let [a, b] = single_reflection(out.normal.dot(wo).max(0.0), roughness);
            // What is reflected twice and more has met the facets' colour once more (Turquin 2019).
            let gain = DVec3::ONE + f0 * (1.0 / (a + b) - 1.0);
            let facets = gain * (f0 * a + b);
            out.body *= (1.0 - gloss.metallic) * (DVec3::ONE - facets).max(DVec3::ZERO);
            let (below, above) = (luminance(out.body), luminance(facets));
            let share = match below > 0.0 {
                true => (above / (below + above)).clamp(0.1, 0.9),
                false => 1.0,
            };
            out.gloss = Some(Facets {
                width: roughness * roughness,
                f0,
                gain,
                share,
            });
        }
        out
    }

    /// The same on a facet that stands for a round surface with this unit normal on the viewer's side.
    pub fn rounded(self, round: Option<DVec3>) -> Self {
        Self { round, ..self }
    }

    /// What is left of the light from `wi` that the facet hides and the round surface does not: it goes to 0 at the
    /// horizon of the facet, smoothly, instead of ending there (Chiang, Li and Burley, "Taming the Shadow
    /// Terminator", 2019).
    fn terminator(&self, wi: DVec3) -> f64 {
        let Some(round) = self.round else { return 1.0 };
        let seen = round.dot(wi) * round.dot(self.face);
        let ratio = self.face.dot(wi);
        if seen <= 0.0 || ratio >= seen {
            return 1.0;
        }
        let ratio = ratio / seen;
        ratio * (1.0 + ratio * (1.0 - ratio))
    }

    /// Whether it reflects nothing, in no direction.
    pub fn is_black(&self) -> bool {
        self.body == DVec3::ZERO && self.gloss.is_none()
    }

    /// BSDF times cosine towards `wi`. Nothing arrives below the face's horizon.
    pub fn eval(&self, wi: DVec3) -> DVec3 {
        let cos = self.normal.dot(wi);
        if cos <= 0.0 || self.face.dot(wi) <= 0.0 {
            return DVec3::ZERO;
        }
        let facets = self.gloss.map_or(DVec3::ZERO, |g| {
            let half = (self.wo + wi).normalize();
            let cos_wo = self.cos_wo();
            let schlick = (1.0 - self.wo.dot(half)).clamp(0.0, 1.0).powi(5);
            let fresnel = g.f0 + (DVec3::ONE - g.f0) * schlick;
            let shadowing = 1.0 / (1.0 + lambda(cos_wo, g.width) + lambda(cos, g.width));
            g.gain
                * fresnel
                * (distribution(self.normal, half, g.width) * shadowing / (4.0 * cos_wo))
        });
        (eval_diffuse(self.body) * cos + facets) * self.terminator(wi)
    }

    /// Density per steradian with which [`Self::sample`] gives `wi`.
    pub fn pdf(&self, wi: DVec3) -> f64 {
        let body = pdf_cosine_hemisphere(self.normal.dot(wi));
        let Some(g) = self.gloss else { return body };
        if self.normal.dot(wi) <= 0.0 {
            return 0.0;
        }
        let half = (self.wo + wi).normalize();
        let cos_wo = self.cos_wo();
        let seen = distribution(self.normal, half, g.width) / (1.0 + lambda(cos_wo, g.width));
        let facets = seen / (4.0 * cos_wo);
        (1.0 - g.share) * body + g.share * facets
    }

    /// A direction by three uniform numbers: two for the direction, one for the part of the surface,
    /// which is asked for only if there is more than one. Its weight is 0 if it leads into the surface.
    pub fn sample(&self, u: [f64; 2], choice: impl FnOnce() -> f64) -> Sample {
        let direction = match self.gloss {
            Some(g) if choice() < g.share => {
                let half = sample_visible_facet(self.normal, self.wo, g.width, u);
                (half * (2.0 * self.wo.dot(half)) - self.wo).normalize()
            }
            _ => sample_cosine_hemisphere(self.normal, u),
        };
        let pdf = self.pdf(direction);
        let weight = match pdf > 0.0 {
            true => self.eval(direction) / pdf,
            false => DVec3::ZERO,
        };
        Sample {
            direction,
            pdf,
            weight,
        }
    }

    /// A direction uniform over the hemisphere before the face, with its density and its weight.
    pub fn sample_uniformly(&self, u: [f64; 2]) -> Sample {
        let direction = sample_uniform_hemisphere(self.face, u);
        let pdf = pdf_uniform_hemisphere();
        Sample {
            direction,
            pdf,
            weight: self.eval(direction) / pdf,
        }
    }

    fn cos_wo(&self) -> f64 {
        self.normal.dot(self.wo).max(1e-4)
    }
}

/// The table's two numbers between its entries.
fn single_reflection(cos: f64, roughness: f64) -> [f64; 2] {
    let last = (TABLE_SIDE - 1) as f64;
    let place = |x: f64| {
        let scaled = x.clamp(0.0, 1.0) * last;
        let low = (scaled as usize).min(TABLE_SIDE - 2);
        (low, scaled - low as f64)
    };
    let ((i, x), (j, y)) = (place(cos.sqrt()), place(roughness));
    let table = table();
    [0, 1].map(|k| {
        let entry = |i: usize, j: usize| f64::from(table[i + TABLE_SIDE * j][k]);
        let row = |j: usize| entry(i, j) * (1.0 - x) + entry(i + 1, j) * x;
        row(j) * (1.0 - y) + row(j + 1) * y
    })
}

fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Smith's lambda of GGX (Heitz 2014).
fn lambda(cos: f64, width: f64) -> f64 {
    let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
    ((1.0 + width * width * tan2).sqrt() - 1.0) / 2.0
}

/// GGX: facets per steradian about `half`, by area of the surface.
fn distribution(normal: DVec3, half: DVec3, width: f64) -> f64 {
    let cos2 = normal.dot(half).powi(2);
    let sin2 = normal.cross(half).length_squared();
    let squared = width * width;
    squared / (PI * (sin2 + cos2 * squared).powi(2))
}

/// A facet that `wo` sees, with density `D max(0, wo h) / (cos (1 + lambda))` per steradian (Heitz,
/// "Sampling the GGX Distribution of Visible Normals", JCGT 7(4), 2018).
fn sample_visible_facet(normal: DVec3, wo: DVec3, width: f64, u: [f64; 2]) -> DVec3 {
    let (x, y) = orthonormal_basis(normal);
    let local = DVec3::new(wo.dot(x), wo.dot(y), wo.dot(normal));
    let view = DVec3::new(local.x * width, local.y * width, local.z).normalize();
    let flat = view.x.hypot(view.y);
    let t1 = if flat > 0.0 {
        DVec3::new(-view.y, view.x, 0.0) / flat
    } else {
        DVec3::X
    };
    let t2 = view.cross(t1);
    let r = u[0].sqrt();
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let p1 = r * cos;
    let squeeze = (1.0 + view.z) / 2.0;
    let p2 = (1.0 - squeeze) * (1.0 - p1 * p1).max(0.0).sqrt() + squeeze * r * sin;
    let p3 = (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
    let h = t1 * p1 + t2 * p2 + view * p3;
    let h = DVec3::new(h.x * width, h.y * width, h.z.max(1e-12)).normalize();
    x * h.x + y * h.y + normal * h.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::shading::sample_sphere;

    fn at(cos: f64) -> DVec3 {
        DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    fn surface(base: f64, roughness: f64, metallic: f64, cos: f64) -> Bsdf {
        let gloss = GlossHere {
            roughness,
            metallic,
            specular: 0.5,
        };
        Bsdf::new(DVec3::splat(base), Some(gloss), DVec3::Z, DVec3::Z, at(cos))
    }

    /// Mean weight of samples: what is reflected of the light from all around.
    fn reflected(bsdf: &Bsdf, side: u32) -> f64 {
        let mut sum = 0.0;
        for i in 0..side {
            for j in 0..side {
                for choice in [0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95] {
                    let u = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(side));
                    sum += bsdf.sample(u, || choice).weight.x;
                }
            }
        }
        sum / (f64::from(side * side) * 10.0)
    }

    #[test]
    fn white_metal_and_white_gloss_reflect_everything_at_every_roughness() {
        for roughness in [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0] {
            for cos in [0.08, 0.2, 0.45, 0.75, 1.0] {
                // Metal in one lobe; both lobes by ranges of the choice that are whole steps.
                let metal = reflected(&surface(1.0, roughness, 1.0, cos), 160);
                assert!(
                    (metal - 1.0).abs() < 1e-3,
                    "metal {roughness} at {cos}: {metal}"
                );
                let body = surface(1.0, roughness, 0.0, cos);
                let whole = integral(&body);
                assert!(
                    (whole - 1.0).abs() < 1e-3,
                    "gloss {roughness} at {cos}: {whole}"
                );
            }
        }
    }

    /// What is reflected, by the body's share and the facets' own sampling.
    fn integral(bsdf: &Bsdf) -> f64 {
        let mut metal = *bsdf;
        metal.body = DVec3::ZERO;
        if let Some(g) = &mut metal.gloss {
            g.share = 1.0;
        }
        reflected(&metal, 160) + bsdf.body.x
    }

    #[test]
    fn densities_integrate_to_one_and_samples_follow_them() {
        let [mut rng, mut choices] =
            [1, 2].map(|seed| Rng::new(scene::render::Sampler::Independent, seed, 2, 3));
        for (roughness, metallic, cos) in [(0.3, 0.0, 0.5), (0.7, 1.0, 0.2), (1.0, 0.3, 0.9)] {
            let bsdf = surface(0.6, roughness, metallic, cos);
            // Over cells of equal solid angle: 16 of height, 32 around.
            const CELLS: [usize; 2] = [32, 32];
            let cell = |d: DVec3| {
                let z = ((d.z + 1.0) / 2.0 * CELLS[0] as f64) as usize;
                let phi = (d.y.atan2(d.x) / TAU).rem_euclid(1.0) * CELLS[1] as f64;
                z.min(CELLS[0] - 1) * CELLS[1] + (phi as usize).min(CELLS[1] - 1)
            };
            let mut expected = vec![0.0; CELLS[0] * CELLS[1]];
            let steps = 1_500_usize;
            for i in 0..steps {
                for j in 0..steps {
                    let u = [i, j].map(|k| (k as f64 + 0.5) / steps as f64);
                    let d = sample_sphere(u);
                    expected[cell(d)] += bsdf.pdf(d) * 2.0 * TAU / (steps * steps) as f64;
                }
            }
            let n = 400_000;
            let mut found = vec![0.0; expected.len()];
            let mut below = 0.0;
            for _ in 0..n {
                let sample = bsdf.sample(rng.next2(), || choices.next());
                if sample.pdf > 0.0 {
                    found[cell(sample.direction)] += 1.0;
                } else {
                    below += 1.0;
                }
            }
            let whole: f64 = expected.iter().sum::<f64>() + below / f64::from(n);
            assert!((whole - 1.0).abs() < 5e-3, "{whole}");
            let (mut chi2, mut freedom) = (0.0, 0.0);
            for (e, f) in expected.iter().zip(&found) {
                let e = e * f64::from(n);
                if e > 50.0 {
                    chi2 += (f - e) * (f - e) / e;
                    freedom += 1.0;
                }
            }
            // The mean is the number of cells, the standard deviation the root of twice that; cells
            // at the horizon are integrated roughly.
            let allowed = freedom + 6.0 * (2.0_f64 * freedom).sqrt();
            assert!(
                chi2 < allowed,
                "{chi2} over {freedom} cells, {roughness} {metallic} {cos}"
            );
        }
    }

    #[test]
    fn bent_normals_gain_nothing_and_send_nothing_below_the_face() {
        for tilt in [0.3_f64, 0.9, 1.3] {
            let normal = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            for cos in [0.05, 0.4, 0.95] {
                for wo in [at(cos), at(cos) * DVec3::new(-1.0, 1.0, 1.0)] {
                    let bent = Bsdf::new(DVec3::ONE, None, DVec3::Z, normal, wo);
                    assert!(bent.normal.dot(wo) > 0.0);
                    let rounded = bent.rounded(Some(normal));
                    let [bent, rounded] = [bent, rounded].map(|bsdf| {
                        let mut sum = 0.0;
                        for i in 0..64 {
                            for j in 0..64 {
                                let u = [i, j].map(|k| (f64::from(k) + 0.5) / 64.0);
                                let sample = bsdf.sample(u, || 0.5);
                                sum += sample.weight.x;
                                assert!(sample.direction.z > 0.0 || sample.weight == DVec3::ZERO);
                            }
                        }
                        sum / 4096.0
                    });
                    assert!(rounded <= bent && bent <= 1.0 + 1e-12);
                    // What a facet takes away is little where it is little tilted.
                    assert!(tilt > 0.5 || rounded > 0.9 * bent, "{rounded} of {bent}");
                }
            }
        }
    }
}
