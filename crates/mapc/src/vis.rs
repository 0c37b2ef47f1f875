//! The potentially visible set, by the portal flow of id's `vis`: what is seen from a leaf is
//! what can be reached through a chain of portals, each clipped by the planes that separate the
//! two before it. Never says that something is hidden which can be seen (up to `EPS`); where
//! the flow would take too long it falls back to a coarser set, never to a smaller one.

use crate::math::{Plane, Vec3, cross, dot, length, scale, sub};
use crate::winding::Winding;

const EPS: f64 = 0.01;

/// Steps of the flow for one portal before the coarse set is taken instead.
const MAX_STEPS: usize = 4_000;

/// Longest chain of portals followed: beyond it the coarse set is taken.
const MAX_DEPTH: usize = 256;

/// A set of small numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BitSet(Vec<u64>);

impl BitSet {
    pub(crate) fn new(len: usize) -> Self {
        Self(vec![0; len.div_ceil(64)])
    }

    pub(crate) fn set(&mut self, i: usize) {
        self.0[i / 64] |= 1 << (i % 64);
    }

    pub(crate) fn get(&self, i: usize) -> bool {
        self.0[i / 64] >> (i % 64) & 1 != 0
    }

    fn or(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a |= b;
        }
    }

    fn and(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a & b).collect())
    }

    fn is_within(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(a, b)| a & !b == 0)
    }

    fn count(&self) -> u32 {
        self.0.iter().map(|w| w.count_ones()).sum()
    }
}

/// A portal looked at from one side.
struct Door {
    /// Faces into `to`.
    plane: Plane,
    winding: Winding,
    /// The leaf it leads to.
    to: usize,
    /// Coarse set of doors that might be seen through this one.
    might: BitSet,
    /// Final set, once `done`.
    sees: BitSet,
    done: bool,
}

/// The rows of the PVS. `portals` are polygons (clockwise seen from the first leaf) between
/// leafs numbered from 0. Row `i` has bit `j` when leaf `j` may be seen from leaf `i`; it is
/// symmetric and each leaf sees itself.
pub(crate) fn leaf_rows(leafs: usize, portals: &[(Winding, Plane, [usize; 2])]) -> Vec<BitSet> {
    let mut doors = Vec::with_capacity(2 * portals.len());
    let mut doors_of = vec![Vec::new(); leafs];
    for (winding, plane, [front, back]) in portals {
        // The plane faces the first leaf.
        for (from, to, plane) in [(*back, *front, *plane), (*front, *back, plane.flipped())] {
            doors_of[from].push(doors.len());
            doors.push(Door {
                plane,
                winding: winding.clone(),
                to,
                might: BitSet::new(2 * portals.len()),
                sees: BitSet::new(2 * portals.len()),
                done: false,
            });
        }
    }
    coarse(&mut doors, &doors_of);
    let mut order: Vec<usize> = (0..doors.len()).collect();
    order.sort_by_key(|&d| (doors[d].might.count(), d));
    for base in order {
        let mut flow = Flow {
            doors: &doors,
            doors_of: &doors_of,
            base,
            sees: BitSet::new(doors.len()),
            steps: 0,
        };
        let start = Frame {
            source: doors[base].winding.clone(),
            pass: None,
            plane: doors[base].plane,
            might: doors[base].might.clone(),
        };
        let complete = flow.through(doors[base].to, &start, 0);
        let sees = if complete {
            flow.sees
        } else {
            doors[base].might.clone()
        };
        doors[base].sees = sees;
        doors[base].done = true;
    }
    let mut rows = vec![BitSet::new(leafs); leafs];
    for (leaf, own) in doors_of.iter().enumerate() {
        let mut row = BitSet::new(leafs);
        row.set(leaf);
        for &d in own {
            row.set(doors[d].to);
            for (other, door) in doors.iter().enumerate() {
                if doors[d].sees.get(other) {
                    row.set(door.to);
                }
            }
        }
        // Light goes both ways: what either side sees, both see.
        for (other, theirs) in rows.iter_mut().enumerate() {
            if row.get(other) {
                theirs.set(leaf);
            }
        }
        rows[leaf].or(&row);
    }
    rows
}

/// Doors that lie in front of a door and face away from it, as far as they can be reached
/// through such doors.
fn coarse(doors: &mut [Door], doors_of: &[Vec<usize>]) {
    let n = doors.len();
    let mut sets = Vec::with_capacity(n);
    for (i, p) in doors.iter().enumerate() {
        let mut front = BitSet::new(n);
        for (j, q) in doors.iter().enumerate() {
            let ahead = q.winding.0.iter().any(|v| p.plane.distance(*v) > EPS);
            let away = p.winding.0.iter().any(|v| q.plane.distance(*v) < -EPS);
            if i != j && ahead && away {
                front.set(j);
            }
        }
        let mut might = BitSet::new(n);
        let mut entered = BitSet::new(doors_of.len());
        entered.set(p.to);
        let mut todo = vec![p.to];
        while let Some(leaf) = todo.pop() {
            for &d in &doors_of[leaf] {
                if front.get(d) && !might.get(d) {
                    might.set(d);
                    if !entered.get(doors[d].to) {
                        entered.set(doors[d].to);
                        todo.push(doors[d].to);
                    }
                }
            }
        }
        sets.push(might);
    }
    for (door, might) in doors.iter_mut().zip(sets) {
        door.might = might;
    }
}

struct Frame {
    /// What of the first door can still see through.
    source: Winding,
    /// The last door passed, clipped; `None` right behind the first.
    pass: Option<Winding>,
    plane: Plane,
    might: BitSet,
}

struct Flow<'a> {
    doors: &'a [Door],
    doors_of: &'a [Vec<usize>],
    base: usize,
    sees: BitSet,
    steps: usize,
}

impl Flow<'_> {
    /// Follows all doors out of a leaf; false when a limit was met.
    fn through(&mut self, leaf: usize, prev: &Frame, depth: usize) -> bool {
        if depth > MAX_DEPTH {
            return false;
        }
        for &d in &self.doors_of[leaf] {
            let door = &self.doors[d];
            if !prev.might.get(d) {
                continue;
            }
            let might = prev
                .might
                .and(if door.done { &door.sees } else { &door.might });
            if self.sees.get(d) && might.is_within(&self.sees) {
                continue;
            }
            self.steps += 1;
            if self.steps > MAX_STEPS {
                return false;
            }
            let Some(frame) = self.pass(prev, door, might) else {
                continue;
            };
            self.sees.set(d);
            if !self.through(door.to, &frame, depth + 1) {
                return false;
            }
        }
        true
    }

    /// Looks through one more door, or `None` when nothing of it can be seen.
    fn pass(&self, prev: &Frame, door: &Door, might: BitSet) -> Option<Frame> {
        let target = front(&door.winding, &prev.plane)?;
        let Some(pass) = &prev.pass else {
            let source = prev.source.clone();
            return Some(Frame {
                source,
                pass: Some(target),
                plane: door.plane,
                might,
            });
        };
        let target = front(&target, &self.doors[self.base].plane)?;
        let source = front(&prev.source, &door.plane.flipped())?;
        let target = separate(&source, pass, target, false)?;
        let target = separate(pass, &source, target, true)?;
        let source = separate(&target, pass, source, false)?;
        let source = separate(pass, &target, source, true)?;
        Some(Frame {
            source,
            pass: Some(target),
            plane: door.plane,
            might,
        })
    }
}

/// The part of a polygon in front of a plane; one on the plane is kept whole.
fn front(w: &Winding, plane: &Plane) -> Option<Winding> {
    match w.split(plane, EPS) {
        (None, None) => Some(w.clone()),
        (front, _) => front,
    }
}

/// Clips `target` by every plane through an edge of `source` and a corner of `pass` that has the
/// one behind it and the other in front: beyond lies what `source` can see through `pass`.
/// `flip` keeps the side of `source`'s back instead, for the roles exchanged.
fn separate(source: &Winding, pass: &Winding, target: Winding, flip: bool) -> Option<Winding> {
    let mut target = target;
    let n = source.0.len();
    for i in 0..n {
        let (a, b) = (source.0[i], source.0[(i + 1) % n]);
        for &c in &pass.0 {
            let Some(plane) = separating_plane(source, pass, [a, b, c]) else {
                continue;
            };
            target = front(&target, &if flip { plane.flipped() } else { plane })?;
        }
    }
    Some(target)
}

/// The plane through an edge of `source` and a corner of `pass`, if `source` is behind it and
/// `pass` in front.
fn separating_plane(source: &Winding, pass: &Winding, [a, b, c]: [Vec3; 3]) -> Option<Plane> {
    let normal = cross(sub(b, a), sub(c, a));
    let l = length(normal);
    if l < 1e-3 {
        return None;
    }
    let normal = scale(normal, 1.0 / l);
    let mut plane = Plane {
        normal,
        dist: dot(normal, c),
    };
    let far = source
        .0
        .iter()
        .map(|p| plane.distance(*p))
        .find(|d| d.abs() > EPS)?;
    if far > 0.0 {
        plane = plane.flipped();
    }
    if source.0.iter().any(|p| plane.distance(*p) > EPS) {
        return None;
    }
    let (hi, lo) = pass.extent(&plane);
    (lo >= -EPS && hi > EPS).then_some(plane)
}

/// Packs a row as Quake does: bytes other than zero as they are, runs of zeros as 0 and a count.
pub(crate) fn compress(row: &BitSet, leafs: usize) -> Vec<u8> {
    let byte = |i: usize| (row.0[i / 8] >> (8 * (i % 8))) as u8;
    let len = leafs.div_ceil(8);
    let mut out = Vec::new();
    let mut i = 0;
    while i < len {
        let b = byte(i);
        out.push(b);
        i += 1;
        if b == 0 {
            let mut run = 1u8;
            while i < len && run < 255 && byte(i) == 0 {
                run += 1;
                i += 1;
            }
            out.push(run);
        }
    }
    out
}
