//! Lists what emits: each texture's rectangles, cut to the faces and tiles they show on.

use super::map::{EmissionMap, Rectangle};
use super::{Emitter, Emitters, NO_EMITTER, Numbering, Shape, Source};
use crate::material::{Material, MaterialId, Surface, Texture, TextureId};
use crate::mesh::{Instance, Mesh, Triangle};
use glam::{DVec2, DVec3, Vec3};
use std::collections::HashMap;

/// Longest side of a part of a triangle whose texture can't be taken apart (sky, liquids), in world
/// units: near parts are chosen more often than far ones.
const PART_SIDE: f64 = 256.0;
/// Most parts along a side.
const MOST_DIVISIONS: u32 = 32;
/// Most parts of all triangles together, about; beyond they are larger.
const MOST_PARTS: f64 = 65_536.0;
/// Most places (tiles times rectangles) of one face, and of all.
const MOST_PLACES: usize = 1 << 16;
const MOST_PLACES_OF_ALL: usize = 1 << 22;

/// Lists what emits, without a choice.
pub(super) fn list(
    meshes: &[Mesh],
    instances: &[Instance],
    materials: &[Material],
    textures: &[Texture],
) -> Emitters {
    let mut lister = Lister {
        out: Emitters::default(),
        materials,
        maps: HashMap::new(),
        part_side: PART_SIDE,
    };
    lister.part_side = part_side(meshes, instances, materials);
    for (number, instance) in instances.iter().enumerate() {
        if !instance.seen_by.others() {
            continue;
        }
        let mesh = &meshes[instance.mesh];
        let positions = mesh.posed(instance.pose);
        let mut rest = mesh.triangles.as_slice();
        while let Some(first) = rest.first() {
            let same = |t: &&Triangle| t.face == first.face && t.material == first.material;
            let count = rest.iter().take_while(same).count();
            let (face, after) = rest.split_at(count);
            let material = instance.material_of(first);
            if materials[material.0 as usize].emission_weight > 0.0 {
                let start = (mesh.triangles.len() - rest.len()) as u32;
                let map = lister.map_of(material, textures);
                let face = Face::new(number as u32, instance, &positions, start, face);
                lister.add_face(face, map);
            }
            rest = after;
        }
    }
    lister.out
}

/// Longest side of parts, so that there are not too many.
fn part_side(meshes: &[Mesh], instances: &[Instance], materials: &[Material]) -> f64 {
    let mut area = 0.0;
    for instance in instances.iter().filter(|i| i.seen_by.others()) {
        let mesh = &meshes[instance.mesh];
        let positions = mesh.posed(instance.pose);
        let emits =
            |t: &Triangle| materials[instance.material_of(t).0 as usize].emission_weight > 0.0;
        for (i, t) in mesh.triangles.iter().enumerate().filter(|(_, t)| emits(t)) {
            area += Placed::new(instance, &positions, i as u32, t).area;
        }
    }
    PART_SIDE.max((area / MOST_PARTS).sqrt())
}

/// A list under way.
struct Lister<'a> {
    out: Emitters,
    materials: &'a [Material],
    /// Number of the map of a material's textures; `None` if they can't be taken apart.
    maps: HashMap<(TextureId, Option<TextureId>), Option<u32>>,
    part_side: f64,
}

/// A triangle in world space.
#[derive(Clone, Copy)]
struct Placed {
    /// Index into the mesh's triangles.
    index: u32,
    corners: [DVec3; 3],
    uv: [DVec2; 3],
    area: f64,
}

impl Placed {
    fn new(instance: &Instance, positions: &[Vec3], index: u32, t: &Triangle) -> Self {
        let corners = (t.vertices).map(|v| {
            let p = positions[v as usize];
            instance.transform.transform_point3(p).as_dvec3()
        });
        let [a, b, c] = corners;
        Self {
            index,
            corners,
            uv: t.uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v))),
            area: (b - a).cross(c - a).length() / 2.0,
        }
    }

    /// Twice its area in texture coordinates, signed.
    fn uv_area2(&self) -> f64 {
        (self.uv[1] - self.uv[0]).perp_dot(self.uv[2] - self.uv[0])
    }

    /// The point with these texture coordinates.
    fn at_uv(&self, p: DVec2) -> DVec3 {
        let [a, b, c] = self.uv;
        let b1 = (p - a).perp_dot(c - a) / self.uv_area2();
        let b2 = (b - a).perp_dot(p - a) / self.uv_area2();
        self.at(b1, b2)
    }

    fn at(&self, b1: f64, b2: f64) -> DVec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * b1 + (c - a) * b2
    }
}

/// Triangles of one face, side by side in their mesh.
struct Face {
    instance: u32,
    material: MaterialId,
    normal: Vec3,
    triangles: Vec<Placed>,
}

impl Face {
    /// `face` is triangles from number `start` on, of a mesh with vertices at `positions`.
    fn new(
        number: u32,
        instance: &Instance,
        positions: &[Vec3],
        start: u32,
        face: &[Triangle],
    ) -> Self {
        let triangles: Vec<Placed> = (face.iter().zip(start..))
            .map(|(t, i)| Placed::new(instance, positions, i, t))
            .filter(|t| t.area > 0.0 && t.area.is_finite())
            .collect();
        let m = instance.transform.matrix3;
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let n = face[0].normal;
        // The cofactor matrix with the determinant's sign keeps normals on their side.
        let n =
            (y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z) * x.cross(y).dot(z).signum();
        Self {
            instance: number,
            material: instance.material_of(&face[0]),
            normal: Vec3::from(n).normalize_or_zero(),
            triangles,
        }
    }
}

/// What a rectangle of a tile has gathered from a face's triangles.
struct Gathered {
    /// Luminance times world area.
    light: f64,
    /// Bounds in the tile's texel coordinates.
    min: DVec2,
    max: DVec2,
    /// Sources, first and last.
    first: u32,
    last: u32,
    /// The outermost points towards the four corners of the texture, and how far out they are.
    corners: [(f64, DVec3); 4],
}

impl Lister<'_> {
    /// The map of a material; `None` where its texels do not stay where its coordinates say, or change.
    fn map_of(&mut self, material: MaterialId, textures: &[Texture]) -> Option<u32> {
        let material = &self.materials[material.0 as usize];
        if material.warped || material.surface == Surface::Sky || !material.frames.is_empty() {
            return None;
        }
        let emission = material.emission?;
        let holes = material.alpha_tested.then_some(material.base);
        let maps = &mut self.out.maps;
        *self.maps.entry((emission, holes)).or_insert_with(|| {
            let holes = holes.map(|id| &textures[id.0 as usize].rgba);
            let is_hole = |i: usize| holes.and_then(|h| h.get(i)).is_some_and(|t| t[3] == 0);
            let texture = &textures[emission.0 as usize];
            // One colour alone need not be told apart.
            if texture
                .rgba
                .iter()
                .enumerate()
                .all(|(i, t)| *t == texture.rgba[0] && !is_hole(i))
            {
                return None;
            }
            let map = EmissionMap::new(texture, is_hole)?;
            maps.push(map);
            Some(maps.len() as u32 - 1)
        })
    }

    fn add_face(&mut self, face: Face, map: Option<u32>) {
        let is_flat = |t: &Placed| t.uv_area2().abs() > 1e-9 * t.area;
        match map.and_then(|map| self.tiles(&face, map).map(|tiles| (map, tiles))) {
            Some((map, tiles)) if face.triangles.iter().all(is_flat) => {
                self.add_texels(&face, map, tiles);
            }
            _ => {
                for t in &face.triangles {
                    self.add_parts(&face, t);
                }
            }
        }
    }

    /// First tile and number of tiles along each axis; `None` if there are too many.
    fn tiles(&self, face: &Face, map: u32) -> Option<([i32; 2], [u32; 2])> {
        let map = &self.out.maps[map as usize];
        let size = DVec2::new(f64::from(map.width), f64::from(map.height));
        let points = || face.triangles.iter().flat_map(|t| t.uv);
        let min = (points().fold(DVec2::INFINITY, DVec2::min) / size).floor();
        let max = (points().fold(DVec2::NEG_INFINITY, DVec2::max) / size).floor();
        let tiles = max - min + 1.0;
        let places = tiles.x * tiles.y * map.rectangles.len() as f64;
        let used = self.out.numbers.len();
        let fits = places <= MOST_PLACES as f64
            && used + places as usize <= MOST_PLACES_OF_ALL
            && min.abs().max_element() < 1e6;
        fits.then_some((
            [min.x as i32, min.y as i32],
            [tiles.x as u32, tiles.y as u32],
        ))
    }

    fn add_texels(&mut self, face: &Face, map_index: u32, tiles: ([i32; 2], [u32; 2])) {
        let (first_tile, tiles) = tiles;
        let map = &self.out.maps[map_index as usize];
        let size = DVec2::new(f64::from(map.width), f64::from(map.height));
        let per_tile = map.rectangles.len();
        let mut places: Vec<Option<Gathered>> = Vec::new();
        places.resize_with(tiles[0] as usize * tiles[1] as usize * per_tile, || None);
        let first_source = self.out.sources.len() as u32;
        for (t, source) in face.triangles.iter().zip(first_source..) {
            let texel_area = t.area / (0.5 * t.uv_area2().abs());
            let min = (t.uv[0].min(t.uv[1]).min(t.uv[2]) / size).floor();
            let max = (t.uv[0].max(t.uv[1]).max(t.uv[2]) / size).floor();
            for y in min.y as i32..=max.y as i32 {
                for x in min.x as i32..=max.x as i32 {
                    let origin = DVec2::new(f64::from(x), f64::from(y)) * size;
                    let row = (y - first_tile[1]) as usize * tiles[0] as usize;
                    let place = (row + (x - first_tile[0]) as usize) * per_tile;
                    for (i, rectangle) in map.rectangles.iter().enumerate() {
                        let polygon = clip(t.uv.map(|p| p - origin).to_vec(), rectangle);
                        let light = map.integrate(&polygon) * texel_area;
                        if polygon.len() >= 3 && light > 0.0 {
                            let gathered =
                                places[place + i].get_or_insert_with(|| Gathered::new(source));
                            let world = polygon.iter().map(|&p| (p, t.at_uv(p + origin)));
                            gathered.add(source, light, world);
                        }
                    }
                }
            }
        }
        let material = &self.materials[face.material.0 as usize];
        let scale = f64::from(material.emission_scale) * if material.two_sided { 2.0 } else { 1.0 };
        let table = self.out.numbers.len() as u32;
        for (place, gathered) in places.into_iter().enumerate() {
            let number = gathered.and_then(|g| {
                let tile = place / per_tile;
                let (x, y) = (tile % tiles[0] as usize, tile / tiles[0] as usize);
                let tile = [first_tile[0] + x as i32, first_tile[1] + y as i32];
                let rectangle = g.crop(&map.rectangles[place % per_tile]);
                let weight = (g.light * scale) as f32;
                let chosen = weight > 0.0 && weight.is_finite() && map.sum(rectangle) > 0;
                chosen.then(|| {
                    self.out.list.push(Emitter {
                        first_source: g.first,
                        sources: g.last - g.first + 1,
                        shape: Shape::Texels {
                            map: map_index,
                            rectangle,
                            tile,
                        },
                        material: face.material,
                        weight,
                        corners: g.corners.map(|(_, p)| p.as_vec3()),
                        normal: face.normal,
                        two_sided: material.two_sided,
                    });
                    self.out.list.len() as u32 - 1
                })
            });
            self.out.numbers.push(number.unwrap_or(NO_EMITTER));
        }
        self.out
            .sources
            .extend(face.triangles.iter().map(|t| Source {
                instance: face.instance,
                triangle: t.index,
                numbering: Numbering::Texels {
                    map: map_index,
                    first_tile,
                    tiles,
                    table,
                },
            }));
    }

    fn add_parts(&mut self, face: &Face, t: &Placed) {
        let material = &self.materials[face.material.0 as usize];
        let [a, b, c] = t.corners;
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        let n = ((longest / self.part_side).ceil() as u32).clamp(1, MOST_DIVISIONS);
        let weight = t.area * f64::from(material.emission_weight) / f64::from(n * n);
        let weight = weight as f32;
        if !(weight > 0.0 && weight.is_finite()) {
            return;
        }
        let (first_source, first) = (self.out.sources.len() as u32, self.out.list.len() as u32);
        let two_sided = material.two_sided || material.surface == Surface::Sky;
        for row in 0..n {
            for half in 0..2 * (n - row) - 1 {
                let (column, upper) = (half / 2, half % 2 == 1);
                let at = |x: u32, y: u32| {
                    let p = t.at(
                        f64::from(column + x) / f64::from(n),
                        f64::from(row + y) / f64::from(n),
                    );
                    p.as_vec3()
                };
                let corners = [at(u32::from(upper), u32::from(upper)), at(1, 0), at(0, 1)];
                self.out.list.push(Emitter {
                    first_source,
                    sources: 1,
                    shape: Shape::Part {
                        divisions: n,
                        column,
                        row,
                        upper,
                    },
                    material: face.material,
                    weight,
                    corners: [corners[0], corners[1], corners[2], corners[2]],
                    normal: face.normal,
                    two_sided,
                });
            }
        }
        self.out.sources.push(Source {
            instance: face.instance,
            triangle: t.index,
            numbering: Numbering::Parts {
                divisions: n,
                first,
            },
        });
    }
}

impl Gathered {
    fn new(source: u32) -> Self {
        Self {
            light: 0.0,
            min: DVec2::INFINITY,
            max: DVec2::NEG_INFINITY,
            first: source,
            last: source,
            corners: [(f64::NEG_INFINITY, DVec3::ZERO); 4],
        }
    }

    /// Adds a piece: its light and its corners in the tile and in the world.
    fn add(&mut self, source: u32, light: f64, corners: impl Iterator<Item = (DVec2, DVec3)>) {
        self.light += light;
        self.last = source;
        for (p, world) in corners {
            (self.min, self.max) = (self.min.min(p), self.max.max(p));
            let ways = [-p.x - p.y, p.x - p.y, p.x + p.y, p.y - p.x];
            for (corner, way) in self.corners.iter_mut().zip(ways) {
                if way > corner.0 {
                    *corner = (way, world);
                }
            }
        }
    }

    /// The texels of the rectangle that the pieces touch.
    fn crop(&self, &[x0, y0, x1, y1]: &Rectangle) -> Rectangle {
        let low = |v: f64, from: u32| (v.max(0.0) as u32).max(from);
        let high = |v: f64, to: u32| (v.max(0.0).ceil() as u32).min(to);
        [
            low(self.min.x, x0).min(x1),
            low(self.min.y, y0).min(y1),
            high(self.max.x, x1).max(x0),
            high(self.max.y, y1).max(y0),
        ]
    }
}

/// The part of a convex polygon within a rectangle (Sutherland and Hodgman 1974).
fn clip(mut polygon: Vec<DVec2>, &[x0, y0, x1, y1]: &Rectangle) -> Vec<DVec2> {
    let sides = [
        (DVec2::X, f64::from(x0)),
        (DVec2::NEG_X, -f64::from(x1)),
        (DVec2::Y, f64::from(y0)),
        (DVec2::NEG_Y, -f64::from(y1)),
    ];
    for (inward, least) in sides {
        let inside = |p: DVec2| inward.dot(p) - least;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (da, db) = (inside(a), inside(b));
            if da >= 0.0 {
                kept.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                kept.push(a.lerp(b, da / (da - db)));
            }
        }
        polygon = kept;
    }
    polygon
}
