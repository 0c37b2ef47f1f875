//! The scene's triangles in the groups that Mitsuba needs: one shape per way to reflect and emit.

use super::ply::Mesh;
use super::sky::{self, has_directions};
use super::texels::{Glow, Patch, patches};
use crate::export::manifest::Reason;
use crate::export::polygon::{Corner, area, clip, corners, fan, subdivide};
use crate::export::{Job, PlacedTriangle, placed_triangles};
use glam::{DVec2, DVec3};
use scene::material::{MAX_ALBEDO, WARP_TILE, luminance, srgb_to_linear, warp};
use scene::{Material, MaterialId, Surface};
use std::collections::BTreeMap;

/// Distance between the two sides of a surface that emits to both, world units.
pub const TWIN_GAP: f64 = 1.0 / 256.0;
/// Largest edge of a triangle of a warped surface in units of its texture coordinates, unless there
/// would be too many.
const WARP_STEP: f64 = 0.5;
/// Largest number of triangles that warped surfaces are cut into, about.
const MAX_WARPED: f64 = 5e5;
/// Largest number of pieces that an emitting material is cut into; beyond, its light is not
/// sampled.
const MAX_PIECES: f64 = 5e5;

/// How a shape reflects and emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A material that does not emit, or the parts of one that do not.
    Plain(MaterialId),
    /// One colour that emits and reflects: bits of the emission's scale, and the colours.
    Glow(u32, Glow),
    /// Emission out of a picture.
    Picture(MaterialId),
    /// Sky.
    Sky,
}

/// One shape.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// The triangles: places relative to the eye; texture coordinates where 1 is the whole texture.
    pub mesh: Mesh,
    /// Area in squared world units.
    pub area: f64,
}

/// All shapes but the lamps, and what is not quite right about them.
#[derive(Debug, Default)]
pub struct Shapes {
    /// By how they look, in a fixed order.
    pub by_kind: BTreeMap<Kind, Shape>,
    /// The frame of a sky that shows different things in different directions.
    pub sky_frame: Option<sky::Frame>,
    /// Differences.
    pub reasons: Vec<Reason>,
}

/// Linear albedo of a texel, as the transport clamps it.
#[must_use]
pub fn albedo(texel: [u8; 3]) -> [f32; 3] {
    texel.map(|c| (srgb_to_linear(c) as f32).min(MAX_ALBEDO))
}

/// Radiance of an emission texel at a scale.
#[must_use]
pub fn radiance(texel: [u8; 3], scale: f32) -> [f32; 3] {
    texel.map(|c| (srgb_to_linear(c) * f64::from(scale)) as f32)
}

/// What is done with the triangles of one material.
enum Plan {
    Plain,
    Patches(Vec<Patch>),
    Picture,
    Sky,
}

/// Sorts the scene's triangles, relative to the eye.
#[must_use]
pub fn shapes(job: &Job<'_>) -> Shapes {
    let scene = job.scene;
    let eye = job.settings.camera.position.as_dvec3();
    let triangles: Vec<PlacedTriangle> = placed_triangles(scene, eye).collect();
    let mut out = Shapes::default();
    let step = warp_step(job, &triangles, &mut out.reasons);
    let plans = plans(job, &triangles);
    if has_directions(&scene.sky) {
        let normals: Vec<DVec3> = (triangles.iter())
            .filter(|t| matches!(plans[t.material.0 as usize], Plan::Sky))
            .map(|t| t.normal)
            .collect();
        if !normals.is_empty() {
            out.sky_frame = sky::Frame::suiting(&normals);
        }
    }
    let frame = out.sky_frame;
    for triangle in &triangles {
        let material = &scene.materials[triangle.material.0 as usize];
        let texture = &scene.textures[material.base.0 as usize];
        let size = [texture.width, texture.height];
        let plain = corners(triangle);
        match &plans[triangle.material.0 as usize] {
            Plan::Sky => {
                let shape = out.by_kind.entry(Kind::Sky).or_default();
                let uv = frame.map_or([DVec2::ZERO; 3], |f| f.uv(triangle.p, triangle.normal));
                let sky: [Corner; 3] = std::array::from_fn(|i| Corner {
                    p: triangle.p[i],
                    uv: uv[i],
                });
                // The envmap's radiance does not ask for a side; a flat sky is an area light.
                let both = frame.is_none();
                shape.push(&sky, triangle.normal, both, |uv| uv);
            }
            Plan::Patches(patches) => {
                for_each_piece(&plain, size, patches, |glow, piece| {
                    let kind = glow.map_or(Kind::Plain(triangle.material), |glow| {
                        Kind::Glow(material.emission_scale.to_bits(), glow)
                    });
                    let both = glow.is_some() && material.two_sided;
                    let shape = out.by_kind.entry(kind).or_default();
                    shape.push(piece, triangle.normal, both, |uv| normalized(uv, size));
                });
            }
            plan @ (Plan::Plain | Plan::Picture) => {
                let (kind, both) = match plan {
                    Plan::Picture => (Kind::Picture(triangle.material), material.two_sided),
                    _ => (Kind::Plain(triangle.material), false),
                };
                let shape = out.by_kind.entry(kind).or_default();
                let time = f64::from(job.settings.time);
                if material.warped {
                    subdivide(plain, step, &mut |piece| {
                        shape.push(&piece, triangle.normal, both, |uv| {
                            DVec2::from(warp(uv.to_array(), time)) / WARP_TILE
                        });
                    });
                } else {
                    shape.push(&plain, triangle.normal, both, |uv| normalized(uv, size));
                }
            }
        }
    }
    out
}

fn normalized(uv: DVec2, [w, h]: [u32; 2]) -> DVec2 {
    uv / DVec2::new(f64::from(w), f64::from(h))
}

impl Shape {
    /// Adds a convex polygon, and its other side if `both`.
    fn push(&mut self, polygon: &[Corner], normal: DVec3, both: bool, uv: impl Fn(DVec2) -> DVec2) {
        let vertex = |c: Corner, p: DVec3| -> [f32; 5] {
            let uv = uv(c.uv);
            [p.x, p.y, p.z, uv.x, uv.y].map(|x| x as f32)
        };
        for [a, b, c] in fan(polygon) {
            self.mesh.push([a, b, c].map(|k| vertex(k, k.p)));
            if both {
                let back = normal * -TWIN_GAP;
                self.mesh.push([a, c, b].map(|k| vertex(k, k.p + back)));
            }
        }
        self.area += area(polygon) * if both { 2.0 } else { 1.0 };
    }
}

/// What becomes of each material's triangles.
fn plans(job: &Job<'_>, triangles: &[PlacedTriangle]) -> Vec<Plan> {
    let scene = job.scene;
    let mut tiles = vec![0.0; scene.materials.len()];
    for t in triangles {
        let texture = &scene.textures[scene.materials[t.material.0 as usize].base.0 as usize];
        let [lo, hi] = tile_range(&t.uv, [texture.width, texture.height]);
        tiles[t.material.0 as usize] += (hi[0] - lo[0] + 1.0) * (hi[1] - lo[1] + 1.0);
    }
    let plan = |(material, tiles): (&Material, f64)| {
        if material.surface == Surface::Sky {
            return Plan::Sky;
        }
        let Some(emission) = material.emission.filter(|_| material.emission_scale > 0.0) else {
            return Plan::Plain;
        };
        let emission = &scene.textures[emission.0 as usize];
        if emission.rgba.iter().all(|t| t[..3] == [0; 3]) {
            return Plan::Plain;
        }
        if material.warped {
            return Plan::Picture;
        }
        let patches = patches(&scene.textures[material.base.0 as usize], emission);
        if patches.len() as f64 * tiles > MAX_PIECES {
            Plan::Picture
        } else {
            Plan::Patches(patches)
        }
    };
    scene.materials.iter().zip(tiles).map(plan).collect()
}

/// First and last tile of a wrapped texture that the coordinates touch, across and down.
fn tile_range(uv: &[DVec2], size: [u32; 2]) -> [[f64; 2]; 2] {
    let lo = uv.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let hi = uv.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    [lo, hi].map(|at| normalized(at, size).floor().to_array())
}

/// Cuts a triangle into the patches of a wrapped texture of `size` texels.
fn for_each_piece(
    triangle: &[Corner; 3],
    size: [u32; 2],
    patches: &[Patch],
    mut take: impl FnMut(Option<Glow>, &[Corner]),
) {
    let uv = triangle.map(|c| c.uv);
    let [lo, hi] = tile_range(&uv, size);
    let (mut x, mut y) = (lo[0], lo[1]);
    while y <= hi[1] {
        while x <= hi[0] {
            for patch in patches {
                let [from, to] = patch.in_tile([x, y], size);
                let piece = clip(triangle, from, to);
                if !piece.is_empty() {
                    take(patch.glow, &piece);
                }
            }
            x += 1.0;
        }
        x = lo[0];
        y += 1.0;
    }
}

/// How finely warped surfaces are cut up, with a word on what that leaves out.
fn warp_step(job: &Job<'_>, triangles: &[PlacedTriangle], reasons: &mut Vec<Reason>) -> f64 {
    let scene = job.scene;
    let of = |t: &&PlacedTriangle| scene.materials[t.material.0 as usize].warped;
    let area: f64 = (triangles.iter().filter(of))
        .map(|t| ((t.uv[1] - t.uv[0]).perp_dot(t.uv[2] - t.uv[0])).abs() / 2.0)
        .sum();
    if area == 0.0 {
        return WARP_STEP;
    }
    // Halving makes triangles of about a sixth of the step's square.
    let step = WARP_STEP.max((6.0 * area / MAX_WARPED).sqrt());
    // Second derivative of 8 sin(2 pi v / 128), times step^2 / 8: the error of a linear
    // interpolation.
    let bend = 8.0 * (std::f64::consts::TAU / 128.0).powi(2);
    let error = bend * step * step / 8.0;
    reasons.push(Reason {
        what: "warped liquids",
        why: format!(
            "the warp is interpolated linearly over edges of at most {step:.2} units: texture \
             coordinates are off by at most {error:.4} of 64 to a tile"
        ),
        visible: error > 0.1,
    });
    step
}

/// Estimated power over pi of a shape of one radiance, for the choice among emitters.
#[must_use]
pub fn weight(shape: &Shape, radiance: [f32; 3]) -> f64 {
    shape.area * f64::from(luminance(radiance))
}
