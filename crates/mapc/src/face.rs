//! Faces from portals, merged where they were cut in vain, split where classic engines need it,
//! and closed: vertices welded, T-junctions filled in.

use std::collections::{BTreeMap, HashMap};

use crate::math::{Bounds, Plane, PlaneSet, Vec3, cross, dot, length, normalize, scale, sub};
use crate::portal::{OUTSIDE, Portal};
use crate::texture::Contents;
use crate::tree::{CompiledBrush, Tree};
use crate::winding::Winding;

/// Points closer than this, in Quake units, are one vertex; and a vertex this close to an edge
/// lies on it.
const WELD: f64 = 0.02;

/// A face being made.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) node: usize,
    /// Plane index; odd: the face looks to the back of its node's plane.
    pub(crate) plane: usize,
    pub(crate) texinfo: usize,
    pub(crate) winding: Winding,
    /// Contents of the leafs it is seen from.
    viewer: Contents,
    /// The leafs it is seen from, with the part of the face that touches each.
    pub(crate) leafs: Vec<(usize, Bounds)>,
    /// Filled in by [`close`].
    pub(crate) vertices: Vec<u32>,
}

/// Where a portal's surface takes its texture: the last brush of the stronger leaf with a side
/// there. Returns brush and side.
fn surface_of(
    tree: &Tree,
    planes: &PlaneSet,
    brushes: &[CompiledBrush],
    leaf: usize,
    facing: usize,
) -> Option<(usize, usize)> {
    let node = &tree.nodes[leaf];
    let own = node
        .brushes
        .iter()
        .copied()
        .filter(|&b| brushes[b].contents == node.contents);
    let exact = own
        .clone()
        .filter_map(|b| Some((b, brushes[b].sides.iter().position(|s| s.plane == facing)?)))
        .max();
    if exact.is_some() {
        return exact;
    }
    // A sliver thinner than the tolerance: the side that faces most alike.
    let n = planes.get(facing).normal;
    let alike = |b: usize, s: usize| dot(planes.get(brushes[b].sides[s].plane).normal, n);
    own.flat_map(|b| (0..brushes[b].sides.len()).map(move |s| (b, s)))
        .max_by(|x, y| alike(x.0, x.1).total_cmp(&alike(y.0, y.1)))
}

/// The faces of a tree: every portal between leafs of different contents, seen from the open
/// side; liquids are seen from both. Calls `seen` with the brush and side of each.
pub(crate) fn from_portals(
    tree: &Tree,
    planes: &PlaneSet,
    brushes: &[CompiledBrush],
    portals: &[Portal],
    mut seen: impl FnMut(usize, usize),
) -> Vec<Face> {
    let mut faces = Vec::new();
    for portal in portals {
        let Some((node, split)) = portal
            .on_node
            .and_then(|n| tree.nodes[n].split.map(|s| (n, s)))
        else {
            continue;
        };
        if portal.leafs.contains(&OUTSIDE) {
            continue;
        }
        let contents = portal.leafs.map(|l| tree.nodes[l].contents);
        if contents[0] == contents[1] {
            continue;
        }
        let stronger = usize::from(contents[1] > contents[0]);
        // The surface belongs to the stronger leaf and faces the other one.
        let facing = split.plane + 1 - stronger;
        let Some((brush, side)) = surface_of(tree, planes, brushes, portal.leafs[stronger], facing)
        else {
            continue;
        };
        seen(brush, side);
        let side = &brushes[brush].sides[side];
        if side.nodraw {
            continue;
        }
        for viewer in [0, 1] {
            if contents[viewer].is_opaque() {
                continue;
            }
            let winding = if viewer == 0 {
                portal.winding.clone()
            } else {
                portal.winding.reversed()
            };
            faces.push(Face {
                node,
                plane: split.plane + viewer,
                texinfo: side.texinfo,
                viewer: contents[viewer],
                leafs: vec![(portal.leafs[viewer], Bounds::of(&winding.0))],
                winding,
                vertices: Vec::new(),
            });
        }
    }
    faces
}

/// Joins faces on the same node that differ in nothing and form a convex polygon.
pub(crate) fn merge(faces: Vec<Face>, planes: &PlaneSet) -> Vec<Face> {
    let mut groups: BTreeMap<(usize, usize, usize, Contents), Vec<Face>> = BTreeMap::new();
    for f in faces {
        groups
            .entry((f.node, f.plane, f.texinfo, f.viewer))
            .or_default()
            .push(f);
    }
    let mut out = Vec::new();
    for ((_, plane, _, _), group) in groups {
        let normal = planes.get(plane).normal;
        let mut done: Vec<Face> = Vec::new();
        for mut face in group {
            while let Some((i, winding)) = done
                .iter()
                .enumerate()
                .find_map(|(i, d)| Some((i, join(&d.winding, &face.winding, normal)?)))
            {
                let other = done.remove(i);
                face.winding = winding;
                face.leafs.extend(other.leafs);
            }
            done.push(face);
        }
        out.extend(done);
    }
    out
}

fn same(a: Vec3, b: Vec3) -> bool {
    (0..3).all(|i| (a[i] - b[i]).abs() < WELD)
}

/// Joins two convex polygons of one plane along a common edge if the result is convex.
fn join(a: &Winding, b: &Winding, normal: Vec3) -> Option<Winding> {
    let (n, m) = (a.0.len(), b.0.len());
    for i in 0..n {
        let (p, q) = (a.0[i], a.0[(i + 1) % n]);
        let Some(j) = (0..m).find(|&j| same(b.0[j], q) && same(b.0[(j + 1) % m], p)) else {
            continue;
        };
        // Around a from after the edge to before it, then around b likewise.
        let mut points = Vec::with_capacity(n + m - 2);
        points.extend((0..n).map(|k| a.0[(i + 1 + k) % n]));
        points.extend((2..m).map(|k| b.0[(j + k) % m]));
        let len = points.len();
        // Only the ends of the common edge can break convexity; they are at 0 and n - 1.
        let turn = |k: usize| {
            let (x, y, z) = (
                points[(k + len - 1) % len],
                points[k],
                points[(k + 1) % len],
            );
            let (Some(u), Some(v)) = (normalize(sub(y, x)), normalize(sub(z, y))) else {
                return 0.0;
            };
            // Clockwise seen from the front: right turns have a negative sine.
            -dot(cross(u, v), normal)
        };
        let (first, last) = (turn(0), turn(n - 1));
        if first < -1e-6 || last < -1e-6 {
            return None;
        }
        // A corner that became straight is no corner; neighbours put it back if they need it.
        for (k, t) in [(n - 1, last), (0, first)] {
            if t < 1e-6 {
                points.remove(k);
            }
        }
        return (points.len() >= 3).then_some(Winding(points));
    }
    None
}

/// Splits faces whose texture extent is above `size` texels in either axis.
pub(crate) fn subdivide(
    faces: Vec<Face>,
    size: f64,
    rows_of: impl Fn(usize) -> Option<[[f64; 4]; 2]>,
) -> Vec<Face> {
    let mut out = Vec::new();
    let mut todo: Vec<Face> = faces.into_iter().rev().collect();
    while let Some(face) = todo.pop() {
        let cut = rows_of(face.texinfo).and_then(|rows| {
            rows.iter().find_map(|r| {
                let dir = [r[0], r[1], r[2]];
                let l = length(dir);
                let values = face.winding.0.iter().map(|p| dot(*p, dir));
                let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(v), b.max(v))
                });
                if hi - lo <= size + 1e-6 {
                    return None;
                }
                // At a lightmap step, as far out as allowed.
                let at = ((lo + r[3] + size) / 16.0).floor() * 16.0 - r[3];
                let at = if at > lo + 8.0 && at < hi - 1e-3 {
                    at
                } else {
                    0.5 * (lo + hi)
                };
                let plane = Plane {
                    normal: scale(dir, 1.0 / l),
                    dist: at / l,
                };
                match face.winding.split(&plane, 1e-6) {
                    (Some(f), Some(b)) => Some((f, b)),
                    _ => None,
                }
            })
        });
        match cut {
            None => out.push(face),
            Some((f, b)) => {
                for winding in [f, b] {
                    let bounds = Bounds::of(&winding.0);
                    let mut part = Face {
                        winding,
                        ..face.clone()
                    };
                    part.leafs.retain(|(_, piece)| piece.touches(&bounds, 0.0));
                    todo.push(part);
                }
            }
        }
    }
    out
}

/// All vertices of a file, welded.
#[derive(Debug, Default)]
pub(crate) struct Vertices {
    pub(crate) points: Vec<Vec3>,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Vertices {
    fn find_or_add(&mut self, p: Vec3) -> u32 {
        let snap = |v: f64| {
            if (v - v.round()).abs() < 1e-3 {
                v.round() + 0.0
            } else {
                v
            }
        };
        let p = p.map(snap);
        let cell = |d: [f64; 3]| {
            let q: [i64; 3] = std::array::from_fn(|i| (p[i] + d[i]).floor() as i64);
            q
        };
        for corner in 0..8u8 {
            let d = std::array::from_fn(|i| if corner >> i & 1 == 0 { -WELD } else { WELD });
            let near = self.cells.get(&cell(d)).into_iter().flatten();
            if let Some(v) = near.copied().find(|&v| same(self.points[v as usize], p)) {
                return v;
            }
        }
        let index = self.points.len() as u32;
        self.points.push(p);
        self.cells.entry(cell([0.0; 3])).or_default().push(index);
        index
    }
}

/// Gives the faces of one model their vertices: welded, and with every vertex of the model that
/// lies on an edge made part of it, so that no T-junction is left. Faces that weld away vanish.
pub(crate) fn close(faces: &mut Vec<Face>, vertices: &mut Vertices) {
    for f in faces.iter_mut() {
        f.vertices = f
            .winding
            .0
            .iter()
            .map(|p| vertices.find_or_add(*p))
            .collect();
        f.vertices.dedup();
        while f.vertices.len() > 1 && f.vertices.first() == f.vertices.last() {
            f.vertices.pop();
        }
    }
    faces.retain(|f| f.vertices.len() >= 3);
    let mut sorted: Vec<u32> = faces
        .iter()
        .flat_map(|f| f.vertices.iter().copied())
        .collect();
    sorted.sort_unstable();
    sorted.dedup();
    let points = &vertices.points;
    sorted.sort_by(|a, b| points[*a as usize][0].total_cmp(&points[*b as usize][0]));
    let mut known: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for f in faces.iter_mut() {
        let n = f.vertices.len();
        let mut full = Vec::with_capacity(n + 4);
        for i in 0..n {
            let (a, b) = (f.vertices[i], f.vertices[(i + 1) % n]);
            full.push(a);
            let (lo, hi) = (a.min(b), a.max(b));
            let between = known
                .entry((lo, hi))
                .or_insert_with(|| on_edge(lo, hi, &sorted, points));
            if a == lo {
                full.extend(between.iter());
            } else {
                full.extend(between.iter().rev());
            }
        }
        f.vertices = full;
    }
}

/// The vertices strictly between two others, in order. `sorted` is by X.
fn on_edge(a: u32, b: u32, sorted: &[u32], points: &[Vec3]) -> Vec<u32> {
    let at = |v: u32| points[v as usize];
    let (p, q) = (at(a), at(b));
    let d = sub(q, p);
    let len = length(d);
    let dir = scale(d, 1.0 / len.max(1e-9));
    let (x0, x1) = (p[0].min(q[0]) - WELD, p[0].max(q[0]) + WELD);
    let first = sorted.partition_point(|v| at(*v)[0] < x0);
    let mut found: Vec<(f64, u32)> = Vec::new();
    for &v in sorted[first..].iter().take_while(|v| at(**v)[0] <= x1) {
        let r = sub(at(v), p);
        let t = dot(r, dir);
        if v == a || v == b || t < WELD || t > len - WELD {
            continue;
        }
        let off = sub(r, scale(dir, t));
        if length(off) < WELD {
            found.push((t, v));
        }
    }
    found.sort_by(|x, y| x.0.total_cmp(&y.0));
    found.into_iter().map(|(_, v)| v).collect()
}
