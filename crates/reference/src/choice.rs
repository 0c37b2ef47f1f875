//! The choice of one light among all.

use crate::rng::Rng;
use glam::DVec3;
use scene::Scene;
use scene::cells::{CELL, Cell, CellEntry, FALLBACK};
use scene::render::Selection;

/// How lights are chosen at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Choice<'a> {
    /// By the alias table over all emitters.
    Power(&'a [(f32, u32)]),
    /// Among so many alike.
    Uniform(usize),
    /// By a list, or the table over all if chance says so.
    List {
        list: &'a [CellEntry],
        all: &'a [(f32, u32)],
    },
}

impl<'a> Choice<'a> {
    /// The choice at `point`.
    pub fn at(scene: &'a Scene, selection: Selection, point: DVec3) -> Self {
        let all = scene.emitters.alias.as_slice();
        match selection {
            Selection::Uniform => Self::Uniform(all.len()),
            Selection::Power => Self::Power(all),
            Selection::Leaf => match list_at(scene, point) {
                [] => Self::Power(all),
                list => Self::List { list, all },
            },
        }
    }

    /// Chooses an emitter by its number.
    pub fn sample(&self, rng: &mut Rng) -> usize {
        match *self {
            Self::Power(all) => sample_alias(all, rng.next()),
            Self::Uniform(count) => ((rng.next() * count as f64) as usize).min(count - 1),
            Self::List { list, all } => {
                if rng.next() < f64::from(FALLBACK) {
                    return sample_alias(all, rng.next());
                }
                let of = |e: &CellEntry| (e.keep, e.other);
                let entry = sample_table(list.len(), |i| of(&list[i]), rng.next());
                list[entry].emitter as usize
            }
        }
    }

    /// Probability with which an emitter is chosen; `power` is its share of the power.
    pub fn probability(&self, emitter: u32, power: f64) -> f64 {
        match self {
            Self::Power(_) => power,
            Self::Uniform(count) => 1.0 / *count as f64,
            Self::List { list, .. } => {
                let found = list.binary_search_by_key(&emitter, |e| e.emitter);
                let listed = found.map_or(0.0, |i| f64::from(list[i].probability));
                let fallback = f64::from(FALLBACK);
                (1.0 - fallback) * listed + fallback * power
            }
        }
    }
}

/// The list of the cell that a point lies in; empty if there is none.
fn list_at(scene: &Scene, point: DVec3) -> &[CellEntry] {
    let cells = &scene.cells;
    if cells.is_empty() {
        return &[];
    }
    let mut at = 0;
    while at & CELL == 0 {
        let node = &cells.nodes[at as usize];
        let is_behind = node.normal.as_dvec3().dot(point) <= f64::from(node.distance);
        at = node.children[usize::from(is_behind)];
    }
    let Cell { begin, count } = cells.cells[(at & !CELL) as usize];
    &cells.entries[begin as usize..][..count as usize]
}

/// Chooses an entry of an alias table by one number in `0..1`.
fn sample_alias(table: &[(f32, u32)], u: f64) -> usize {
    sample_table(table.len(), |i| table[i], u)
}

/// Chooses one of `count` entries of an alias table (Walker 1977).
fn sample_table(count: usize, entry: impl Fn(usize) -> (f32, u32), u: f64) -> usize {
    let scaled = u * count as f64;
    let at = (scaled as usize).min(count - 1);
    let (keep, other) = entry(at);
    if scaled - (at as f64) < f64::from(keep) {
        at
    } else {
        other as usize
    }
}
