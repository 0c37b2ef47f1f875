//! T-junctions: a vertex of one face in the middle of another face's edge. Rounded to floats the
//! three edges do not quite meet, and rays slip through. Here each edge takes in the vertices that
//! lie on it, so that adjacent faces share exactly the same vertices and edges.

use super::weld::{Cell, CellMap};
use glam::{DVec3, Vec3};

/// A vertex this close to an edge (world units) lies on it. Compilers look for their own
/// T-junctions within about as much.
pub const ON_EDGE_DISTANCE: f64 = 0.05;

/// Side of a grid cell in world units: a typical edge touches few cells, a cell holds few vertices.
const CELL: f64 = 32.0;

/// Most distance tests and insertions per corner that was there before. Levels need a few dozen; a
/// file made to exhaust time or memory is left unsplit from there on.
const TESTS_PER_CORNER: usize = 4096;
const INSERTIONS_PER_CORNER: usize = 16;

/// Splits edges at the vertices of a mesh.
///
/// An edge splits at the vertex nearest to it and its two halves split on in the same way. What an
/// edge becomes depends on its two ends alone, not on the face it is asked for, so the two faces
/// beside it always agree, and so do faces that own only a part of it.
pub struct EdgeSplitter<'a> {
    positions: &'a [Vec3],
    grid: CellMap<Cell, Vec<u32>>,
    /// The vertex an edge (smaller index first) splits at.
    splits: CellMap<(u32, u32), Option<u32>>,
    inserted: usize,
    tests_left: usize,
    insertions_left: usize,
}

fn cell_of(p: DVec3) -> Cell {
    let c = (p / CELL).floor().as_ivec3();
    (c.x, c.y, c.z)
}

impl<'a> EdgeSplitter<'a> {
    /// A splitter at all of `positions`, which are distinct and finite, for polygons that have
    /// `corners` corners together.
    pub fn new(positions: &'a [Vec3], corners: usize) -> Self {
        let mut grid: CellMap<Cell, Vec<u32>> = CellMap::default();
        for (i, p) in positions.iter().enumerate() {
            grid.entry(cell_of(p.as_dvec3()))
                .or_default()
                .push(i as u32);
        }
        Self {
            positions,
            grid,
            splits: CellMap::default(),
            inserted: 0,
            tests_left: TESTS_PER_CORNER * (corners + 1024),
            insertions_left: INSERTIONS_PER_CORNER * (corners + 1024),
        }
    }

    /// The polygon with its edges split. Vertices can come twice afterwards, where a polygon is
    /// thinner than [`ON_EDGE_DISTANCE`]; see [`simple_loops`].
    pub fn split_polygon(&mut self, polygon: &[u32]) -> Vec<u32> {
        let mut out = Vec::with_capacity(polygon.len() + 4);
        let mut stack = Vec::new();
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            stack.push((a, b));
            while let Some((a, b)) = stack.pop() {
                match self.split(a, b) {
                    Some(v) if self.insertions_left > 0 => {
                        self.insertions_left -= 1;
                        stack.extend([(v, b), (a, v)]);
                    }
                    _ => out.push(a),
                }
            }
        }
        self.inserted += out.len() - polygon.len();
        out
    }

    /// Whether the splitter gave up because the file asks for too much.
    pub fn exhausted(&self) -> bool {
        self.tests_left == 0 || self.insertions_left == 0
    }

    /// Vertices inserted so far, over all polygons.
    pub fn inserted(&self) -> usize {
        self.inserted
    }

    fn split(&mut self, a: u32, b: u32) -> Option<u32> {
        let key = (a.min(b), a.max(b));
        if let Some(&known) = self.splits.get(&key) {
            return known;
        }
        let found = self.nearest_on_edge(key.0, key.1);
        self.splits.insert(key, found);
        found
    }

    /// The vertex nearest to the inside of the edge from `a` to `b`, if one is near enough. It is
    /// closer to both ends than they are to each other, so splitting ends.
    fn nearest_on_edge(&mut self, a: u32, b: u32) -> Option<u32> {
        let [pa, pb] = [a, b].map(|i| self.positions[i as usize].as_dvec3());
        let edge = pb - pa;
        let length2 = edge.length_squared();
        if a == b || length2 == 0.0 || self.tests_left == 0 {
            return None;
        }
        let mut tests = 0;
        let mut best: Option<(f64, u32)> = None;
        let mut consider = |v: u32| {
            if v == a || v == b {
                return;
            }
            let from_a = self.positions[v as usize].as_dvec3() - pa;
            let along = from_a.dot(edge);
            if along <= 0.0 || along >= length2 {
                return;
            }
            let off = from_a - edge * (along / length2);
            let distance2 = off.length_squared();
            if distance2 > ON_EDGE_DISTANCE * ON_EDGE_DISTANCE
                || from_a.length_squared() >= length2
                || (from_a - edge).length_squared() >= length2
            {
                return;
            }
            if best.is_none_or(|x| (distance2, v) < x) {
                best = Some((distance2, v));
            }
        };
        // Piece by piece, so that a long diagonal edge does not visit its whole bounding box.
        let pieces = (edge.abs().max_element() / CELL).ceil().max(1.0);
        for i in 0..pieces as u32 {
            let p = pa + edge * (f64::from(i) / pieces);
            let q = pa + edge * (f64::from(i + 1) / pieces);
            let lo = cell_of(p.min(q) - ON_EDGE_DISTANCE);
            let hi = cell_of(p.max(q) + ON_EDGE_DISTANCE);
            for x in lo.0..=hi.0 {
                for y in lo.1..=hi.1 {
                    for z in lo.2..=hi.2 {
                        if let Some(cell) = self.grid.get(&(x, y, z)) {
                            tests += cell.len();
                            cell.iter().copied().for_each(&mut consider);
                        }
                    }
                }
            }
        }
        self.tests_left = self.tests_left.saturating_sub(tests);
        best.map(|(_, v)| v)
    }
}

/// Takes a closed polygon apart into polygons that visit each vertex once. Edges walked in both
/// directions cancel; every other directed edge is kept, so whatever closed a mesh still does.
pub fn simple_loops(polygon: &[u32]) -> Vec<Vec<u32>> {
    let mut sorted = polygon.to_vec();
    sorted.sort_unstable();
    if polygon.len() >= 3 && sorted.windows(2).all(|w| w[0] != w[1]) {
        return vec![polygon.to_vec()];
    }
    let mut loops = Vec::new();
    let mut path: Vec<u32> = Vec::with_capacity(polygon.len());
    let mut place: CellMap<u32, usize> = CellMap::default();
    for &v in polygon {
        if let Some(&at) = place.get(&v) {
            if path.len() - at >= 3 {
                loops.push(path[at..].to_vec());
            }
            for gone in path.drain(at..) {
                place.remove(&gone);
            }
        }
        place.insert(v, path.len());
        path.push(v);
    }
    if path.len() >= 3 {
        loops.push(path);
    }
    loops
}

/// Edges that no opposite edge matches, over closed polygons or triangles, each as often as it
/// lacks a match, sorted. None means that the mesh has no border: a ray can't leave it without
/// crossing a face.
pub fn open_edges<'a>(polygons: impl IntoIterator<Item = &'a [u32]>) -> Vec<(u32, u32)> {
    let mut balance: CellMap<(u32, u32), i32> = CellMap::default();
    for polygon in polygons {
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let mut open: Vec<(u32, u32)> = balance
        .into_iter()
        .flat_map(|(edge, b)| std::iter::repeat_n(edge, b.unsigned_abs() as usize))
        .collect();
    open.sort_unstable();
    open
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sliver_thinner_than_the_tolerance_cancels_out() {
        // Vertex 2 lies almost on the edge 0-1: the triangle has no inside left, and its two
        // neighbours now meet.
        let positions = [
            Vec3::ZERO,
            Vec3::new(10.0, 0.0, 0.0),
            Vec3::new(5.0, 0.02, 0.0),
        ];
        let mut splitter = EdgeSplitter::new(&positions, 3);
        let split = splitter.split_polygon(&[0, 1, 2]);
        assert_eq!(split, [0, 2, 1, 2]);
        assert!(simple_loops(&split).is_empty());
    }

    #[test]
    fn loops_keep_every_directed_edge_that_does_not_cancel() {
        let eight = [0, 1, 2, 0, 3, 4];
        let mut loops = simple_loops(&eight);
        loops.sort();
        assert_eq!(loops, [vec![0, 1, 2], vec![0, 3, 4]]);
        let borders = |l: &[Vec<u32>]| open_edges(l.iter().map(Vec::as_slice));
        assert_eq!(borders(&loops), borders(&[eight.to_vec()]));
    }
}
