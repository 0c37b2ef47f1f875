//! The choice of one light among all.

use crate::rng::Rng;
use glam::DVec3;
use scene::Scene;
use scene::cells::{CELL, CELL_LIFT, Cell, CellEntry, FALLBACK};
use scene::emitter::LightTree;
use scene::emitter::tree::{LEAF, NO_TRAIL, TreeNode};
use scene::render::Selection;

/// How the scene's own lights are chosen at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice<'a> {
    by: By<'a>,
    /// Probability with which they are chosen from at all.
    share: f64,
}

#[derive(Clone, Copy, Debug)]
enum By<'a> {
    /// By the alias table over all emitters.
    Power(&'a [(f32, u32)]),
    /// Among so many alike.
    Uniform(usize),
    /// By the tree, as seen from a point.
    Tree { tree: &'a LightTree, from: DVec3 },
    /// By a list, or the table over all if chance says so.
    List {
        list: &'a [CellEntry],
        all: &'a [(f32, u32)],
    },
}

impl<'a> Choice<'a> {
    /// The choice at the camera, where there is none.
    pub const NONE: Self = Self {
        by: By::Uniform(1),
        share: 1.0,
    };

    /// The choice at `point` of a surface that is seen from where `normal` points to, or in fog, where there
    /// is no normal; something that moves is chosen with probability `moving` instead.
    pub fn at(
        scene: &'a Scene,
        selection: Selection,
        point: DVec3,
        normal: DVec3,
        moving: f32,
    ) -> Self {
        Self {
            by: By::at(scene, selection, point, normal),
            share: 1.0 - f64::from(moving),
        }
    }

    /// Chooses one of the scene's own emitters by its number, once it is to be one of them; `None` if
    /// none can light the point.
    pub fn sample(&self, rng: &mut Rng) -> Option<usize> {
        self.by.sample(rng)
    }

    /// Chooses one of the scene's own emitters by a guess at what each may add, and says what a sample of it
    /// stands for: one over a probability, which is not that of [`Self::probability`]. `None` if nothing can
    /// be added, or if there is no list to choose from: see [`Self::has_list`].
    ///
    /// `listed` emitters are taken from the list and one from the table over all, whose probabilities are
    /// `power`. Each has the resampling weight `m guess / p`, which by the balance heuristic of both
    /// tables is `guess / (listed p_list + p_all)`; one is kept in proportion to it ("Generalized Resampled
    /// Importance Sampling", Lin et al. 2022). The numbers that they are chosen by are evenly
    /// spread: the estimate of each alone is unbiased, and it does not matter how they hang together.
    pub fn sample_by_guess(
        &self,
        listed: u32,
        power: impl Fn(usize) -> f64,
        guess: impl Fn(usize) -> f64,
        rng: &mut Rng,
    ) -> Option<(usize, f64)> {
        let By::List { list, all } = self.by else {
            return None;
        };
        let u = rng.next();
        let of = |e: &CellEntry| (e.keep, e.other);
        let from_list = (0..listed).map(|i| {
            let x = (f64::from(i) + u) / f64::from(listed);
            let entry = list[sample_table(list.len(), |i| of(&list[i]), x)];
            (entry.emitter, f64::from(entry.probability))
        });
        let any = sample_alias(all, u) as u32;
        let (mut kept, mut sum) = (None, 0.0);
        for (emitter, probability) in from_list.chain([(any, self.by.listed(any))]) {
            let emitter = emitter as usize;
            let guessed = guess(emitter);
            if guessed <= 0.0 {
                continue;
            }
            let weight = guessed / (f64::from(listed) * probability + power(emitter));
            sum += weight;
            if rng.next() * sum < weight {
                kept = Some((emitter, guessed));
            }
        }
        let (emitter, guessed) = kept?;
        Some((emitter, sum / (guessed * self.share)))
    }

    /// Whether the choice is by a list.
    pub fn has_list(&self) -> bool {
        matches!(self.by, By::List { .. })
    }

    /// Probability with which an emitter is chosen; `power` is its share of the power.
    pub fn probability(&self, emitter: u32, power: f64) -> f64 {
        self.share * self.by.probability(emitter, power)
    }
}

impl<'a> By<'a> {
    fn at(scene: &'a Scene, selection: Selection, point: DVec3, normal: DVec3) -> Self {
        let all = scene.emitters.alias.as_slice();
        let tree = || match &scene.emitters.tree {
            tree if tree.nodes.is_empty() => Self::Power(all),
            tree => Self::Tree { tree, from: point },
        };
        match selection {
            Selection::Uniform => Self::Uniform(all.len()),
            Selection::Power => Self::Power(all),
            Selection::Tree => tree(),
            Selection::Leaf => match list_at(scene, point + normal * f64::from(CELL_LIFT)) {
                [] => tree(),
                list => Self::List { list, all },
            },
        }
    }

    fn sample(&self, rng: &mut Rng) -> Option<usize> {
        Some(match *self {
            Self::Power(all) => sample_alias(all, rng.next()),
            Self::Uniform(count) => ((rng.next() * count as f64) as usize).min(count - 1),
            Self::Tree { tree, from } => return sample_tree(tree, from, rng),
            Self::List { list, all } => {
                if rng.next() < f64::from(FALLBACK) {
                    return Some(sample_alias(all, rng.next()));
                }
                let of = |e: &CellEntry| (e.keep, e.other);
                let entry = sample_table(list.len(), |i| of(&list[i]), rng.next());
                list[entry].emitter as usize
            }
        })
    }

    fn probability(&self, emitter: u32, power: f64) -> f64 {
        match self {
            Self::Power(_) => power,
            Self::Uniform(count) => 1.0 / *count as f64,
            Self::Tree { tree, from } => tree_probability(tree, *from, emitter),
            Self::List { .. } => {
                let fallback = f64::from(FALLBACK);
                (1.0 - fallback) * self.listed(emitter) + fallback * power
            }
        }
    }

    /// Probability with which the list chooses an emitter.
    fn listed(&self, emitter: u32) -> f64 {
        let Self::List { list, .. } = self else {
            return 0.0;
        };
        let found = list.binary_search_by_key(&emitter, |e| e.emitter);
        found.map_or(0.0, |i| f64::from(list[i].probability))
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

/// Goes down the tree by chance.
fn sample_tree(tree: &LightTree, from: DVec3, rng: &mut Rng) -> Option<usize> {
    let mut at = 0;
    loop {
        let child = tree.nodes[at].child;
        if child & LEAF != 0 {
            return Some((child & !LEAF) as usize);
        }
        let share = share_of_second(tree, at, from)?;
        at = if rng.next() < share {
            child as usize
        } else {
            at + 1
        };
    }
}

/// Probability with which [`sample_tree`] comes to a light.
fn tree_probability(tree: &LightTree, from: DVec3, light: u32) -> f64 {
    let mut trail = tree.trails[light as usize];
    if trail == NO_TRAIL {
        return 0.0;
    }
    let (mut at, mut probability) = (0, 1.0);
    while tree.nodes[at].child & LEAF == 0 {
        let Some(share) = share_of_second(tree, at, from) else {
            return 0.0;
        };
        let takes_second = trail & 1 == 1;
        probability *= if takes_second { share } else { 1.0 - share };
        at = if takes_second {
            tree.nodes[at].child as usize
        } else {
            at + 1
        };
        trail >>= 1;
    }
    probability
}

/// Probability to take the second child of a group; `None` if neither can light the point.
fn share_of_second(tree: &LightTree, at: usize, from: DVec3) -> Option<f64> {
    let first = importance(&tree.nodes[at + 1], from);
    let second = importance(&tree.nodes[tree.nodes[at].child as usize], from);
    let both = first + second;
    (both > 0.0).then(|| second / both)
}

/// How much a group may matter at a point; see [`LightTree`].
fn importance(node: &TreeNode, from: DVec3) -> f64 {
    let (min, max) = (node.min.as_dvec3(), node.max.as_dvec3());
    let to_point = from - 0.5 * (min + max);
    let radius2 = (0.5 * (max - min)).length_squared();
    let distance2 = to_point.length_squared();
    let weight = f64::from(node.weight) / distance2.max(radius2).max(f64::MIN_POSITIVE);
    if node.cos_cone <= -1.0 || distance2 <= radius2 {
        return weight;
    }
    // Angles at the middle, from the axis to the point less the cone's half angle less that of the
    // bounds' sphere, by their cosines and sines.
    let away = (node.axis.as_dvec3().dot(to_point) / distance2.sqrt()).clamp(-1.0, 1.0);
    let cone = f64::from(node.cos_cone);
    let less = |(cos_a, sin_a): (f64, f64), (cos_b, sin_b): (f64, f64)| {
        if cos_a > cos_b {
            (1.0, 0.0)
        } else {
            (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b)
        }
    };
    let with_sine = |cos: f64| (cos, (1.0 - cos * cos).max(0.0).sqrt());
    let sin2_bounds = radius2 / distance2;
    let bounds = ((1.0 - sin2_bounds).sqrt(), sin2_bounds.sqrt());
    let (cos, _) = less(less(with_sine(away), with_sine(cone)), bounds);
    weight * cos.max(0.0)
}

/// Chooses an entry of an alias table by one number in `0..1`.
pub(crate) fn sample_alias(table: &[(f32, u32)], u: f64) -> usize {
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
