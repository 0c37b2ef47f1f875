//! Which lights matter where: a partition of space, and a table of lights for each of its cells.
//!
//! The power of a light says nothing of the room one stands in. A cell lists the lights that may be
//! seen from it, each with its share by power over squared distance. The list is a guess: with
//! probability [`FALLBACK`] the table over all emitters chooses instead, so a light that is missing in
//! a list costs noise and never light.

use crate::emitter::{Emitters, LightBounds, Shine, alias_table};
use glam::Vec3;

/// Probability with which the table over all emitters chooses, whatever the cell's list says.
pub const FALLBACK: f32 = 0.1;

/// Most lights in a cell's list: the rest is left to the fallback.
const MOST_PER_CELL: usize = 128;

/// A list that would lack more than the rest of this share of the weight is left empty: the tree over
/// all lights knows better.
const LEAST_COVERED: f32 = 0.5;

/// Most entries of all lists together; 16 bytes each.
const MOST_ENTRIES: usize = 1 << 21;

/// Lights nearer than this count as if they were this far, world units: what is close to a cell is
/// at very different distances from its points.
const NEAREST: f32 = 16.0;

/// How far off a surface a point's cell is looked up, world units. Surfaces lie on the borders of cells,
/// and by a rounding error behind them: in solid, where there is no list.
pub const CELL_LIFT: f32 = 0.25;

/// A split of space by a plane.
#[derive(Clone, Copy, Debug)]
pub struct CellNode {
    /// Unit normal.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal.
    pub distance: f32,
    /// Where points in front of the plane go, and those behind or on it: a later node, or the
    /// number of a cell with [`CELL`] added.
    pub children: [u32; 2],
}

/// Flag of a [`CellNode`]'s child: a cell, not a node.
pub const CELL: u32 = 1 << 31;

/// A cell's part of [`LightCells::entries`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// First entry.
    pub begin: u32,
    /// Number of entries; without any, the tree over all lights chooses.
    pub count: u32,
}

/// A light in a cell's list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellEntry {
    /// Number of the emitter, as in [`Emitters::alias`]. Rises within a list.
    pub emitter: u32,
    /// Probability with which the list chooses it.
    pub probability: f32,
    /// Alias table of the list: probability to keep this entry.
    pub keep: f32,
    /// Alias table of the list: the entry to take otherwise, counted within the list.
    pub other: u32,
}

/// The partition with its lists.
#[derive(Clone, Debug, Default)]
pub struct LightCells {
    /// Splits, the first one at the root; children come after their parents. Empty if there is no
    /// partition.
    pub nodes: Vec<CellNode>,
    /// The cells.
    pub cells: Vec<Cell>,
    /// The lists, one after the other.
    pub entries: Vec<CellEntry>,
}

impl LightCells {
    /// Makes the lists of a partition: `bounds` are the corners of each cell's box and
    /// `candidates` gives the numbers of the emitters that may be seen from a cell, rising.
    #[must_use]
    pub fn new(
        nodes: Vec<CellNode>,
        bounds: &[[Vec3; 2]],
        emitters: &Emitters,
        mut candidates: impl FnMut(usize, &mut Vec<u32>),
    ) -> Self {
        let most = (MOST_ENTRIES / bounds.len().max(1)).min(MOST_PER_CELL);
        let (mut cells, mut entries) = (Vec::with_capacity(bounds.len()), Vec::new());
        let (mut seen, mut weighed) = (Vec::new(), Vec::new());
        for (cell, &bounds) in bounds.iter().enumerate() {
            seen.clear();
            candidates(cell, &mut seen);
            weighed.clear();
            weighed.extend(seen.iter().filter_map(|&emitter| {
                let weight = weight(&emitters.bounds[emitter as usize], bounds);
                (weight > 0.0 && weight.is_finite()).then_some((emitter, weight))
            }));
            let all: f32 = weighed.iter().map(|&(_, w)| w).sum();
            if weighed.len() > most {
                weighed.select_nth_unstable_by(most, |a, b| b.1.total_cmp(&a.1));
                weighed.truncate(most);
                weighed.sort_unstable_by_key(|&(emitter, _)| emitter);
                if weighed.iter().map(|&(_, w)| w).sum::<f32>() < LEAST_COVERED * all {
                    weighed.clear();
                }
            }
            cells.push(Cell {
                begin: entries.len() as u32,
                count: weighed.len() as u32,
            });
            push_list(&mut entries, &weighed);
        }
        Self {
            nodes,
            cells,
            entries,
        }
    }

    /// Whether there is a partition.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

/// Share of a light in a cell's list, not normalised: what it may add over squared distance, none for
/// surfaces that show the whole cell their back and cones that pass it.
fn weight(light: &LightBounds, [min, max]: [Vec3; 2]) -> f32 {
    let (middle, reach) = (0.5 * (min + max), 0.5 * (max - min).length());
    let from_light = middle - light.centre;
    match light.shine {
        Shine::Distant => return light.weight,
        Shine::Front => {
            // The corner of the box farthest along the normal.
            let corner = Vec3::select(light.axis.cmpgt(Vec3::ZERO), max, min);
            if (corner - light.centre).dot(light.axis) <= 0.0 {
                return 0.0;
            }
        }
        Shine::Cone { cos_outer, .. } => {
            // From the axis to the nearest direction of the sphere around the box.
            let distance = from_light.length();
            let away = (from_light.dot(light.axis) / distance)
                .clamp(-1.0, 1.0)
                .acos();
            if distance > reach && away - (reach / distance).asin() > cos_outer.max(-1.0).acos() {
                return 0.0;
            }
        }
        Shine::BothSides | Shine::AllRound => {}
    }
    let apart = (light.centre.clamp(min, max).distance(light.centre) - light.radius).max(0.0);
    let spread = 0.5 * reach;
    light.weight / (apart * apart + spread * spread + NEAREST * NEAREST)
}

/// Adds a list of emitters with their weights.
fn push_list(entries: &mut Vec<CellEntry>, weighed: &[(u32, f32)]) {
    let weights: Vec<f64> = weighed.iter().map(|&(_, w)| f64::from(w)).collect();
    let total: f64 = weights.iter().sum();
    let alias = alias_table(&weights, total);
    entries.extend(weighed.iter().zip(alias).zip(&weights).map(
        |((&(emitter, _), (keep, other)), weight)| CellEntry {
            emitter,
            probability: (weight / total) as f32,
            keep,
            other,
        },
    ));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::{Emitter, Shape};
    use crate::light::{PointLight, Spot};
    use crate::material::MaterialId;

    fn lamps(all: impl IntoIterator<Item = (f32, f32)>) -> Emitters {
        // All face to +x.
        let lamp = |(x, weight)| Emitter {
            first_source: 0,
            sources: 1,
            shape: Shape::Part {
                divisions: 1,
                column: 0,
                row: 0,
                upper: false,
            },
            material: MaterialId(0),
            weight,
            corners: [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]
                .map(|[y, z]| Vec3::new(x, y, z)),
            normal: Vec3::X,
            two_sided: false,
        };
        let all = Emitters {
            list: all.into_iter().map(lamp).collect(),
            ..Emitters::default()
        };
        all.with_lights(&[], &[])
    }

    #[test]
    fn lists_hold_what_may_be_seen_by_power_and_distance() {
        let emitters = lamps([(-100.0, 1.0), (-400.0, 1.0), (50.0, 1.0)]);
        let cells = LightCells::new(
            vec![],
            &[[Vec3::ZERO, Vec3::splat(8.0)]; 3],
            &emitters,
            |cell, out| match cell {
                0 => out.extend([0, 1, 2]),
                1 => out.extend([1]),
                _ => {}
            },
        );
        let list = |i: usize| {
            let Cell { begin, count } = cells.cells[i];
            &cells.entries[begin as usize..][..count as usize]
        };
        // The third lamp shows its back.
        let emitters: Vec<u32> = list(0).iter().map(|e| e.emitter).collect();
        assert_eq!(emitters, [0, 1]);
        let sum: f32 = list(0).iter().map(|e| e.probability).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        let ratio = list(0)[0].probability / list(0)[1].probability;
        // From the sphere around the lamp.
        let radius = 1.001 * 32f32.sqrt();
        let (near, far) = ((100.0 - radius).powi(2), (400.0 - radius).powi(2));
        let softened = 256.0 + (0.25 * 192f32.sqrt()).powi(2);
        assert!(
            (ratio / ((far + softened) / (near + softened)) - 1.0).abs() < 1e-4,
            "{ratio}"
        );
        assert_eq!((list(1).len(), list(1)[0].probability), (1, 1.0));
        assert!(list(2).is_empty());
    }

    #[test]
    fn cones_that_pass_a_cell_are_not_in_its_list() {
        let lamp = |x: f32, degrees: f32| PointLight {
            position: Vec3::new(x, 4.0, 200.0),
            intensity: Vec3::ONE,
            spot: Some(Spot {
                direction: Vec3::NEG_Z,
                cos_inner: 1.0,
                cos_outer: degrees.to_radians().cos(),
            }),
            ..PointLight::default()
        };
        // From 196 above the middle of the cell, whose sphere has a radius of 6.9: 27 degrees aside, of which the
        // sphere takes 1.8.
        let lights = [lamp(4.0, 1.0), lamp(104.0, 24.0), lamp(104.0, 26.0)];
        let emitters = Emitters::default().with_lights(&lights, &[]);
        let bounds = [[Vec3::ZERO, Vec3::splat(8.0)]];
        let cells = LightCells::new(vec![], &bounds, &emitters, |_, out| out.extend([0, 1, 2]));
        let listed: Vec<u32> = cells.entries.iter().map(|e| e.emitter).collect();
        assert_eq!(listed, [0, 2]);
    }

    #[test]
    fn long_lists_keep_the_strongest_in_order() {
        let emitters = lamps((0..400).map(|i| (-100.0, (i * 37 % 400) as f32 + 1.0)));
        let bounds = [[Vec3::ZERO, Vec3::ONE]];
        let all = |_: usize, out: &mut Vec<u32>| out.extend(0..400);
        let cells = LightCells::new(vec![], &bounds, &emitters, all);
        assert_eq!(cells.entries.len(), MOST_PER_CELL);
        assert!(cells.entries.is_sorted_by_key(|e| e.emitter));
        for e in &cells.entries {
            assert!(emitters.list[e.emitter as usize].weight > 400.0 - MOST_PER_CELL as f32);
        }
        // Where the strongest are less than half of it all, the tree chooses.
        let alike = lamps((0..400).map(|_| (-100.0, 1.0)));
        let cells = LightCells::new(vec![], &bounds, &alike, all);
        assert_eq!((cells.cells[0].count, cells.entries.len()), (0, 0));
    }
}
