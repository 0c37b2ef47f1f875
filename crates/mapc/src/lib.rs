//! A small map compiler: convex brushes in, a valid Quake level (BSP version 29) out.
//!
//! [`Map`] is built in code or parsed from the text of a `.map` file ([`parse_map`]);
//! [`compile`] turns it into the bytes of a file. The same map gives the same bytes.
//!
//! What it does, in order:
//! 1. Brushes become polygons; overlapping brushes are settled by contents (solid beats sky beats
//!    lava, slime, water), equal ones by order: the later brush gives the texture.
//! 2. A BSP tree splits space by the sides of all brushes; portals are found between its leafs.
//! 3. Space is flooded from the point entities. A way to the outside is a leak; otherwise all
//!    that was not reached becomes solid, so the outside of the map has no faces.
//! 4. Faces are the portals between leafs of different contents, seen from the open side. Liquid
//!    surfaces are seen from both. They are merged, split for classic engines' lightmaps, welded,
//!    and T-junctions are closed by shared vertices.
//! 5. Visibility by portal flow through air and liquids (brushes of `func_detail` entities are
//!    part of the world but hide nothing: put decoration there); clip hulls 1 and 2 from brushes grown by
//!    the hull's box.
//!
//! There is no lightmap: the lighting lump is empty, and engines show the level fully lit.
//!
//! Beside levels it writes alias models ([`Model`]) and sprites ([`Sprite`]), and demos that play in such
//! levels ([`demo`]).

mod compile;
pub mod demo;
mod face;
mod map;
mod math;
mod model;
mod parse;
mod portal;
pub mod sample;
mod sprite;
mod texture;
mod tree;
mod vis;
mod winding;
mod write;

pub use map::{Brush, BrushFace, Entity, Map, Projection};
pub use math::{Bounds, Plane, Vec3};
pub use model::{Model, ModelFrame, ModelPose, ModelSkin, ModelSkinVertex};
pub use parse::parse_map;
pub use sprite::{Sprite, SpriteFrame, SpritePicture};
pub use texture::{Contents, Texture};

/// Why a map could not be compiled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// The text of the map is wrong.
    #[error("line {line}: {problem}")]
    Parse {
        /// From 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// A brush has no volume.
    #[error("entity {entity}, brush {brush}: {problem}")]
    Brush {
        /// Index of the entity.
        entity: usize,
        /// Index of the brush in its entity.
        brush: usize,
        /// What is wrong.
        problem: String,
    },
    /// A texture cannot be written.
    #[error("texture {name:?}: {problem}")]
    Texture {
        /// Its name.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// The world, or a brush entity, has no brush that is drawn.
    #[error("entity {entity} has no brush that is drawn")]
    NoBrushes {
        /// Index of the entity.
        entity: usize,
    },
    /// The outside can be reached from an entity.
    #[error("the map leaks: entity {entity} ({classname}) at {origin:?} reaches the outside")]
    Leak {
        /// Index of the entity.
        entity: usize,
        /// Its class.
        classname: String,
        /// Where it is.
        origin: Vec3,
    },
    /// A model has no open space at all.
    #[error("a model is solid everywhere")]
    NoSpace,
    /// More than the 16-bit fields of the format can count.
    #[error("{count} {what} are more than the file format can hold")]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
}

/// How to compile.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// A leak is a warning and the outside stays open, instead of an error.
    pub allow_leaks: bool,
    /// Largest extent of a face along each texture axis, in texels; larger faces are split.
    /// Classic engines refuse faces beyond 256. `None` leaves faces whole.
    pub subdivide: Option<f64>,
    /// Find what can be seen from where. Without, the visibility lump is empty, which means that
    /// everything is visible.
    pub vis: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            allow_leaks: false,
            subdivide: Some(240.0),
            vis: true,
        }
    }
}

/// A compiled map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// The file.
    pub bytes: Vec<u8>,
    /// Things that are probably not as meant, in plain words.
    pub warnings: Vec<String>,
}

/// Compiles a map to a BSP file of version 29.
///
/// # Errors
/// See [`CompileError`]; nothing is written by halves.
pub fn compile(map: &Map, options: &Options) -> Result<Output, CompileError> {
    let compiled = compile::compile(map, options)?;
    let mut warnings = compiled.warnings.clone();
    let mut missing: Vec<&str> = Vec::new();
    for t in &compiled.texinfos {
        let known = map
            .textures
            .iter()
            .any(|x| x.name.eq_ignore_ascii_case(&t.texture));
        if !known && !missing.contains(&t.texture.as_str()) {
            missing.push(&t.texture);
        }
    }
    for name in missing {
        warnings.push(format!(
            "texture {name:?} has no pixels: written as missing"
        ));
    }
    Ok(Output {
        bytes: write::write(&compiled, &map.textures)?,
        warnings,
    })
}
