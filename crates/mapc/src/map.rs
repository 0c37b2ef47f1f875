//! The map as people write it: entities made of keys and convex brushes.

use crate::math::{Plane, Vec3, add, dot, sub};
use crate::texture::Texture;
use crate::winding::Winding;

/// How a texture lies on a brush face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// The classic form: projected along the axis nearest to the face's normal.
    Standard {
        /// Shift in texels along the texture's axes.
        offset: [f64; 2],
        /// Rotation in degrees.
        rotation: f64,
        /// Quake units per texel along the texture's axes (0 counts as 1).
        scale: [f64; 2],
    },
    /// Valve 220: axes given outright.
    Valve {
        /// Direction of each texture axis, in Quake units.
        axes: [Vec3; 2],
        /// Shift in texels along the texture's axes.
        offset: [f64; 2],
        /// Quake units per texel along the axes (0 counts as 1).
        scale: [f64; 2],
    },
}

impl Default for Projection {
    fn default() -> Self {
        Self::Standard {
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
        }
    }
}

/// Normal, S axis and T axis of the six projections of the classic format, in qbsp's order
/// (its `baseaxis` table): the first that fits best wins.
const BASE_AXES: [[Vec3; 3]; 6] = [
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
    [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
];

impl Projection {
    /// Rows S and T as stored in texinfo: texel = dot(p, row.xyz) + row.w.
    pub(crate) fn texinfo_rows(&self, normal: Vec3) -> [[f64; 4]; 2] {
        let inverse = |s: f64| if s == 0.0 { 1.0 } else { 1.0 / s };
        let row = |a: Vec3, s: f64, o: f64| {
            let k = inverse(s);
            [a[0] * k, a[1] * k, a[2] * k, o]
        };
        match *self {
            Self::Valve {
                axes,
                offset,
                scale,
            } => [
                row(axes[0], scale[0], offset[0]),
                row(axes[1], scale[1], offset[1]),
            ],
            Self::Standard {
                offset,
                rotation,
                scale,
            } => {
                let mut best = 0;
                let mut best_dot = 0.0;
                for (i, axes) in BASE_AXES.iter().enumerate() {
                    let d = dot(normal, axes[0]);
                    // A hair above, so that diagonal faces choose the same axis whatever the
                    // last bit of their normal.
                    if d > best_dot + 1e-9 {
                        best_dot = d;
                        best = i;
                    }
                }
                let [_, s, t] = BASE_AXES[best];
                let (sin, cos) = sin_cos_degrees(rotation);
                let axis_of = |v: Vec3| (0..3).find(|&i| v[i] != 0.0).unwrap_or(0);
                let (si, ti) = (axis_of(s), axis_of(t));
                let turn = |v: Vec3| {
                    let mut r = v;
                    r[si] = cos * v[si] - sin * v[ti];
                    r[ti] = sin * v[si] + cos * v[ti];
                    r
                };
                [
                    row(turn(s), scale[0], offset[0]),
                    row(turn(t), scale[1], offset[1]),
                ]
            }
        }
    }
}

/// Exact at the quarter turns, which is what nearly all maps use.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        d => d.to_radians().sin_cos(),
    }
}

/// One side of a brush.
#[derive(Debug, Clone, PartialEq)]
pub struct BrushFace {
    /// Three points of the face's plane, clockwise as seen from outside the brush.
    pub points: [Vec3; 3],
    /// Texture name.
    pub texture: String,
    /// How the texture lies on the face.
    pub projection: Projection,
}

/// A convex solid: what is behind all of its faces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Brush {
    /// At least four faces.
    pub faces: Vec<BrushFace>,
}

/// The outward normals of a box's faces, in the order in which per-face textures are given:
/// -X, +X, -Y, +Y, -Z, +Z.
const BOX_NORMALS: [Vec3; 6] = [
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, 1.0],
];

impl Brush {
    /// A box with one texture for each face, in the order -X, +X, -Y, +Y, -Z, +Z.
    #[must_use]
    pub fn cuboid(mins: Vec3, maxs: Vec3, textures: [&str; 6]) -> Self {
        let faces = BOX_NORMALS
            .iter()
            .zip(textures)
            .enumerate()
            .map(|(i, (normal, texture))| {
                let dist = if i % 2 == 0 {
                    -mins[i / 2]
                } else {
                    maxs[i / 2]
                };
                face_on(
                    &Plane {
                        normal: *normal,
                        dist,
                    },
                    texture,
                )
            });
        Self {
            faces: faces.collect(),
        }
    }

    /// The volume behind all of the planes (normals of length 1, pointing outward).
    #[must_use]
    pub fn from_planes(planes: &[(Plane, &str)]) -> Self {
        Self {
            faces: planes.iter().map(|(p, t)| face_on(p, t)).collect(),
        }
    }

    /// Is the point inside (not on the surface of) the brush?
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        self.faces
            .iter()
            .all(|f| Plane::from_points(&f.points).is_some_and(|plane| plane.distance(p) < 0.0))
    }
}

fn face_on(plane: &Plane, texture: &str) -> BrushFace {
    let w = Winding::on_plane(plane).0;
    // Short edges at a point of the plane near the origin keep the numbers exact for boxes.
    let shorten = |p: Vec3| {
        let d = sub(p, w[1]);
        add(w[1], [d[0] / 1024.0, d[1] / 1024.0, d[2] / 1024.0])
    };
    BrushFace {
        points: [shorten(w[0]), w[1], shorten(w[2])],
        texture: texture.to_owned(),
        projection: Projection::default(),
    }
}

/// An entity: keys with values, and brushes if it is a brush entity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Entity {
    /// In the order of the file.
    pub keys: Vec<(String, String)>,
    /// Empty for a point entity.
    pub brushes: Vec<Brush>,
}

impl Entity {
    /// An entity of a class.
    #[must_use]
    pub fn new(classname: &str) -> Self {
        Self {
            keys: vec![("classname".to_owned(), classname.to_owned())],
            brushes: Vec::new(),
        }
    }

    /// The value of a key (the last one, if the key is repeated).
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.keys
            .iter()
            .rev()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.as_str())
    }

    /// Sets a key.
    pub fn set(&mut self, key: &str, value: &str) -> &mut Self {
        match self.keys.iter_mut().rev().find(|(k, _)| k == key) {
            Some((_, v)) => value.clone_into(v),
            None => self.keys.push((key.to_owned(), value.to_owned())),
        }
        self
    }

    /// Three numbers of a key, missing ones 0; `None` without the key.
    #[must_use]
    pub fn vector(&self, key: &str) -> Option<Vec3> {
        let mut numbers = self
            .get(key)?
            .split_whitespace()
            .map(|n| n.parse().unwrap_or(0.0));
        Some(std::array::from_fn(|_| numbers.next().unwrap_or(0.0)))
    }

    pub(crate) fn classname(&self) -> &str {
        self.get("classname").unwrap_or("")
    }

    /// Do the brushes of this entity belong to the world's model?
    pub(crate) fn is_world(&self) -> bool {
        matches!(
            self.classname(),
            "worldspawn" | "func_group" | "func_detail"
        )
    }
}

/// A whole map, and the builder of one. The first entity is `worldspawn`.
///
/// ```
/// let mut map = mapc::Map::new();
/// map.texture(mapc::Texture::solid("wall", 16, 16, 8))
///     .room([0.0; 3], [256.0, 256.0, 128.0], 16.0, "wall")
///     .entity("info_player_start", &[("origin", "128 128 32")]);
/// let out = mapc::compile(&map, &mapc::Options::default()).unwrap();
/// assert_eq!(out.bytes[..4], 29i32.to_le_bytes());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The first is `worldspawn`.
    pub entities: Vec<Entity>,
    /// Textures with pixels; a name used without one is written as missing.
    pub textures: Vec<Texture>,
}

impl Default for Map {
    fn default() -> Self {
        Self::new()
    }
}

impl Map {
    /// An empty world.
    #[must_use]
    pub fn new() -> Self {
        Self {
            entities: vec![Entity::new("worldspawn")],
            textures: Vec::new(),
        }
    }

    /// Adds a texture; a later one of the same name replaces the earlier.
    pub fn texture(&mut self, texture: Texture) -> &mut Self {
        self.textures
            .retain(|t| !t.name.eq_ignore_ascii_case(&texture.name));
        self.textures.push(texture);
        self
    }

    /// Sets a worldspawn key.
    pub fn world_key(&mut self, key: &str, value: &str) -> &mut Self {
        self.world().set(key, value);
        self
    }

    /// Adds a brush to the world.
    pub fn brush(&mut self, brush: Brush) -> &mut Self {
        self.world().brushes.push(brush);
        self
    }

    /// Adds a box to the world.
    pub fn brush_box(&mut self, mins: Vec3, maxs: Vec3, texture: &str) -> &mut Self {
        self.brush(Brush::cuboid(mins, maxs, [texture; 6]))
    }

    /// Adds six walls around an inner space, all of one texture.
    pub fn room(&mut self, mins: Vec3, maxs: Vec3, thickness: f64, texture: &str) -> &mut Self {
        self.room_faces(mins, maxs, thickness, [texture; 6])
    }

    /// Adds six walls around an inner space, with the texture of the wall at the inner space's
    /// -X, +X, -Y, +Y, -Z (floor), +Z (ceiling) end.
    pub fn room_faces(
        &mut self,
        mins: Vec3,
        maxs: Vec3,
        thickness: f64,
        textures: [&str; 6],
    ) -> &mut Self {
        for (i, texture) in textures.into_iter().enumerate() {
            let (axis, high) = (i / 2, i % 2 == 1);
            let (mut lo, mut hi) = (mins, maxs);
            // Walls of later axes lie between those of earlier ones: no two overlap.
            for k in axis + 1..3 {
                lo[k] = mins[k] - thickness;
                hi[k] = maxs[k] + thickness;
            }
            if high {
                lo[axis] = maxs[axis];
                hi[axis] = maxs[axis] + thickness;
            } else {
                lo[axis] = mins[axis] - thickness;
                hi[axis] = mins[axis];
            }
            self.brush_box(lo, hi, texture);
        }
        self
    }

    /// Adds a point entity.
    pub fn entity(&mut self, classname: &str, keys: &[(&str, &str)]) -> &mut Self {
        self.brush_entity(classname, keys, Vec::new())
    }

    /// Adds a brush entity; its `model` key is set by the compiler.
    pub fn brush_entity(
        &mut self,
        classname: &str,
        keys: &[(&str, &str)],
        brushes: Vec<Brush>,
    ) -> &mut Self {
        let mut entity = Entity::new(classname);
        for (k, v) in keys {
            entity.set(k, v);
        }
        entity.brushes = brushes;
        self.entities.push(entity);
        self
    }

    fn world(&mut self) -> &mut Entity {
        if self.entities.is_empty() {
            self.entities.push(Entity::new("worldspawn"));
        }
        &mut self.entities[0]
    }
}
