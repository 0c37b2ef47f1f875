//! Whether rays can leave a level: is its outside solid, and does each solid have its face?

use super::names::NameKind;
use super::weld::CellMap;
use bsp::Bsp;
use bsp::bsp::{Face, contents};
use glam::{DVec3, Vec3};

/// Distance from an open edge at which solid and open are told apart, world units.
const PROBE: f64 = 0.25;
/// Directions around an edge that are probed.
const DIRECTIONS: usize = 24;
/// Most open edges looked at: so many have no other reason than holes.
const MAX_EDGES: usize = 1 << 14;
/// How near a face must be to close a place, world units.
const NEAR: f64 = 0.125;

/// Whether the level's outside is solid: a compiler fills it only if no path leads out of the
/// level. Several points are asked, well outside of everything drawn.
pub fn outside_is_solid(bsp: &Bsp) -> bool {
    let model = &bsp.models[0];
    let [lo, hi] = [model.mins, model.maxs].map(|c| DVec3::from(c.map(f64::from)));
    if !(lo.is_finite() && hi.is_finite()) {
        return false;
    }
    let middle = (lo + hi) / 2.0;
    let far = (hi - lo) / 2.0 + 64.0;
    (0..27).filter(|&i| i != 13).all(|i| {
        let way = DVec3::new(
            f64::from(i % 3 - 1),
            f64::from(i / 3 % 3 - 1),
            f64::from(i / 9 - 1),
        );
        is_closed(bsp, middle + way * far)
    })
}

/// Solid, or a sky brush, which is as solid to light.
fn is_closed(bsp: &Bsp, p: DVec3) -> bool {
    matches!(
        bsp.point_contents(0, p.as_vec3().to_array()),
        Some(contents::SOLID | contents::SKY)
    )
}

/// Of the open edges those beside which the surface of solid has no face, so that rays can enter
/// the solid and leave the level. Most open edges are harmless: they lie on another face.
pub fn holes(bsp: &Bsp, positions: &[Vec3], open: &[(u32, u32)]) -> Vec<DVec3> {
    let mut covers: CellMap<u32, bool> = CellMap::default();
    open.iter()
        .take(MAX_EDGES)
        .filter_map(|&(a, b)| {
            let [a, b] = [a, b].map(|i| positions[i as usize].as_dvec3());
            let along = (b - a).try_normalize()?;
            // Pieces too short to probe are too short to matter.
            if a.distance(b) < 4.0 * NEAR {
                return None;
            }
            let middle = (a + b) / 2.0;
            let (x, y) = along.any_orthonormal_pair();
            let at = |i: f64| {
                let angle = (i + 0.37) / DIRECTIONS as f64 * std::f64::consts::TAU;
                middle + (x * angle.cos() + y * angle.sin()) * PROBE
            };
            let closed: Vec<bool> = (0..DIRECTIONS)
                .map(|i| is_closed(bsp, at(i as f64)))
                .collect();
            let is_hole = (0..DIRECTIONS).any(|i| {
                let next = (i + 1) % DIRECTIONS;
                if closed[i] == closed[next] {
                    return false;
                }
                // Halve the arc down to the place where solid begins.
                let (mut lo, mut hi) = (i as f64, i as f64 + 1.0);
                for _ in 0..12 {
                    let mid = (lo + hi) / 2.0;
                    if is_closed(bsp, at(mid)) == closed[i] {
                        lo = mid;
                    } else {
                        hi = mid;
                    }
                }
                let open_side = if closed[i] { hi } else { lo };
                !has_face(bsp, at(open_side), &mut covers)
            });
            is_hole.then_some(middle)
        })
        .collect()
}

/// Whether a drawn face that can close a level passes near `p`, a point in the open.
fn has_face(bsp: &Bsp, p: DVec3, covers: &mut CellMap<u32, bool>) -> bool {
    let leaf = bsp
        .point_leaf(0, p.as_vec3().to_array())
        .and_then(|l| bsp.leafs.get(l));
    let Some(leaf) = leaf else { return true };
    bsp.leaf_faces(leaf).any(|index| {
        let Some(face) = bsp.faces.get(index) else {
            return false;
        };
        let closes = *covers
            .entry(index as u32)
            .or_insert_with(|| can_close(bsp, face));
        closes && is_near(bsp, face, p)
    })
}

fn can_close(bsp: &Bsp, face: &Face) -> bool {
    let texture = bsp
        .face_texture(face)
        .and_then(|i| bsp.textures.get(i)?.as_ref());
    let kind = texture.map_or(NameKind::Plain, |t| NameKind::of(&t.name));
    face.is_valid() && kind != NameKind::Tool && !kind.is_liquid()
}

/// Whether `p` lies within [`NEAR`] of a face's plane and of its inside.
fn is_near(bsp: &Bsp, face: &Face, p: DVec3) -> bool {
    let (Some(plane), Some(points)) = (bsp.face_plane(face), bsp.face_points(face)) else {
        return false;
    };
    let normal = DVec3::from(plane.normal.map(f64::from));
    if (normal.dot(p) - f64::from(plane.distance)).abs() > NEAR {
        return false;
    }
    let points: Vec<DVec3> = points.map(|q| DVec3::from(q.map(f64::from))).collect();
    (0..points.len()).all(|i| {
        let (a, b) = (points[i], points[(i + 1) % points.len()]);
        // Clockwise seen from the front: the inside is to the right.
        let inwards = (b - a).cross(normal).normalize_or_zero();
        inwards.dot(p - a) >= -NEAR
    })
}
