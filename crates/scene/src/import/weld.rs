//! Vertices that mean the same point become one vertex.

use glam::Vec3;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Positions this close (in world units) are one vertex. Compilers write the corners of adjacent
/// faces as separate floats that differ in the last bits, and id's first compiler by a few
/// thousandths.
pub const WELD_DISTANCE: f32 = 0.01;

/// Side of a grid cell. Vertices are at least [`WELD_DISTANCE`] apart, so a cell can't hold many.
const CELL: f32 = 0.0625;

/// A multiplicative hash for small integer keys: their distribution is no attack surface here, as
/// the worst a hostile file gains is the time its own size allows.
#[derive(Default)]
pub struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }
    fn write(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.write_u32(u32::from(b));
        }
    }
    fn write_u32(&mut self, v: u32) {
        self.0 = (self.0.rotate_left(23) ^ u64::from(v)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    fn write_i32(&mut self, v: i32) {
        self.write_u32(v as u32);
    }
}

/// A map keyed by grid cells or vertex indices.
pub type CellMap<K, V> = HashMap<K, V, BuildHasherDefault<CellHasher>>;

/// A cell of a grid in space.
pub type Cell = (i32, i32, i32);

/// Welds positions in the order they come: the first of a cluster gives the position. The result
/// depends on nothing but the sequence of positions.
#[derive(Default)]
pub struct Welder {
    positions: Vec<Vec3>,
    /// First vertex of each cell's list.
    heads: CellMap<Cell, u32>,
    /// Next vertex of the same cell, or `NONE`.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

fn cell_of(p: Vec3) -> Cell {
    // Level designers work on whole units: half a cell off, those look into one cell, not eight.
    let c = (p / CELL + 0.5).floor().as_ivec3();
    (c.x, c.y, c.z)
}

impl Welder {
    /// The index of the vertex at `p`: that of the nearest one within [`WELD_DISTANCE`], or a new
    /// one. `p` must be finite.
    pub fn weld(&mut self, p: Vec3) -> u32 {
        if let Some(found) = self.find(p) {
            return found;
        }
        let index = self.positions.len() as u32;
        self.positions.push(p);
        let head = self.heads.entry(cell_of(p)).or_insert(NONE);
        self.next.push(*head);
        *head = index;
        index
    }

    fn find(&self, p: Vec3) -> Option<u32> {
        let mut best: Option<(f32, u32)> = None;
        let (lo, hi) = (cell_of(p - WELD_DISTANCE), cell_of(p + WELD_DISTANCE));
        for x in lo.0..=hi.0 {
            for y in lo.1..=hi.1 {
                for z in lo.2..=hi.2 {
                    let mut at = self.heads.get(&(x, y, z)).copied().unwrap_or(NONE);
                    while at != NONE {
                        let d = self.positions[at as usize].distance_squared(p);
                        let candidate = (d, at);
                        if d <= WELD_DISTANCE * WELD_DISTANCE && best.is_none_or(|b| candidate < b)
                        {
                            best = Some(candidate);
                        }
                        at = self.next[at as usize];
                    }
                }
            }
        }
        best.map(|(_, index)| index)
    }

    /// All vertices, by index.
    pub fn into_positions(self) -> Vec<Vec3> {
        self.positions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_points_weld_across_cell_borders_and_far_ones_do_not() {
        let mut w = Welder::default();
        let a = w.weld(Vec3::new(4.03125, -8.0, 0.0));
        assert_eq!(w.weld(Vec3::new(4.02725, -8.004, -0.004)), a);
        assert_eq!(w.weld(Vec3::new(4.03625, -7.996, 0.004)), a);
        let b = w.weld(Vec3::new(4.01625, -8.0, 0.0));
        assert_ne!(a, b);
        // Between two vertices the nearer one wins.
        assert_eq!(w.weld(Vec3::new(4.02325, -8.0, 0.0)), b);
        assert_eq!(w.weld(Vec3::new(4.02425, -8.0, 0.0)), a);
        assert_eq!(w.into_positions().len(), 2);
    }
}
