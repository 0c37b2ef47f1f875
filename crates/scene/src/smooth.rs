//! Normals that let the facets of models look as round as they are meant: those of the file, or what suits the facets.

use crate::mesh::{Mesh, PoseBlend, Triangle};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Facets that meet under less than 60 degrees in the first pose are of one surface; others meet in an edge.
const CREASE_COS: f32 = 0.5;
/// Facets around a vertex, above which they stay flat: so many are no surface.
const MOST_AROUND: usize = 64;
/// Triangles in all poses of a mesh, above which it stays flat: their normals take 12 bytes each.
const MOST_NORMALS: usize = 1 << 22;
/// Poses that tell whether two vertices are always in one place.
const LOOKED_AT: usize = 8;

/// A unit vector in 32 bits: its octahedral coordinates (Cigolle et al. 2014), 16 bits each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackedNormal(pub u32);

impl PackedNormal {
    /// The nearest to a vector, which need not have unit length; +Z for one without direction.
    #[must_use]
    pub fn new(n: Vec3) -> Self {
        let sum = n.abs().element_sum();
        let n = if sum > 0.0 && sum.is_finite() {
            n / sum
        } else {
            Vec3::Z
        };
        let p = fold(n.truncate(), n.z);
        let [u, v] = p.to_array().map(|c| (c * 32_767.0).round() as i16 as u16);
        Self(u32::from(u) | u32::from(v) << 16)
    }

    /// The unit vector.
    #[must_use]
    pub fn get(self) -> Vec3 {
        let [u, v] = [self.0 as u16, (self.0 >> 16) as u16];
        let p = Vec2::from([u, v].map(|c| (f32::from(c.cast_signed()) / 32_767.0).max(-1.0)));
        let z = 1.0 - p.x.abs() - p.y.abs();
        fold(p, z).extend(z).normalize()
    }
}

/// The lower half of the octahedron is folded outwards over the corners of the upper one, and back.
fn fold(p: Vec2, z: f32) -> Vec2 {
    if z >= 0.0 {
        return p;
    }
    let folded = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    Vec2::new(folded(p.x, p.y), folded(p.y, p.x))
}

impl Mesh {
    /// Gives the mesh normals for shading ([`Mesh::normals`]): at each corner of a facet the mean of the facets around the
    /// vertex that are of one surface with it, each weighted by its angle there (Thuermer and Wuethrich 1998). A mesh
    /// of edges alone stays flat.
    pub fn make_smooth(&mut self) {
        let poses = self.all_poses();
        self.normals = match poses.len().saturating_mul(self.triangles.len()) {
            0..=MOST_NORMALS => normals(&self.triangles, poses),
            _ => Vec::new(),
        };
    }

    /// Gives the mesh these normals for shading: those of all vertices, for each pose (one, if it has none), in its
    /// space. At corners of facets that they do not point out of, the facet's own stands for them. Where all are the
    /// same, they say nothing, and the mesh is made smooth as if there were none.
    pub fn shade_with(&mut self, of_poses: &[Vec<Vec3>]) {
        let first = of_poses.iter().flatten().next();
        if of_poses.iter().flatten().all(|n| Some(n) == first) {
            self.make_smooth();
            return;
        }
        let poses = self.all_poses();
        self.normals = if poses.len().saturating_mul(self.triangles.len()) > MOST_NORMALS {
            Vec::new()
        } else {
            let of_facet = |t: &Triangle, pose: &[Vec3], normals: &[Vec3]| {
                let own = facet(pose, t);
                t.vertices.map(|v| {
                    let given = normals
                        .get(v as usize)
                        .filter(|n| n.is_finite() && n.dot(own) > 0.0);
                    PackedNormal::new(*given.unwrap_or(&own))
                })
            };
            let of_pose = |(pose, normals): (&Vec<Vec3>, &Vec<Vec3>)| {
                let facets = self.triangles.iter();
                facets.map(|t| of_facet(t, pose, normals)).collect()
            };
            poses.iter().zip(of_poses).map(of_pose).collect()
        };
    }

    fn all_poses(&self) -> &[Vec<Vec3>] {
        if self.poses.is_empty() {
            std::slice::from_ref(&self.positions)
        } else {
            &self.poses
        }
    }

    /// Normals for shading of a triangle's corners in a pose, to the front, local space, unit at the poses; `None` if the
    /// mesh is flat.
    #[must_use]
    pub fn corner_normals(&self, triangle: usize, blend: PoseBlend) -> Option<[Vec3; 3]> {
        let of = |pose: u32| {
            let all = self.normals.get(pose as usize).or(self.normals.first())?;
            Some(all.get(triangle)?.map(PackedNormal::get))
        };
        let from = of(blend.from)?;
        if blend.fraction == 0.0 || blend.from == blend.to {
            return Some(from);
        }
        let to = of(blend.to)?;
        Some([0, 1, 2].map(|i| from[i] + (to[i] - from[i]) * blend.fraction))
    }
}

fn normals(triangles: &[Triangle], poses: &[Vec<Vec3>]) -> Vec<Vec<[PackedNormal; 3]>> {
    let Some(first) = poses.first() else {
        return Vec::new();
    };
    let around = facets_around(triangles, poses);
    let facets =
        |pose: &[Vec3]| -> Vec<Vec3> { triangles.iter().map(|t| facet(pose, t)).collect() };
    let at_first = facets(first);
    // For each corner the facets of one surface around it, with their corners there.
    let mut lists: Vec<(u32, u8)> = Vec::new();
    let mut begins = Vec::with_capacity(3 * triangles.len() + 1);
    let mut is_smooth = false;
    for (number, own) in at_first.iter().enumerate() {
        for corner in 0..3 {
            begins.push(lists.len());
            let all = &around.facets[around.places[3 * number + corner] as usize];
            let before = lists.len();
            if all.len() > MOST_AROUND {
                lists.push((number as u32, corner as u8));
                continue;
            }
            let is_one = |&&(other, _): &&(u32, u8)| {
                other as usize == number || own.dot(at_first[other as usize]) > CREASE_COS
            };
            lists.extend(all.iter().filter(is_one));
            is_smooth |= lists[before..]
                .iter()
                .any(|&(f, _)| at_first[f as usize] != *own);
        }
    }
    begins.push(lists.len());
    if !is_smooth {
        return Vec::new();
    }
    let of_pose = |pose: &Vec<Vec3>| {
        let facets = facets(pose);
        let angles: Vec<[f32; 3]> = triangles.iter().map(|t| angles(pose, t)).collect();
        let mean = |corner: usize, own: Vec3| {
            let list = &lists[begins[corner]..begins[corner + 1]];
            let weighted =
                |&(f, c): &(u32, u8)| facets[f as usize] * angles[f as usize][usize::from(c)];
            let sum: Vec3 = list.iter().map(weighted).sum();
            PackedNormal::new(sum.try_normalize().unwrap_or(own))
        };
        (facets.iter().enumerate())
            .map(|(number, &own)| [0, 1, 2].map(|corner| mean(3 * number + corner, own)))
            .collect()
    };
    poses.iter().map(of_pose).collect()
}

/// Which facets meet where.
struct Around {
    /// By corner of each triangle, its place.
    places: Vec<u32>,
    /// By place, triangles and which of their corners is there.
    facets: Vec<Vec<(u32, u8)>>,
}

/// Vertices that are in one place in all poses looked at are one: seams of the skin part vertices, not surfaces.
fn facets_around(triangles: &[Triangle], poses: &[Vec<Vec3>]) -> Around {
    let step = poses.len().div_ceil(LOOKED_AT).max(1);
    let place = |v: u32| -> Vec<[u32; 3]> {
        let looked_at = poses.iter().step_by(step);
        looked_at
            .map(|pose| pose[v as usize].to_array().map(f32::to_bits))
            .collect()
    };
    let mut numbers: HashMap<Vec<[u32; 3]>, u32> = HashMap::new();
    let mut known: HashMap<u32, u32> = HashMap::new();
    let mut around = Around {
        places: Vec::with_capacity(3 * triangles.len()),
        facets: Vec::new(),
    };
    for (number, triangle) in triangles.iter().enumerate() {
        for (corner, &vertex) in triangle.vertices.iter().enumerate() {
            let place = *known.entry(vertex).or_insert_with(|| {
                let next = numbers.len() as u32;
                *numbers.entry(place(vertex)).or_insert(next)
            });
            around.places.push(place);
            around.facets.resize(numbers.len(), Vec::new());
            around.facets[place as usize].push((number as u32, corner as u8));
        }
    }
    around
}

fn facet(pose: &[Vec3], triangle: &Triangle) -> Vec3 {
    let [a, b, c] = triangle.vertices.map(|v| pose[v as usize].as_dvec3());
    let normal = (b - a).cross(c - a).try_normalize();
    normal.map_or(triangle.normal, |n| n.as_vec3())
}

/// Angles of a triangle at its corners; 0 where it has no area.
fn angles(pose: &[Vec3], triangle: &Triangle) -> [f32; 3] {
    let corners = triangle.vertices.map(|v| pose[v as usize]);
    [0, 1, 2].map(|i| {
        let (a, b) = (
            corners[(i + 1) % 3] - corners[i],
            corners[(i + 2) % 3] - corners[i],
        );
        let angle = a.cross(b).length().atan2(a.dot(b));
        if a.cross(b) == Vec3::ZERO { 0.0 } else { angle }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MaterialId;

    #[test]
    fn packed_normals_are_near() {
        let mut worst = 0.0_f32;
        for i in 0..4000 {
            let (z, turn) = (1.0 - (i as f32 + 0.5) / 2000.0, i as f32 * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            let n = Vec3::new(r * turn.cos(), r * turn.sin(), z);
            let packed = PackedNormal::new(n * 3.0).get();
            assert!((packed.length() - 1.0).abs() < 1e-6);
            worst = worst.max((packed - n).length());
        }
        // Steps of 1/32767, of which the nearest is taken, and the octahedron's stretch.
        assert!(worst < 1e-4, "{worst}");
        for axis in [
            Vec3::X,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
        ] {
            assert!(
                (PackedNormal::new(axis).get() - axis).length() < 1e-6,
                "{axis}"
            );
        }
        assert_eq!(PackedNormal::new(Vec3::ZERO).get(), Vec3::Z);
        assert_eq!(PackedNormal::new(Vec3::NAN).get(), Vec3::Z);
    }

    /// A prism of `sides` sides around z whose seams have vertices of their own; with its lids.
    fn prism(sides: u32, poses: &[f32]) -> Mesh {
        let ring = |radius: f32, z: f32| {
            (0..sides * 2).map(move |i| {
                let turn = (i % sides) as f32 / sides as f32 * std::f32::consts::TAU;
                Vec3::new(radius * turn.cos(), radius * turn.sin(), z)
            })
        };
        let pose =
            |radius: &f32| -> Vec<Vec3> { ring(*radius, 0.0).chain(ring(*radius, 1.0)).collect() };
        let triangle = |vertices: [u32; 3]| Triangle {
            vertices,
            uv: [[0.0; 2]; 3],
            normal: Vec3::Z,
            material: MaterialId(0),
            face: 0,
        };
        let n = 2 * sides;
        let mut triangles = Vec::new();
        for i in 0..sides {
            // Every side ends on the second set of the ring's vertices.
            let (a, b) = (i, sides + (i + 1) % sides);
            triangles.extend([triangle([a, b, n + b]), triangle([a, n + b, n + a])]);
            if i > 0 && i + 1 < sides {
                triangles.push(triangle([n, n + i, n + i + 1]));
            }
        }
        let poses: Vec<Vec<Vec3>> = poses.iter().map(pose).collect();
        Mesh {
            positions: poses[0].clone(),
            first_see_through: triangles.len(),
            triangles,
            poses: if poses.len() > 1 { poses } else { Vec::new() },
            ..Mesh::default()
        }
    }

    #[test]
    fn round_things_are_round_and_edges_stay() {
        let mut round = prism(12, &[1.0, 2.0]);
        round.make_smooth();
        assert_eq!(round.normals.len(), 2);
        for blend in [(0, 0, 0.0), (0, 1, 0.25), (1, 1, 0.0)] {
            let blend = PoseBlend {
                from: blend.0,
                to: blend.1,
                fraction: blend.2,
            };
            for (i, t) in round.triangles.iter().enumerate() {
                let normals = round.corner_normals(i, blend).unwrap();
                let positions = round.posed(blend);
                let is_lid = t.vertices.iter().all(|&v| v >= 24);
                for (n, v) in normals.iter().zip(t.vertices) {
                    let p = positions[v as usize];
                    let right = if is_lid {
                        Vec3::Z
                    } else {
                        Vec3::new(p.x, p.y, 0.0).normalize()
                    };
                    assert!((*n - right).length() < 1e-3, "{n} {right}");
                }
            }
        }
        let mut square = prism(4, &[1.0]);
        square.make_smooth();
        assert!(
            square.normals.is_empty() && square.corner_normals(0, PoseBlend::default()).is_none()
        );
    }
}
