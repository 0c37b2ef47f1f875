//! Quake's files into a [`Scene`]: the one place that knows both vocabularies.
//!
//! What the pictures rely on:
//! - The mesh of each brush model is watertight where the level is: vertices within
//!   [`weld::WELD_DISTANCE`] are one, every vertex within [`tjunction::ON_EDGE_DISTANCE`] of an edge
//!   is part of that edge, and triangulation keeps the border of each face.
//! - Brush entities often lie in one plane with faces of the world, and the entity wins: it is
//!   scaled about the centre of its bounds so that each half extent grows by [`ENTITY_GROWTH`]. Of
//!   several entities that fill the same box the last wins, and the others shine through nowhere.
//! - Liquid surfaces come in pairs that look both ways; one two-sided surface of each pair is kept.
//! - Nothing is left out because it can't be seen from somewhere.
//! - A lamp that is there as a model and as a light entity is one lamp: the camera alone sees the model.

mod appearance;
mod baked;
mod cameras;
mod cast;
mod cells;
mod emitters;
mod fog;
mod geometry;
mod inhabitants;
mod lights;
mod liquid;
mod models;
mod names;
mod notes;
mod picture;
mod poses;
mod replaced;
mod rest;
pub mod rules;
mod seal;
mod sky;
mod suns;
mod surfaces;
mod targets;
pub mod tjunction;
mod translucent;
mod trees;
pub mod triangulate;
pub mod weld;
mod world;

pub use cast::{Cast, CastList, CastModel, import_cast};
pub use emitters::{LAMP_REACH, LAMP_SHARE};
pub use fog::{FogKeys, MAX_FOG_DENSITY, SKY_FOG};
pub use lights::{
    CLEARANCE, CompilerLights, IRRADIANCE_PER_VALUE, LIGHT_RADIUS, LeastLight, MIN_LIGHT_RADIUS,
    SUN_SAMPLES, WorldKeys, color_of, least_color,
};
pub use sky::{MAX_SKY_SCALE, SKY_SCALE};
pub use suns::{DOME_RADIANCE, SUN_RADIUS_DEG};
pub use surfaces::{LAVA_GLOW, SLIME_GLOW, TELEPORTER_GLOW};
pub use translucent::{
    CLEARNESS, GLASS_IOR, LAVA_DEPTH, LIQUID_IOR, SLIME_DEPTH, TELEPORTER_DEPTH, WATER_DEPTH,
};
pub use world::ENTITY_GROWTH;

use crate::Scene;
use bsp::Level;
use bsp::lmp::Palette;

/// Which of a level's lamps shine. The same lamp is often there twice: as a bright texture, and as
/// a light entity beside it for the light compiler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightMode {
    /// Surfaces and light entities, without those entities that stand for a bright surface beside
    /// them; see [`LAMP_REACH`].
    #[default]
    Auto,
    /// Surfaces alone: fullbright texels, glowing liquids, the picture of the sky.
    Textures,
    /// Light entities alone. The sky and its suns stay, they are no lamps.
    Entities,
    /// Everything, lamps that are there twice included.
    All,
}

/// What lights a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Lighting {
    /// Light that obeys physics: what emits, the sky, light entities as small spheres.
    #[default]
    Physical,
    /// Light entities and suns by the formulas of the light compilers, and nothing else: meant for
    /// direct light. Fullbright texels and unlit liquids show as in Quake.
    Compiler,
    /// The level's own lightmaps: every surface emits its texture times [`crate::BakedLight`].
    Lightmap,
    /// No light: every surface emits its texture.
    Fullbright,
}

impl Lighting {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Physical,
        Self::Compiler,
        Self::Lightmap,
        Self::Fullbright,
    ];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Physical => "physical",
            Self::Compiler => "compiler",
            Self::Lightmap => "lightmap",
            Self::Fullbright => "fullbright",
        }
    }

    /// The deepest path vertex that means something: 2 for direct light alone, 1 for what surfaces
    /// show by themselves, `None` without limit.
    #[must_use]
    pub fn max_depth(self) -> Option<u32> {
        match self {
            Self::Physical => None,
            Self::Compiler => Some(2),
            Self::Lightmap | Self::Fullbright => Some(1),
        }
    }
}

/// How to read a level.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// Level time in seconds: frames of animated textures, light styles.
    pub time: f32,
    /// Fullbright texels of at least this relative luminance (0 to 1) emit.
    pub threshold: f32,
    /// Radiance of a white fullbright texel. 1 shows it as in Quake; about 2 to 8 lights a room
    /// like a lamp would.
    pub emission_scale: f32,
    /// What lights the level.
    pub lighting: Lighting,
    /// Which lamps shine in [`Lighting::Physical`].
    pub lights: LightMode,
    /// Whether lists of lights by leaf are made ([`Scene::cells`]): a tenth of a second in large
    /// levels, and wanted only by `Selection::Leaf`.
    pub light_lists: bool,
    /// Brightness of light styles, whatever the level or a demo says: number and brightness, of which 1
    /// shows lightmaps as stored. Of several for one style the last counts.
    pub style_brightness: Vec<(u16, f32)>,
    /// Whether the light of each light style is told apart ([`Scene::styles`]): lights that are dark
    /// at this moment are there, too.
    pub styles_apart: bool,
    /// Whether frames are shown of the scene ([`Scene::for_frames`]): what emits is listed on the world
    /// and on each model by itself, and lights lack the brightness of their styles.
    pub frames: bool,
    /// Whether the gates of finished episodes are shown (`func_episodegate`).
    pub show_episode_gates: bool,
    /// Whether the gate to the last boss is shown (`func_bossgate`).
    pub show_boss_gate: bool,
    /// Skill of the single-player game whose entities appear: 0 easy, 1 normal, 2 hard, 3 nightmare.
    pub skill: u32,
    /// Whether it is a game of deathmatch instead.
    pub deathmatch: bool,
    /// Whether point entities show their models, sprites and item boxes.
    pub inhabitants: bool,
    /// What materials a person wants.
    pub materials: rules::Rules,
    /// Whether pictures in `textures/` replace those of the level.
    pub replacements: bool,
    /// Whether MD3 and MD5 models stand for the alias models they are beside, in [`Lighting::Physical`].
    pub model_replacements: bool,
    /// Whether facets of alias models are shaded as round ([`crate::Mesh::make_smooth`]), in [`Lighting::Physical`].
    pub smooth_models: bool,
    /// Fog in place of the level's, in [`Lighting::Physical`]; `None` is the level's.
    pub fog: Option<FogKeys>,
    /// Share of the sky that is fogged, 0 to 1, in place of the level's.
    pub sky_fog: Option<f32>,
    /// Name of the skybox in place of what the level asks for; an empty one is the sky of the level's texture.
    pub skybox: Option<String>,
    /// Limits for files that the import reads itself.
    pub limits: bsp::Limits,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            time: 0.0,
            threshold: 0.5,
            emission_scale: 4.0,
            lighting: Lighting::Physical,
            lights: LightMode::Auto,
            light_lists: true,
            style_brightness: Vec::new(),
            styles_apart: false,
            frames: false,
            show_episode_gates: false,
            show_boss_gate: true,
            skill: 1,
            deathmatch: false,
            inhabitants: true,
            materials: rules::Rules::default(),
            replacements: true,
            model_replacements: true,
            smooth_models: true,
            fog: None,
            sky_fog: None,
            skybox: None,
            limits: bsp::Limits::default(),
        }
    }
}

/// Why a level can't become a scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// Every face is a tool's, invisible, or without area.
    #[error("{0}: the level has no face that can be drawn")]
    NothingToDraw(String),
}

/// What the light compilers light a level with, at whatever time; `sun_samples` is [`SUN_SAMPLES`]
/// unless the compiler was told otherwise. Also remarks on what of it is odd.
#[must_use]
pub fn compiler_lights(level: &Level, sun_samples: u32) -> (CompilerLights, Vec<String>) {
    let mut notes = notes::Notes::default();
    let is_shallow = trees::are_shallow(&level.bsp);
    let lights = lights::compiler_lights(level, is_shallow, sun_samples, &mut notes);
    (lights, notes.into_sentences())
}

/// Files beside a level: from a game path such as `maps/b_bh25.bsp` to bytes, `None` if there is no
/// such file. Asked often for what is not there: each texture has many names for pictures of its own.
pub type Files<'a> = dyn Fn(&str) -> Option<Vec<u8>> + 'a;

/// Turns a level into a scene. `palette` is the game's; `files` gives models, sprites
/// and pictures, and may give nothing.
///
/// # Errors
/// [`ImportError::NothingToDraw`] if no triangle comes out. Everything else that is odd is a
/// sentence in the scene's report.
pub fn import(
    level: &Level,
    palette: &Palette,
    files: &Files<'_>,
    options: &ImportOptions,
) -> Result<Scene, ImportError> {
    world::World::new(level, palette, files, options).build()
}
