//! Points of emitters: which one a point belongs to, how a point is chosen, and how densely.

use crate::choice::Choice;
use crate::shading::{pdf_area_to_solid_angle, sample_triangle};
use crate::world::{SurfacePoint, World};
use glam::{DVec2, DVec3};
use scene::emitter::{EmissionMap, Emitter, NO_EMITTER, Numbering, Rectangle, Shape};

impl World {
    /// Number of the emitter that a point of a surface belongs to.
    fn emitter_at(&self, point: &SurfacePoint<'_>) -> Option<u32> {
        let emitters = &self.scene.emitters;
        let source = emitters.sources.get(point.source as usize)?;
        let number = match source.numbering {
            Numbering::Parts { divisions, first } => {
                let n = f64::from(divisions);
                let [_, b1, b2] = point.weights.map(|b| b * n);
                let row = b2.clamp(0.0, n - 1.0).floor();
                let column = b1.clamp(0.0, n - 1.0 - row).floor();
                // In the last column of a row there is no upper half.
                let upper = b1 - column + b2 - row > 1.0 && column + row < n - 1.0;
                let before = row * (2.0 * n - row) + 2.0 * column;
                first + before as u32 + u32::from(upper)
            }
            Numbering::Texels {
                map,
                first_tile,
                tiles,
                table,
            } => {
                let map = &emitters.maps[map as usize];
                let size = map_size(map);
                let tile = (point.uv / size).floor();
                let texel = texel(map, point.uv - tile * size);
                let label =
                    map.labels[(texel[1] * map.width + texel[0]) as usize].checked_sub(1)?;
                let along = |axis: usize, tile: f64| {
                    let at = (tile as i64 - i64::from(first_tile[axis])).max(0) as u32;
                    at.min(tiles[axis] - 1)
                };
                let place = along(1, tile.y) * tiles[0] + along(0, tile.x);
                let index = table + place * map.rectangles.len() as u32 + label;
                emitters.numbers[index as usize]
            }
        };
        (number != NO_EMITTER).then_some(number)
    }

    /// Density per steradian with which light sampling chooses a point that a ray found after
    /// `distance` in `direction`.
    pub fn pdf_light(
        &self,
        choice: &Choice<'_>,
        point: &SurfacePoint<'_>,
        direction: DVec3,
        distance: f64,
    ) -> f64 {
        let pdf_area = match self.emitter_at(point) {
            Some(number) => self.pdf_light_area(choice, number, point),
            None => 0.0,
        };
        pdf_area_to_solid_angle(pdf_area, distance * distance, point.normal.dot(direction))
    }

    /// Density per area with which light sampling chooses a point of an emitter.
    pub fn pdf_light_area(
        &self,
        choice: &Choice<'_>,
        number: u32,
        point: &SurfacePoint<'_>,
    ) -> f64 {
        let emitter = &self.scene.emitters.list[number as usize];
        let power = f64::from(emitter.weight) / f64::from(self.scene.emitters.total_weight);
        choice.probability(number, power) * self.pdf_emitter_point(emitter, point)
    }

    /// Density per area with which [`Self::sample_emitter_point`] chooses a point of `emitter`.
    fn pdf_emitter_point(&self, emitter: &Emitter, point: &SurfacePoint<'_>) -> f64 {
        match emitter.shape {
            Shape::Part { divisions, .. } => f64::from(divisions).powi(2) / point.area,
            Shape::Texels { map, rectangle, .. } => {
                let map = &self.scene.emitters.maps[map as usize];
                let [x, y] = texel(
                    map,
                    point.uv - (point.uv / map_size(map)).floor() * map_size(map),
                );
                let part = f64::from(map.sum([x, y, x + 1, y + 1])) / f64::from(map.sum(rectangle));
                part * point.uv_area / point.area
            }
        }
    }

    /// A point of an emitter as seen from `viewer`; `None` where the texel chosen lies on none of
    /// its triangles.
    pub fn sample_emitter_point(
        &self,
        emitter: &Emitter,
        u: [f64; 2],
        viewer: DVec3,
    ) -> Option<SurfacePoint<'_>> {
        let (slot, weights) = match emitter.shape {
            Shape::Part {
                divisions,
                column,
                row,
                upper,
            } => {
                let [_, b1, b2] = sample_triangle(u);
                let (b1, b2) = if upper {
                    (1.0 - b1, 1.0 - b2)
                } else {
                    (b1, b2)
                };
                let n = f64::from(divisions);
                let (b1, b2) = ((f64::from(column) + b1) / n, (f64::from(row) + b2) / n);
                let slot = self.source_slots[emitter.first_source as usize];
                (slot, [1.0 - b1 - b2, b1, b2])
            }
            Shape::Texels {
                map,
                rectangle,
                tile,
            } => {
                let map = &self.scene.emitters.maps[map as usize];
                let tile = DVec2::new(f64::from(tile[0]), f64::from(tile[1]));
                let uv = sample_texels(map, rectangle, u) + tile * map_size(map);
                let first = emitter.first_source as usize;
                let slots = &self.source_slots[first..first + emitter.sources as usize];
                slots.iter().find_map(|&slot| {
                    let weights = weights_at(self.uv_of(slot), uv);
                    weights.iter().all(|&b| b >= 0.0).then_some((slot, weights))
                })?
            }
        };
        let mut point = self.point_on(slot, weights, true);
        point.front = point.normal.dot(viewer - point.position) > 0.0;
        Some(point)
    }
}

fn map_size(map: &EmissionMap) -> DVec2 {
    DVec2::new(f64::from(map.width), f64::from(map.height))
}

/// The texel at a point of a map; the next one where rounding puts it outside.
fn texel(map: &EmissionMap, p: DVec2) -> [u32; 2] {
    [
        (p.x.max(0.0) as u32).min(map.width - 1),
        (p.y.max(0.0) as u32).min(map.height - 1),
    ]
}

/// A point of a rectangle of texels: a texel in proportion to its part, then a uniform point in it.
/// Density per squared texel: the texel's part divided by the rectangle's.
pub(crate) fn sample_texels(map: &EmissionMap, [x0, y0, x1, y1]: Rectangle, u: [f64; 2]) -> DVec2 {
    // First the row, then the texel in it; what is left of each number gives the place inside.
    let (y, v) = invert(u[1], y0..y1, |y| map.sum([x0, y, x1, y + 1]));
    let (x, u) = invert(u[0], x0..x1, |x| map.sum([x, y, x + 1, y + 1]));
    DVec2::new(f64::from(x) + u, f64::from(y) + v)
}

/// Chooses from `range` in proportion to `part`, and how far `u` came in the part chosen.
fn invert(u: f64, range: std::ops::Range<u32>, part: impl Fn(u32) -> u32) -> (u32, f64) {
    let total: u64 = range.clone().map(|i| u64::from(part(i))).sum();
    let mut rest = u * total as f64;
    let mut last = (range.start, 0.0);
    for i in range {
        let part = f64::from(part(i));
        if part > 0.0 {
            last = (i, (rest / part).min(1.0 - f64::EPSILON));
            if rest < part {
                break;
            }
        }
        rest -= part;
    }
    last
}

/// Barycentric weights of a point of the plane.
fn weights_at([a, b, c]: [DVec2; 3], p: DVec2) -> [f64; 3] {
    let doubled = (b - a).perp_dot(c - a);
    let b1 = (p - a).perp_dot(c - a) / doubled;
    let b2 = (b - a).perp_dot(p - a) / doubled;
    [1.0 - b1 - b2, b1, b2]
}
