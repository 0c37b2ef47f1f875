//! What a sky face shows: a picture by direction, and suns.

use crate::fog::Fog;
use crate::material::{MaterialId, Texture, TextureId, luminance};
use crate::mesh::{Instance, Mesh};
use glam::Vec3;
use std::f32::consts::PI;

/// Least share of the sky's area that a sun is taken to shine through.
const LEAST_SHARE: f32 = 1e-3;

/// Radiance seen through sky faces, by direction. A ray that hits nothing is black, not sky.
///
/// In a direction it is the picture's radiance there times [`Sky::scale`] plus [`Sky::veil`], and the
/// radiance of every sun that is seen there.
#[derive(Clone, Debug)]
pub struct Sky {
    /// The picture.
    pub kind: SkyKind,
    /// Factor of the picture, linear RGB: in directions that look up or along the ground
    /// (`z >= 0`), and in those that look down.
    pub scale: [Vec3; 2],
    /// Radiance of fog before the picture, by the same halves: added to it. 0 without
    /// [`crate::Scene::fog`].
    pub veil: [Vec3; 2],
    /// Suns.
    pub suns: Vec<Sun>,
}

impl Default for Sky {
    fn default() -> Self {
        Self {
            kind: SkyKind::None,
            scale: [Vec3::ONE; 2],
            veil: [Vec3::ZERO; 2],
            suns: Vec::new(),
        }
    }
}

/// Kinds of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SkyKind {
    /// The same radiance in every direction, linear RGB.
    Flat(Vec3),
    /// No sky.
    #[default]
    None,
    /// Quake's two scrolling layers; see [`scroll_uv`].
    Scrolling {
        /// Opaque back layer.
        back: TextureId,
        /// Front layer; alpha 0 shows the back.
        front: TextureId,
    },
    /// The six pictures of a box around the viewer, in a row from this one on, in the order of
    /// [`BOX_SIDES`]; see [`box_uv`].
    Box(TextureId),
}

/// Number of a skybox's pictures: right (towards +x), back (+y), left, front, up, down.
pub const BOX_SIDES: usize = 6;

/// Where on a skybox a direction (of any length but 0) looks: the number of the side as in
/// [`BOX_SIDES`], and the place on it, 0 to 1 from the left and from the top.
#[must_use]
pub fn box_uv([x, y, z]: [f64; 3]) -> (usize, [f64; 2]) {
    let (far_x, far_y, far_z) = (x.abs(), y.abs(), z.abs());
    let (side, across, up, far) = if far_x >= far_y && far_x >= far_z {
        if x > 0.0 {
            (0, -y, z, far_x)
        } else {
            (2, y, z, far_x)
        }
    } else if far_y >= far_z {
        if y > 0.0 {
            (1, x, z, far_y)
        } else {
            (3, -x, z, far_y)
        }
    } else if z > 0.0 {
        (4, -y, -x, far_z)
    } else {
        (5, -y, x, far_z)
    };
    (side, [0.5 + 0.5 * across / far, 0.5 - 0.5 * up / far])
}

/// A sky that fog comes and goes before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClearSky {
    /// [`Sky::scale`] without fog.
    pub scale: [Vec3; 2],
    /// Mean radiance of the picture's halves before they are scaled.
    pub mean: [Vec3; 2],
    /// Share of the sky that fog veils, 0 to 1.
    pub share: f32,
}

impl ClearSky {
    /// [`Sky::scale`] and [`Sky::veil`] before this fog.
    #[must_use]
    pub fn in_fog(&self, fog: Option<Fog>) -> [[Vec3; 2]; 2] {
        let Some(fog) = fog else {
            return [self.scale, [Vec3::ZERO; 2]];
        };
        [
            self.scale.map(|scale| scale * (1.0 - self.share)),
            [0, 1].map(|half| fog.albedo * self.scale[half] * self.mean[half] * self.share),
        ]
    }
}

/// A sun: a disc without distance, of the same radiance all over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit direction to its middle, world space.
    pub direction: Vec3,
    /// 1 - cos of the angle between its middle and its edge, which keeps its digits where that
    /// angle is small.
    pub one_minus_cos: f32,
    /// Linear RGB.
    pub radiance: Vec3,
    /// Weight among the emitters: the power that comes in through all sky faces, divided by pi, as
    /// luminance.
    pub weight: f32,
    /// Smallest and largest corner of the sky faces that it shines through, world space.
    pub window: [Vec3; 2],
}

impl Sun {
    /// A sun of this angular radius (radians, up to a right angle) that gives a surface which faces it
    /// the irradiance `irradiance`. It shines through
    /// no sky faces yet.
    #[must_use]
    pub fn new(direction: Vec3, radius: f32, irradiance: Vec3) -> Self {
        let half = (radius / 2.0).sin();
        let one_minus_cos = 2.0 * half * half;
        let projected = PI * one_minus_cos * (2.0 - one_minus_cos);
        Self {
            direction,
            one_minus_cos,
            radiance: irradiance / projected,
            weight: 0.0,
            window: [Vec3::ZERO; 2],
        }
    }

    /// Irradiance of a surface that faces the sun.
    #[must_use]
    pub fn irradiance(&self) -> Vec3 {
        self.radiance * (PI * self.one_minus_cos * (2.0 - self.one_minus_cos))
    }
}

/// The corners of all triangles of placed meshes that show the sky; `is_sky` says so of a material.
#[must_use]
pub fn sky_triangles(
    meshes: &[Mesh],
    instances: &[Instance],
    is_sky: impl Fn(MaterialId) -> bool,
) -> Vec<[Vec3; 3]> {
    let mut out = Vec::new();
    for instance in instances {
        let mesh = &meshes[instance.mesh];
        let place = |v: u32| (instance.transform).transform_point3(mesh.positions[v as usize]);
        let sky = mesh.triangles.iter().filter(|t| is_sky(t.material));
        out.extend(sky.map(|t| t.vertices.map(place)));
    }
    out
}

/// The suns with their weights: the power that comes in through the triangles of the sky. Without
/// any there are no suns.
#[must_use]
pub fn weighed_suns(mut suns: Vec<Sun>, sky: &[[Vec3; 3]]) -> Vec<Sun> {
    let areas = || (sky.iter()).map(|[a, b, c]| (*b - *a).cross(*c - *a) / 2.0);
    let total: f32 = areas().map(Vec3::length).sum();
    for sun in &mut suns {
        let projected: f32 = areas().map(|a| (-a.dot(sun.direction)).max(0.0)).sum();
        let irradiance = luminance(sun.irradiance().to_array());
        sun.weight = irradiance / PI * projected.max(LEAST_SHARE * total);
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let lit = (sky.iter().zip(areas())).filter(|(_, a)| a.dot(sun.direction) <= 0.0);
        let corners = lit.flat_map(|(corners, _)| *corners);
        sun.window = corners.fold(none, |[min, max], p| [min.min(p), max.max(p)]);
        if projected <= 0.0 {
            sun.window = [Vec3::ZERO; 2];
        }
    }
    suns.retain(|sun| sun.weight > 0.0 && sun.weight.is_finite());
    suns
}

/// Speed of the back layer in texels per second.
pub const BACK_SPEED: f64 = 8.0;
/// Speed of the front layer in texels per second.
pub const FRONT_SPEED: f64 = 16.0;

/// Texture coordinates of a sky layer, in texels of a 128-texel tile.
///
/// `direction` is the ray's direction (any length), `time` in seconds, `speed` in texels per second.
/// The sky is a flattened dome: `z` is tripled, the direction is scaled to length 378, and `x`, `y`
/// plus the scroll are the coordinates (Quake's `EmitSkyPolys`).
#[must_use]
pub fn scroll_uv(direction: [f64; 3], time: f64, speed: f64) -> [f64; 2] {
    let [x, y, z] = [direction[0], direction[1], direction[2] * 3.0];
    let k = 378.0 / (x * x + y * y + z * z).sqrt();
    [time * speed + x * k, time * speed + y * k]
}

/// Index of the texel at a place from 0 to 1 on a side of a skybox: the nearest, and at the edges the
/// last one.
#[must_use]
pub fn box_texel(side: &Texture, [u, v]: [f64; 2]) -> usize {
    let at = |place: f64, size: u32| ((place * f64::from(size)) as usize).min(size as usize - 1);
    at(v, side.height) * side.width as usize + at(u, side.width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_back_layer_matches_the_engine() {
        let [u, v] = scroll_uv([1.0, 1.0, 1.0], 0.0, BACK_SPEED);
        assert!((u / 128.0 - 0.8904).abs() < 1e-4 && (v / 128.0 - 0.8904).abs() < 1e-4);
        assert_eq!(scroll_uv([0.0, 0.0, 1.0], 0.0, BACK_SPEED), [0.0, 0.0]);
    }

    #[test]
    fn skyboxes_show_their_sides_as_the_engine_does() {
        // Eye to eye with each side; what is seen up on it, and to the right.
        for (side, ahead, right, up) in [
            (0, [1., 0., 0.], [0., -1., 0.], [0., 0., 1.]),
            (1, [0., 1., 0.], [1., 0., 0.], [0., 0., 1.]),
            (2, [-1., 0., 0.], [0., 1., 0.], [0., 0., 1.]),
            (3, [0., -1., 0.], [-1., 0., 0.], [0., 0., 1.]),
            (4, [0., 0., 1.], [0., -1., 0.], [-1., 0., 0.]),
            (5, [0., 0., -1.], [0., -1., 0.], [1., 0., 0.]),
        ] {
            let at = |r: f64, u: f64| {
                box_uv([0, 1, 2].map(|i| 3.0 * (ahead[i] + r * right[i] + u * up[i])))
            };
            assert_eq!(at(0.0, 0.0), (side, [0.5, 0.5]));
            assert_eq!(at(0.5, 0.0), (side, [0.75, 0.5]));
            assert_eq!(at(0.0, 0.5), (side, [0.5, 0.25]));
        }
        assert_eq!(box_uv([1.0, -0.5, 0.5]), (0, [0.75, 0.25]));
    }

    #[test]
    fn small_suns_keep_their_digits() {
        for degrees in [1e-3f32, 0.27, 10.0, 90.0] {
            let sun = Sun::new(Vec3::Z, degrees.to_radians(), Vec3::splat(2.0));
            let radius = f64::from(degrees).to_radians();
            let exact = 2.0 * (radius / 2.0).sin().powi(2);
            assert!((f64::from(sun.one_minus_cos) / exact - 1.0).abs() < 1e-6);
            let radiance = 2.0 / (std::f64::consts::PI * radius.sin().powi(2));
            assert!((f64::from(sun.radiance.x) / radiance - 1.0).abs() < 1e-6);
            assert!((sun.irradiance().x - 2.0).abs() < 1e-5);
        }
    }
}
