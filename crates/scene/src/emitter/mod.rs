//! What emits, in parts small enough to be chosen, and the choice among them.

mod alias;
mod bounds;
mod list;
mod map;
mod moving;
pub mod tree;

pub(crate) use alias::alias_table;
pub use bounds::{LightBounds, Shine};
pub use map::{EmissionMap, Rectangle};
pub use moving::{MovingEmitters, MovingLight, MovingLights};
pub use tree::LightTree;

use crate::light::PointLight;
use crate::material::{Material, MaterialId, Texture};
use crate::mesh::{Instance, Mesh};
use crate::sky::Sun;
use glam::Vec3;

/// One thing that can be chosen as a light: emitting texels of a face, or a part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// First of the [`Emitters::sources`] it lies on.
    pub first_source: u32,
    /// How many it may lie on: neighbouring triangles of one face.
    pub sources: u32,
    /// Which points of them.
    pub shape: Shape,
    /// Its material.
    pub material: MaterialId,
    /// Luminance of the radiance it emits, integrated over its area (both sides if both shine): its
    /// power divided by pi.
    pub weight: f32,
    /// Points at its border, world space.
    pub corners: [Vec3; 4],
    /// Unit normal to the front, world space.
    pub normal: Vec3,
    /// Whether both sides shine.
    pub two_sided: bool,
}

impl Emitter {
    /// Smallest and largest corner of its bounds, world space.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        let [a, b, c, d] = self.corners;
        [a.min(b).min(c).min(d), a.max(b).max(c).max(d)]
    }
}

/// Which points an [`Emitter`] has, and how one is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Texels of a rectangle of the texture, in one of its repetitions over the face: a texel in
    /// proportion to its part ([`EmissionMap::sums`]), then a uniform point in it. Points that lie
    /// on none of the sources are no light.
    Texels {
        /// Number of the map in [`Emitters::maps`].
        map: u32,
        /// Texels that may be chosen.
        rectangle: Rectangle,
        /// Which repetition: texture coordinates are `tile * size` more.
        tile: [i32; 2],
    },
    /// A uniform point of one of `divisions^2` equal parts of the only source: part `column`, `row`
    /// of the parallelogram that the triangle is half of, and its upper half if `upper`. The point
    /// with barycentric weights `b1`, `b2` of the second and third corner lies in column
    /// `floor(b1 * divisions)`, row `floor(b2 * divisions)`, and in the upper half if what is left
    /// of both adds up to more than 1.
    Part {
        /// Parts along each side of the triangle.
        divisions: u32,
        /// Along the first side.
        column: u32,
        /// Along the second side.
        row: u32,
        /// The half with the far corner.
        upper: bool,
    },
}

/// A triangle that emits, and how to find the emitter at a point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Index into `Scene::instances`.
    pub instance: u32,
    /// Index into the triangles of that instance's mesh.
    pub triangle: u32,
    /// How its emitters are numbered.
    pub numbering: Numbering,
}

/// How the emitters on a [`Source`] are numbered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Numbering {
    /// [`Shape::Texels`]. The point with texture coordinates `uv` lies in tile `floor(uv / size)`, on a
    /// texel with a label `l`; its emitter is
    /// `Emitters::numbers[table + ((tile.y - first_tile.y) * tiles.x + tile.x - first_tile.x) *
    /// rectangles + l - 1]`.
    Texels {
        /// Number of the map in [`Emitters::maps`].
        map: u32,
        /// First tile along each axis.
        first_tile: [i32; 2],
        /// Tiles along each axis.
        tiles: [u32; 2],
        /// Where the numbers begin.
        table: u32,
    },
    /// [`Shape::Part`]. Parts are counted row by row: a row of `n` columns has `2 n - 1` parts, and
    /// the upper half follows the lower one.
    Parts {
        /// Parts along each side.
        divisions: u32,
        /// Number of the first emitter.
        first: u32,
    },
}

/// In [`Emitters::numbers`]: no emitter there.
pub const NO_EMITTER: u32 = u32::MAX;

/// Everything that can be chosen as a light, with one alias table over the estimated powers and a tree
/// by place.
///
/// The table's entries are the emitters, then the point lights of the scene, then its suns. An entry is chosen with
/// probability `weight / total_weight`.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    /// The emitters.
    pub list: Vec<Emitter>,
    /// The triangles they lie on, in order of instances and triangles.
    pub sources: Vec<Source>,
    /// Emitters by place; see [`Numbering::Texels`].
    pub numbers: Vec<u32>,
    /// Textures that were taken apart.
    pub maps: Vec<EmissionMap>,
    /// Per entry the probability to keep it, and the entry to take otherwise. Emitters first, then
    /// `Scene::lights`, then `Sky::suns`.
    pub alias: Vec<(f32, u32)>,
    /// Sum of all weights; 0 if nothing emits.
    pub total_weight: f32,
    /// Tree over the entries.
    pub tree: LightTree,
    /// Where each entry is and how it shines.
    pub bounds: Vec<LightBounds>,
}

impl Emitters {
    /// Lists what emits on placed meshes. The choice is made by [`Self::with_lights`].
    #[must_use]
    pub fn new(
        meshes: &[Mesh],
        instances: &[Instance],
        materials: &[Material],
        textures: &[Texture],
    ) -> Self {
        list::list(meshes, instances, materials, textures)
    }

    /// Builds the alias table, the tree and the bounds over the emitters, `lights` and `suns`.
    #[must_use]
    pub fn with_lights(mut self, lights: &[PointLight], suns: &[Sun]) -> Self {
        self.bounds = (self.list.iter().map(LightBounds::from))
            .chain(lights.iter().map(LightBounds::from))
            .chain(suns.iter().map(LightBounds::from))
            .collect();
        let weights: Vec<f64> = self.bounds.iter().map(|b| b.power.into()).collect();
        let total: f64 = weights.iter().sum();
        self.alias = alias_table(&weights, total);
        self.total_weight = total as f32;
        self.tree = LightTree::new(&self.list, lights, suns);
        self
    }

    /// Numbers of the sources by triangle: for each triangle of each instance, in order, the index
    /// into [`Self::sources`], or [`NO_EMITTER`]; and where each instance's begin.
    #[must_use]
    pub fn sources_by_triangle(
        &self,
        meshes: &[Mesh],
        instances: &[Instance],
    ) -> (Vec<u32>, Vec<u32>) {
        let mut starts = Vec::with_capacity(instances.len());
        let mut count = 0;
        for instance in instances {
            starts.push(count as u32);
            count += meshes[instance.mesh].triangles.len();
        }
        let mut by_triangle = vec![NO_EMITTER; count];
        for (number, source) in self.sources.iter().enumerate() {
            by_triangle[(starts[source.instance as usize] + source.triangle) as usize] =
                number as u32;
        }
        (by_triangle, starts)
    }
}
