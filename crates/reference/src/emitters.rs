//! Points of emitters: which one a point belongs to, how a point is chosen, and how densely.

use crate::choice::Choice;
use crate::part::Emitting;
use crate::shading::{pdf_area_to_solid_angle, sample_triangle};
use crate::world::{SurfacePoint, World};
use glam::{DVec2, DVec3};
use scene::emitter::{EmissionMap, Emitter, Emitters, NO_EMITTER, Numbering, Rectangle, Shape};

impl World {
    /// Number of the emitter that a point of a surface belongs to.
    pub fn emitter_at(&self, point: &SurfacePoint<'_>) -> Option<u32> {
        let emitters = self.emitters_of(point.place.part)?;
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
                let (tile, texel) = tile_and_texel(map, point.uv);
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
        let part = point.place.part;
        let pdf_area = || {
            let number = self.emitter_at(point)?;
            let emitters = self.emitters_of(part)?;
            let emitter = &emitters.list[number as usize];
            let probability = self.emitter_probability(choice, part, number)?;
            Some(probability * self.pdf_emitter_point(emitters, emitter, point))
        };
        let pdf_area = pdf_area().unwrap_or(0.0);
        pdf_area_to_solid_angle(pdf_area, distance * distance, point.normal.dot(direction))
    }

    /// Whether there is any light to choose.
    pub fn has_lights(&self) -> bool {
        self.scene.emitters.total_weight > 0.0 || self.moving.share > 0.0
    }

    /// Probability with which light sampling chooses an emitter on a part, by its number there.
    pub fn emitter_probability(&self, choice: &Choice<'_>, part: u32, number: u32) -> Option<f64> {
        let emitters = self.emitters_of(part)?;
        let emitter = &emitters.list[number as usize];
        let power = f64::from(emitter.weight) / f64::from(emitters.total_weight);
        Some(match self.parts[part as usize].emitting {
            Emitting::List(_) => {
                f64::from(self.moving.share) * self.moving_probabilities[part as usize] * power
            }
            _ => choice.probability(number, power),
        })
    }

    /// Density per area with which [`Self::sample_emitter_point`] chooses a point of one of the
    /// `emitters`.
    pub fn pdf_emitter_point(
        &self,
        emitters: &Emitters,
        emitter: &Emitter,
        point: &SurfacePoint<'_>,
    ) -> f64 {
        match emitter.shape {
            Shape::Part { divisions, .. } => f64::from(divisions).powi(2) / point.area,
            Shape::Texels { map, rectangle, .. } => {
                let map = &emitters.maps[map as usize];
                let (_, [x, y]) = tile_and_texel(map, point.uv);
                let part = f64::from(map.sum([x, y, x + 1, y + 1])) / f64::from(map.sum(rectangle));
                part * point.uv_area / point.area
            }
        }
    }

    /// A point of an emitter on a part as seen from `viewer`; `None` where the texel chosen lies on
    /// none of its triangles.
    pub fn sample_emitter_point(
        &self,
        part: u32,
        emitter: &Emitter,
        u: [f64; 2],
        viewer: DVec3,
    ) -> Option<SurfacePoint<'_>> {
        let emitters = self.emitters_of(part)?;
        let first = emitter.first_source as usize;
        let (place, weights) = match emitter.shape {
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
                (self.source_place(part, first), [1.0 - b1 - b2, b1, b2])
            }
            Shape::Texels {
                map,
                rectangle,
                tile,
            } => {
                let map = &emitters.maps[map as usize];
                let tile = DVec2::new(f64::from(tile[0]), f64::from(tile[1]));
                let uv = sample_texels(map, rectangle, u) + tile * map_size(map);
                (first..first + emitter.sources as usize).find_map(|source| {
                    let place = self.source_place(part, source);
                    let weights = weights_at(self.uv_of(place), uv);
                    (weights.iter().all(|&b| b >= 0.0)).then_some((place, weights))
                })?
            }
        };
        let mut point = self.point_on(place, weights, true);
        point.front = point.normal.dot(viewer - point.position) > 0.0;
        Some(point)
    }
}

fn map_size(map: &EmissionMap) -> DVec2 {
    DVec2::new(f64::from(map.width), f64::from(map.height))
}

/// The tile at texture coordinates, and the texel in it; the next one where rounding puts it outside.
fn tile_and_texel(map: &EmissionMap, uv: DVec2) -> (DVec2, [u32; 2]) {
    let size = map_size(map);
    let tile = (uv / size).floor();
    let p = uv - tile * size;
    let texel = [
        (p.x.max(0.0) as u32).min(map.width - 1),
        (p.y.max(0.0) as u32).min(map.height - 1),
    ];
    (tile, texel)
}

/// A point of a rectangle of texels: a texel in proportion to its part, then a uniform point in it.
/// Density per squared texel: the texel's part divided by the rectangle's.
pub(crate) fn sample_texels(map: &EmissionMap, [x0, y0, x1, y1]: Rectangle, u: [f64; 2]) -> DVec2 {
    // First the row, then the texel in it; what is left of each number gives the place inside.
    let (y, v) = invert(u[1], y0..y1, |end| map.sum([x0, y0, x1, end]));
    let (x, u) = invert(u[0], x0..x1, |end| map.sum([x0, y, end, y + 1]));
    DVec2::new(f64::from(x) + u, f64::from(y) + v)
}

/// Chooses from `range` in proportion to parts that sum to `up_to` its argument, and how far `u` came
/// in the part chosen.
fn invert(u: f64, range: std::ops::Range<u32>, up_to: impl Fn(u32) -> u32) -> (u32, f64) {
    let target = u * f64::from(up_to(range.end));
    let (mut low, mut high) = (range.start, range.end - 1);
    while low < high {
        let middle = low.midpoint(high);
        if f64::from(up_to(middle + 1)) > target {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    let before = f64::from(up_to(low));
    let part = f64::from(up_to(low + 1)) - before;
    (low, ((target - before) / part).min(1.0 - f64::EPSILON))
}

/// Barycentric weights of a point of the plane.
fn weights_at([a, b, c]: [DVec2; 3], p: DVec2) -> [f64; 3] {
    let doubled = (b - a).perp_dot(c - a);
    let b1 = (p - a).perp_dot(c - a) / doubled;
    let b2 = (b - a).perp_dot(p - a) / doubled;
    [1.0 - b1 - b2, b1, b2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use glam::{Affine3A, Vec3};
    use scene::render::Sampler;
    use scene::{
        Emitters, Instance, Material, MaterialId, Mesh, Scene, Texture, TextureId, Triangle,
    };
    use std::collections::HashMap;
    use std::sync::Arc;

    /// Size of the lamp's texture.
    const SIZE: [usize; 2] = [9, 7];
    /// Corners of the lamp's face in texels, a convex polygon whose border cuts texels and tiles.
    const LAMP: [[f32; 2]; 5] = [
        [-7.3, 1.2],
        [4.6, -3.7],
        [16.1, 0.4],
        [19.7, 9.6],
        [-2.2, 12.3],
    ];
    /// Parts along each side of the panel.
    const DIVISIONS: u32 = 3;
    /// Triangles along each side that integrals are sums over: a multiple of `CELLS`.
    const STEPS: u32 = 768;
    /// Cells along each side of the panel that samples are counted in: a multiple of `DIVISIONS`.
    const CELLS: u32 = 12;

    /// Greys of the lamp's texels: two rectangles of several brightnesses with a dark seam between.
    fn grey(x: usize, y: usize) -> u8 {
        match (x, y) {
            (0..3, 0..3) => [255, 90, 160][(x + y) % 3],
            (5..9, 4..7) => 60 + 12 * (4 * (y - 4) + x - 5) as u8,
            _ => 0,
        }
    }

    fn camera() -> scene::Camera {
        scene::Camera {
            name: String::new(),
            position: Vec3::ZERO,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
            lens: None,
        }
    }

    /// A lamp with a texture, of three triangles of one face, and a panel of one triangle that
    /// shines evenly; askew, and the lamp's texels are no squares.
    fn world() -> World {
        let picture = |width: usize, height: usize, grey: &dyn Fn(usize, usize) -> u8| Texture {
            name: String::new(),
            width: width as u32,
            height: height as u32,
            rgba: (0..width * height)
                .map(|i| grey(i % width, i / width))
                .map(|g| [g, g, g, 255])
                .collect(),
        };
        let material = |texture: u32| Material {
            emission: Some(TextureId(texture)),
            emission_scale: 2.0,
            emission_weight: 1.0,
            ..Material::new("", TextureId(texture))
        };
        let triangle = |vertices: [u32; 3], uv: [[f32; 2]; 3], material: u32| Triangle {
            vertices,
            uv,
            normal: Vec3::Z,
            material: MaterialId(material),
            face: material,
        };
        let lamp = |i: usize| {
            triangle(
                [0, i as u32, i as u32 + 1],
                [LAMP[0], LAMP[i], LAMP[i + 1]],
                0,
            )
        };
        let mesh = Mesh {
            positions: LAMP
                .map(|[u, v]| Vec3::new(3.0 * u + v, 2.0 * v, 0.0))
                .into_iter()
                .chain([[0., 0.], [700., 30.], [200., 500.]].map(|[x, y]| Vec3::new(x, y, 100.0)))
                .collect(),
            triangles: vec![
                lamp(1),
                lamp(2),
                lamp(3),
                triangle([5, 6, 7], [[0.0; 2]; 3], 1),
            ],
            first_see_through: 4,
            ..Mesh::default()
        };
        let mut scene = Scene {
            meshes: vec![mesh],
            instances: vec![Instance::new(
                0,
                Affine3A::from_rotation_x(0.4) * Affine3A::from_rotation_z(1.1),
                "",
            )],
            materials: vec![material(0), material(1)],
            textures: vec![picture(SIZE[0], SIZE[1], &grey), picture(1, 1, &|_, _| 255)],
            ..Scene::default()
        };
        scene.emitters = Emitters::new(
            &scene.meshes,
            &scene.instances,
            &scene.materials,
            &scene.textures,
        )
        .with_lights(&[], &[]);
        World::new(Arc::new(scene.completed()), &camera(), 0.0).expect("a world")
    }

    /// Column, row, and 1 for the upper half, of a point of a triangle that is divided.
    fn part_at(weights: [f64; 3], divisions: u32) -> [i64; 3] {
        let [_, b1, b2] = weights.map(|b| b * f64::from(divisions));
        let upper = b1.fract() + b2.fract() > 1.0;
        [b1 as i64, b2 as i64, i64::from(upper)]
    }

    /// Where samples are counted: quarters of texels, and parts of the panel.
    fn cell(point: &SurfacePoint<'_>) -> [i64; 3] {
        match point.face {
            0 => [
                (2.0 * point.uv.x).floor() as i64,
                (2.0 * point.uv.y).floor() as i64,
                0,
            ],
            _ => part_at(point.weights, CELLS),
        }
    }

    /// By emitter and cell, the integral of the density over the points that are that emitter's.
    fn integrals(world: &World) -> HashMap<(u32, [i64; 3]), f64> {
        let mut integrals = HashMap::new();
        let n = f64::from(STEPS);
        for &place in &world.source_places {
            for (row, column, upper) in (0..STEPS)
                .flat_map(|row| (0..STEPS - row).map(move |column| (row, column)))
                .flat_map(|(row, column)| [(row, column, false), (row, column, true)])
                .filter(|(row, column, upper)| !upper || row + column < STEPS - 1)
            {
                let inside = if upper { 2.0 / 3.0 } else { 1.0 / 3.0 };
                let [b1, b2] = [column, row].map(|i| (f64::from(i) + inside) / n);
                let point = world.point_on(place, [1.0 - b1 - b2, b1, b2], true);
                if let Some(number) = world.emitter_at(&point) {
                    let emitter = &world.scene.emitters.list[number as usize];
                    *integrals.entry((number, cell(&point))).or_insert(0.0) += world
                        .pdf_emitter_point(&world.scene.emitters, emitter, &point)
                        * point.area
                        / (n * n);
                }
            }
        }
        integrals
    }

    /// Area of the lamp's face that lies in a texel, in squared texels: the polygon is cut off at
    /// each side of the texel (Sutherland and Hodgman 1974), its area is Gauss's formula.
    fn covered(x: f64, y: f64) -> f64 {
        let mut polygon = LAMP
            .map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)))
            .to_vec();
        for (inward, limit) in [
            (DVec2::X, x),
            (DVec2::NEG_X, -x - 1.0),
            (DVec2::Y, y),
            (DVec2::NEG_Y, -y - 1.0),
        ] {
            let mut cut = Vec::new();
            for (i, &a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let [from, to] = [a, b].map(|p| p.dot(inward) - limit);
                if from >= 0.0 {
                    cut.push(a);
                }
                if (from >= 0.0) != (to >= 0.0) {
                    cut.push(a.lerp(b, from / (from - to)));
                }
            }
            polygon = cut;
        }
        let next = polygon.iter().cycle().skip(1);
        polygon
            .iter()
            .zip(next)
            .map(|(a, b)| a.perp_dot(*b))
            .sum::<f64>()
            / 2.0
    }

    /// Share of an emitter's samples that lie on its face.
    fn share_on_the_face(world: &World, emitter: &Emitter) -> f64 {
        let Shape::Texels {
            map,
            rectangle,
            tile,
        } = emitter.shape
        else {
            return 1.0;
        };
        let map = &world.scene.emitters.maps[map as usize];
        let [x0, y0, x1, y1] = rectangle;
        let texels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y)));
        texels
            .map(|(x, y)| {
                let [u, v] = [(x, tile[0], SIZE[0]), (y, tile[1], SIZE[1])]
                    .map(|(at, tile, size)| f64::from(at) + f64::from(tile) * size as f64);
                f64::from(map.sum([x, y, x + 1, y + 1])) * covered(u, v)
            })
            .sum::<f64>()
            / f64::from(map.sum(rectangle))
    }

    #[test]
    fn the_test_has_texels_and_parts_whole_ones_and_cut_ones() {
        let world = world();
        let emitters = &world.scene.emitters;
        assert_eq!(emitters.maps[0].rectangles, [[0, 0, 3, 3], [5, 4, 9, 7]]);
        let is_part = |e: &&Emitter| {
            matches!(
                e.shape,
                Shape::Part {
                    divisions: DIVISIONS,
                    ..
                }
            )
        };
        let parts = emitters.list.iter().filter(is_part).count();
        assert_eq!(parts, DIVISIONS.pow(2) as usize);
        let lamps = &emitters.list[..emitters.list.len() - parts];
        let shares: Vec<f64> = lamps.iter().map(|e| share_on_the_face(&world, e)).collect();
        let whole = shares.iter().filter(|s| **s > 1.0 - 1e-6).count();
        assert!(whole >= 2 && lamps.len() - whole >= 4, "{shares:?}");
        assert!(lamps.iter().any(|e| e.sources > 1));
    }

    #[test]
    fn densities_of_points_integrate_to_the_share_on_the_face() {
        let world = world();
        let mut totals = vec![0.0; world.scene.emitters.list.len()];
        for ((number, _), integral) in integrals(&world) {
            totals[number as usize] += integral;
        }
        for (number, (emitter, total)) in world.scene.emitters.list.iter().zip(totals).enumerate() {
            let share = share_on_the_face(&world, emitter);
            assert!(
                (total - share).abs() < 2e-3,
                "emitter {number}: {total}, not {share}"
            );
        }
    }

    #[test]
    fn points_follow_their_density_and_know_their_emitter() {
        let world = world();
        let integrals = integrals(&world);
        let samples = 20_000;
        for (number, emitter) in (0..).zip(&world.scene.emitters.list) {
            let mut rng = Rng::new(Sampler::Independent, 3, u64::from(number), 5);
            let (mut counts, mut missed) = (HashMap::<_, f64>::new(), 0.0);
            for _ in 0..samples {
                match world.sample_emitter_point(0, emitter, rng.next2(), DVec3::Z * 1e4) {
                    Some(point) => {
                        assert_eq!(world.emitter_at(&point), Some(number), "{point:?}");
                        *counts.entry(cell(&point)).or_insert(0.0) += 1.0;
                    }
                    None => missed += 1.0,
                }
            }
            let mut chi2: f64 = 0.0;
            let mut freedom = -1.0;
            // What is expected in few samples is one cell, with the misses.
            let mut rest = (missed, f64::from(samples));
            for ((_, cell), integral) in integrals.iter().filter(|((n, _), _)| *n == number) {
                let (expected, count) = (
                    integral * f64::from(samples),
                    counts.remove(cell).unwrap_or(0.0),
                );
                rest.1 -= expected;
                if expected < 20.0 {
                    rest.0 += count;
                    rest.1 += expected;
                    continue;
                }
                chi2 += (count - expected).powi(2) / expected;
                freedom += 1.0;
            }
            rest.0 += counts.values().sum::<f64>();
            if rest.1 >= 20.0 {
                chi2 += (rest.0 - rest.1).powi(2) / rest.1;
                freedom += 1.0;
            } else {
                assert!(rest.0 < 60.0, "emitter {number}: {rest:?}");
            }
            // The square root of twice a chi-square is nearly normal with variance 1 (Fisher).
            let z = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0_f64).max(0.0).sqrt();
            assert!(
                z < 4.0,
                "emitter {number}: chi-square {chi2} with {freedom} degrees of freedom"
            );
        }
    }
}
