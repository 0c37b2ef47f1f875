//! A sky as an image by direction, and a frame in which every sky face reads it.
//!
//! Mitsuba has no emitter that shines by direction from a surface. But a shape may carry any
//! emitter, and an `envmap` looks its image up by the direction towards the viewer in the surface's
//! shading frame. So the sky's mesh is given one shading frame for all its triangles: the same
//! vertex normal everywhere, and texture coordinates whose `u` runs so that its part across that
//! normal is the same everywhere.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::sky::{BACK_SPEED, BOX_SIDES, FRONT_SPEED, SkyKind, Sun, box_texel, box_uv, scroll_uv};
use scene::{Scene, Sky, Texture};

/// Pixels across; half of it, down.
pub const WIDTH: u32 = 4096;
/// Rays per pixel of the image, along each axis.
const RAYS: u32 = 4;
/// Units of a sky layer's tile, whatever its size in texels.
const TILE: f64 = 128.0;
/// Least cosine between the shading normal and a sky face.
const LEAST_COSINE: f64 = 0.02;

/// The common shading frame: right-handed, orthonormal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: DVec3,
    /// Second tangent; the poles of the image.
    pub t: DVec3,
    /// Normal of every vertex.
    pub n: DVec3,
}

impl Frame {
    /// A frame that suits all planes with these normals: the one whose normal is farthest from
    /// lying in any of them. `None` if there is none, which takes planes in a great many directions.
    #[must_use]
    pub fn suiting(normals: &[DVec3]) -> Option<Self> {
        const CANDIDATES: u32 = 256;
        let worst = |n: DVec3| {
            normals
                .iter()
                .map(|m| m.dot(n).abs())
                .fold(1.0f64, f64::min)
        };
        // Evenly spread directions (a Fibonacci lattice).
        let best = (0..CANDIDATES)
            .map(|i| {
                let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(CANDIDATES);
                let angle = f64::from(i) * 2.399_963_229_728_653;
                let r = (1.0 - z * z).sqrt();
                DVec3::new(r * angle.cos(), r * angle.sin(), z)
            })
            .max_by(|a, b| worst(*a).total_cmp(&worst(*b)))?;
        let (s, t) = best.any_orthonormal_pair();
        // Right-handed whatever the library's convention is.
        let t = if s.cross(t).dot(best) < 0.0 { -t } else { t };
        (worst(best) >= LEAST_COSINE).then_some(Self { s, t, n: best })
    }

    /// Texture coordinates of the corners of a triangle in the plane with this unit normal, so that
    /// the direction of growing `u` is the first tangent, but for a part along the frame's normal.
    #[must_use]
    pub fn uv(&self, p: [DVec3; 3], normal: DVec3) -> [DVec2; 3] {
        let along = self.s - self.n * (self.s.dot(normal) / self.n.dot(normal));
        let across = normal.cross(along);
        // Relative to the first corner: only differences matter.
        let scale = 1.0 / along.length_squared();
        p.map(|q| DVec2::new((q - p[0]).dot(along), (q - p[0]).dot(across)) * scale)
    }
}

/// What the sky shows in a direction; the transport's definition.
struct Lookup<'a> {
    picture: Picture<'a>,
    scale: [DVec3; 2],
    veil: [DVec3; 2],
    suns: &'a [Sun],
}

enum Picture<'a> {
    Flat(DVec3),
    Scrolling { back: Layer, front: Layer },
    Box(&'a [Texture]),
}

/// A layer with its radiances, and where it has scrolled to.
struct Layer {
    texels: Vec<Option<DVec3>>,
    size: [u32; 2],
    scroll: f64,
}

impl Layer {
    /// `see_through` says that texels with alpha 0 are not there.
    fn new(texture: &Texture, scroll: f64, see_through: bool) -> Self {
        let decode = |&[r, g, b, a]: &[u8; 4]| {
            let linear = DVec3::from([r, g, b].map(scene::material::srgb_to_linear));
            (a != 0 || !see_through).then_some(linear)
        };
        Self {
            texels: texture.rgba.iter().map(decode).collect(),
            size: [texture.width, texture.height],
            scroll,
        }
    }

    /// The texel at coordinates without scrolling.
    fn at(&self, uv: [f64; 2]) -> Option<DVec3> {
        let [x, y] = [0, 1].map(|i| {
            let size = i64::from(self.size[i].max(1));
            let at = ((uv[i] + self.scroll) / TILE * size as f64).floor() as i64;
            at.rem_euclid(size) as usize
        });
        *self.texels.get(y * self.size[0] as usize + x)?
    }
}

impl<'a> Lookup<'a> {
    /// `None` for no sky, or one whose pictures are not there.
    fn new(scene: &'a Scene, time: f32) -> Option<Self> {
        let layer = |id: scene::TextureId, speed, see_through| {
            let texture = scene.textures.get(id.0 as usize)?;
            Some(Layer::new(texture, f64::from(time) * speed, see_through))
        };
        Some(Self {
            picture: match scene.sky.kind {
                SkyKind::None => return None,
                SkyKind::Flat(radiance) => Picture::Flat(radiance.as_dvec3()),
                SkyKind::Box(first) => {
                    let first = first.0 as usize;
                    Picture::Box(scene.textures.get(first..first + BOX_SIDES)?)
                }
                SkyKind::Scrolling { back, front } => Picture::Scrolling {
                    back: layer(back, BACK_SPEED, false)?,
                    front: layer(front, FRONT_SPEED, true)?,
                },
            },
            scale: scene.sky.scale.map(|s| s.as_dvec3()),
            veil: scene.sky.veil.map(|v| v.as_dvec3()),
            suns: &scene.sky.suns,
        })
    }

    fn radiance(&self, direction: DVec3) -> DVec3 {
        let shown = match &self.picture {
            Picture::Flat(radiance) => *radiance,
            Picture::Box(sides) => {
                let (side, place) = box_uv(direction.to_array());
                let [r, g, b, _] = sides[side].rgba[box_texel(&sides[side], place)];
                DVec3::from([r, g, b].map(scene::material::srgb_to_linear))
            }
            Picture::Scrolling { back, front } => {
                // At time 0 nothing has scrolled.
                let uv = scroll_uv(direction.to_array(), 0.0, 0.0);
                (front.at(uv)).or_else(|| back.at(uv)).unwrap_or_default()
            }
        };
        let suns = (self.suns.iter())
            .filter(|s| {
                let off = direction.distance_squared(s.direction.as_dvec3());
                off <= 2.0 * f64::from(s.one_minus_cos)
            })
            .map(|s| s.radiance.as_dvec3());
        let half = usize::from(direction.z < 0.0);
        shown * self.scale[half] + self.veil[half] + suns.sum::<DVec3>()
    }
}

/// Whether a sky shows different things in different directions.
#[must_use]
pub fn has_directions(sky: &Sky) -> bool {
    match sky.kind {
        SkyKind::None => false,
        SkyKind::Flat(_) => {
            sky.scale[0] != sky.scale[1] || sky.veil[0] != sky.veil[1] || !sky.suns.is_empty()
        }
        SkyKind::Scrolling { .. } | SkyKind::Box(_) => true,
    }
}

/// The sky as Mitsuba's `envmap` reads it, [`WIDTH`] by half of that, rows from the top; each pixel
/// is the mean of rays through it. `None` for no sky.
///
/// Pixel `(x, y)` is the local direction `(sin p sin q, cos q, -cos p sin q)` with
/// `p = 2 pi (x + 1/2) / W` and `q = pi y / (H - 1)`: pixels are centred across and lie on the
/// poles down (found by looking up known directions in Mitsuba 3.9.1).
#[must_use]
pub fn image(scene: &Scene, time: f32, frame: &Frame) -> Option<Vec<[f32; 3]>> {
    let lookup = Lookup::new(scene, time)?;
    let (w, h) = (WIDTH, WIDTH / 2);
    let offsets: Vec<f64> = (0..RAYS)
        .map(|i| (f64::from(i) + 0.5) / f64::from(RAYS) - 0.5)
        .collect();
    let columns: Vec<(f64, f64)> = (0..w)
        .flat_map(|x| offsets.iter().map(move |o| f64::from(x) + 0.5 + o))
        .map(|x| (x * std::f64::consts::TAU / f64::from(w)).sin_cos())
        .collect();
    let rows: Vec<Vec<[f32; 3]>> = (0..h)
        .into_par_iter()
        .map(|y| {
            let lines: Vec<(f64, f64)> = (offsets.iter())
                .map(|o| (f64::from(y) + o) * std::f64::consts::PI / f64::from(h - 1))
                .map(f64::sin_cos)
                .collect();
            let pixel = |columns: &[(f64, f64)]| {
                let mut sum = DVec3::ZERO;
                for (sin, cos) in columns {
                    for (sin_q, cos_q) in &lines {
                        let direction =
                            frame.s * (sin * sin_q) + frame.t * *cos_q + frame.n * (-cos * sin_q);
                        sum += lookup.radiance(direction);
                    }
                }
                (sum / f64::from(RAYS * RAYS)).as_vec3().to_array()
            };
            columns.chunks(RAYS as usize).map(pixel).collect()
        })
        .collect();
    Some(rows.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sky_face_gets_the_same_frame() {
        let normals = [
            DVec3::Z,
            DVec3::X,
            DVec3::NEG_Y,
            DVec3::new(0.8, -0.6, 0.0),
            DVec3::new(0.3, 0.5, -0.7).normalize(),
        ];
        let frame = Frame::suiting(&normals).unwrap();
        assert!(frame.s.cross(frame.t).distance(frame.n) < 1e-12);
        for m in normals {
            let (x, y) = m.any_orthonormal_pair();
            let o = DVec3::new(100.0, -20.0, 7.0);
            let p = [o, o + x * 30.0 + y * 4.0, o - x * 5.0 + y * 50.0];
            let uv = frame.uv(p, m);
            // As renderers do it: the derivative of the place by u, from the edges.
            let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
            let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
            let dp_du = (e1 * d2.y - e2 * d1.y) / d1.perp_dot(d2);
            let s = (dp_du - frame.n * frame.n.dot(dp_du)).normalize();
            assert!(
                s.distance(frame.s) < 1e-9,
                "{m}: {s} instead of {}",
                frame.s
            );
        }
    }
}
