//! `_surface` templates: copies of a light entity on all faces with a texture, one for each piece of
//! at most about 128 units.

use super::keys::LightKeys;
use crate::import::names::NameKind;
use crate::import::notes::Notes;
use bsp::Bsp;
use bsp::bsp::{Face, contents};
use glam::DVec3;

/// Size of the grid that faces are cut along, world units (GLQuake's cutting of warped surfaces).
const PIECE: f64 = 128.0;
/// Pieces less wide than this on one side of a cut are not cut off.
const LEAST: f64 = 8.0;
/// Most lights that templates make in a level.
pub const MAX_COPIES: usize = 1 << 14;

/// The lights that stand for `template`, which names a texture: copies with their own place, and
/// aim if they are spotlights. At most `room` of them.
pub fn copies(bsp: &Bsp, template: &LightKeys, room: usize, notes: &mut Notes) -> Vec<LightKeys> {
    let Some(texture) = &template.surface else {
        return Vec::new();
    };
    let mut out = Vec::new();
    for model in 0..bsp.models.len() {
        for (_, face) in bsp.drawable_faces(model) {
            let name = bsp
                .face_texture(face)
                .and_then(|i| bsp.textures.get(i)?.as_ref());
            if !name.is_some_and(|t| t.name.eq_ignore_ascii_case(texture)) {
                continue;
            }
            let Some((points, normal)) = polygon(bsp, face) else {
                continue;
            };
            let is_liquid = NameKind::of(texture).is_liquid();
            if is_liquid && !is_before_air(bsp, model, &points, normal) {
                continue;
            }
            let mut open = vec![points];
            while let Some(piece) = open.pop() {
                if out.len() + open.len() >= room {
                    notes.add("surface lights", || {
                        format!("lights on faces with texture {texture:?} are too many: some are left out")
                    });
                    return out;
                }
                match cut(&piece) {
                    Some([front, back]) => open.extend([back, front]),
                    None => out.extend(centroid(&piece).map(|centre| LightKeys {
                        origin: (centre + normal * f64::from(template.surface_offset)).as_vec3(),
                        aim: if template.surface_spotlight {
                            Some(normal.as_vec3())
                        } else {
                            template.aim
                        },
                        surface: None,
                        ..template.clone()
                    })),
                }
            }
        }
    }
    out
}

fn polygon(bsp: &Bsp, face: &Face) -> Option<(Vec<DVec3>, DVec3)> {
    let points = bsp
        .face_points(face)?
        .map(|p| DVec3::from(p.map(f64::from)))
        .collect();
    let normal = DVec3::from(bsp.face_plane(face)?.normal.map(f64::from));
    Some((points, normal.try_normalize()?))
}

/// Of the two sides of a liquid's surface the one that looks into the air counts.
fn is_before_air(bsp: &Bsp, model: usize, points: &[DVec3], normal: DVec3) -> bool {
    let Some(centre) = centroid(points) else {
        return false;
    };
    let before = (centre + normal).as_vec3().to_array();
    let found = bsp.point_contents(0, before);
    // Liquids that are brush models stand in whatever the world has there.
    model > 0 || found.is_none_or(|c| c == contents::EMPTY)
}

/// Both parts of a polygon that is cut along the first axis on which it is long enough.
fn cut(points: &[DVec3]) -> Option<[Vec<DVec3>; 2]> {
    (0..3).find_map(|axis| {
        let coordinates = || points.iter().map(|p| p[axis]);
        let low = coordinates().fold(f64::INFINITY, f64::min);
        let high = coordinates().fold(f64::NEG_INFINITY, f64::max);
        let at = PIECE * ((low + high) / 2.0 / PIECE + 0.5).floor();
        if !(high - at >= LEAST && at - low >= LEAST) {
            return None;
        }
        let mut parts = [Vec::new(), Vec::new()];
        for (i, &p) in points.iter().enumerate() {
            let q = points[(i + 1) % points.len()];
            let (a, b) = (p[axis] - at, q[axis] - at);
            if a >= 0.0 {
                parts[0].push(p);
            }
            if a <= 0.0 {
                parts[1].push(p);
            }
            if a * b < 0.0 {
                let mut crossing = p.lerp(q, a / (a - b));
                crossing[axis] = at;
                parts.iter_mut().for_each(|part| part.push(crossing));
            }
        }
        Some(parts)
    })
}

/// Centre of a convex polygon's area; `None` without area.
fn centroid(points: &[DVec3]) -> Option<DVec3> {
    let &first = points.first()?;
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for pair in points.windows(2).skip(1) {
        let area = (pair[0] - first).cross(pair[1] - first).length();
        sum += (first + pair[0] + pair[1]) * (area / 3.0);
        total += area;
    }
    let centre = sum / total;
    centre.is_finite().then_some(centre)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_are_cut_along_the_grid_and_keep_their_area() {
        let square = |size: f64| {
            [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)]
                .map(|(x, y)| DVec3::new(x, y, 5.0))
                .to_vec()
        };
        let area = |p: &[DVec3]| {
            (p.windows(2).skip(1))
                .map(|w| (w[0] - p[0]).cross(w[1] - p[0]).length() / 2.0)
                .sum::<f64>()
        };
        assert!(
            cut(&square(135.0)).is_none(),
            "7 units beyond the line stay"
        );
        let mut open = vec![square(300.0)];
        let mut pieces = Vec::new();
        while let Some(piece) = open.pop() {
            match cut(&piece) {
                Some(parts) => open.extend(parts),
                None => pieces.push(piece),
            }
        }
        assert_eq!(pieces.len(), 9);
        let total: f64 = pieces.iter().map(|p| area(p)).sum();
        assert!((total - 9e4).abs() < 1e-6, "{total}");
        let centre = centroid(&square(300.0)).unwrap();
        assert!((centre - DVec3::new(150.0, 150.0, 5.0)).length() < 1e-9);
        assert_eq!(centroid(&[DVec3::ZERO; 3]), None);
    }
}
