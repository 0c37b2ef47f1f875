//! A level and all models that a demo names, ready to be shown in frames.

use super::fog::FogKeys;
use super::models::Loaded;
use super::replaced::Skins;
use super::surfaces::{Look, Surfaces};
use super::world::{ENTITY_GROWTH, World, bounds, growth};
use super::{Files, ImportError, ImportOptions, Lighting};
use crate::Scene;
use crate::alias::{self, AliasModel};
use crate::material::{Material, MaterialId, Texture};
use crate::mesh::{Instance, Mesh, SeenBy};
use crate::sprite::SpriteModel;
use bsp::Level;
use bsp::lmp::Palette;
use bsp::mdl::Mdl;
use glam::Affine3A;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Colours of the palette along each side of the picture that particles show.
const PALETTE_SIDE: u32 = 16;

/// The models of a demo as meshes of a scene.
#[derive(Clone, Debug)]
pub struct Cast {
    /// By name as the demo has it. Models that are not there, or can't be read, are not among them.
    pub models: HashMap<String, CastModel>,
    /// Models that are there in part only, by name and coverage in 255ths.
    pub faded: HashMap<(String, u8), CastModel>,
    /// Shows the palette, and shines: index `i` with the texture coordinates of [`Cast::palette_uv`].
    pub palette: MaterialId,
    /// The fog that the level has of its own.
    pub fog: FogKeys,
    /// Materials of players' skins by model, skin, and the rows of shirt and trousers.
    coloured: HashMap<(String, usize, [u8; 2]), MaterialId>,
}

/// A model of a demo.
#[derive(Clone, Debug)]
pub enum CastModel {
    /// The level itself: the first instance of every frame.
    Level,
    /// A brush model. It is placed by its entity's transform times `within`.
    Brush {
        /// Meshes with the usual frames of animated textures, and with the alternate ones.
        meshes: [usize; 2],
        /// Makes it win over coplanar faces of the level.
        within: Affine3A,
    },
    /// An alias model; its mesh is in the scene.
    Alias {
        /// Index into `Scene::meshes`.
        mesh: usize,
        /// Frames and skins; its own mesh has only poses' numbers left to say.
        model: Box<AliasModel>,
        /// The other surfaces of a model that stands for an alias model: meshes, frames and skins.
        others: Vec<(usize, AliasModel)>,
        /// What its light is given by.
        seen_by: SeenBy,
    },
    /// A sprite, which the camera alone sees.
    Sprite {
        /// For each of its quads the index into `Scene::meshes`; `None` where nothing is to be seen.
        meshes: Vec<Option<usize>>,
        /// Frames.
        model: Box<SpriteModel>,
    },
}

impl CastModel {
    /// The meshes of an alias model, with their frames and skins.
    pub fn surfaces(&self) -> impl Iterator<Item = (usize, &AliasModel)> {
        let (first, others) = match self {
            Self::Alias {
                mesh,
                model,
                others,
                ..
            } => (Some((*mesh, &**model)), others.as_slice()),
            _ => (None, &[][..]),
        };
        let others = others.iter().map(|(mesh, model)| (*mesh, model));
        first.into_iter().chain(others)
    }
}

impl Cast {
    /// Texture coordinates of a palette index in [`Cast::palette`].
    #[must_use]
    pub fn palette_uv(index: u8) -> [f32; 2] {
        let (x, y) = (
            u32::from(index) % PALETTE_SIDE,
            u32::from(index) / PALETTE_SIDE,
        );
        [x as f32 + 0.5, y as f32 + 0.5]
    }

    /// The material of a player's model in rows `shirt` and `trousers` of the palette, if those were asked
    /// for.
    #[must_use]
    pub fn coloured(&self, model: &str, skin: usize, colours: [u8; 2]) -> Option<MaterialId> {
        self.coloured
            .get(&(model.to_owned(), skin, colours))
            .copied()
    }
}

/// Whose models an import is to bring along.
#[derive(Clone, Copy, Debug, Default)]
pub struct CastList<'a> {
    /// Names as a demo has them: `maps/e1m1.bsp`, `*3`, `progs/soldier.mdl`.
    pub models: &'a [String],
    /// Rows of the palette (0 to 15) that players wear as shirt and trousers.
    pub colours: &'a [[u8; 2]],
    /// Models that appear in part only, with their coverage in 255ths.
    pub faded: &'a [(String, u8)],
    /// Whether the fog changes; not where options ask for one.
    pub fog: bool,
}

/// Turns a level into a scene that frames are shown of: the world alone is placed, and the models asked for
/// are meshes that frames may place. The first model that is a level's file stands for `level`.
///
/// # Errors
/// As [`super::import`].
pub fn import_cast(
    level: &Level,
    palette: &Palette,
    files: &Files<'_>,
    options: &ImportOptions,
    list: CastList<'_>,
) -> Result<(Scene, Cast), ImportError> {
    let options = ImportOptions {
        frames: true,
        inhabitants: false,
        ..options.clone()
    };
    World::new(level, palette, files, &options).build_cast(list)
}

impl World<'_> {
    fn build_cast(mut self, list: CastList<'_>) -> Result<(Scene, Cast), ImportError> {
        let level = self.level;
        let mut surfaces = Surfaces::new(&level.bsp, &level.animation, self.palette, self.beside());
        self.world_mesh(&mut surfaces);
        // Where the level has its brush models decides which lamps are there twice; frames place them.
        self.is_stage = true;
        let is_physical = self.options.lighting == Lighting::Physical;
        self.changes_fog = list.fog && is_physical && self.options.fog.is_none();
        self.brush_entities(&mut surfaces);
        let mut cast = Cast {
            models: HashMap::new(),
            faded: HashMap::new(),
            palette: self.palette_material(),
            fog: self.level_fog,
            coloured: HashMap::new(),
        };
        let mut has_level = false;
        for name in list.models {
            if name.is_empty() || cast.models.contains_key(name) {
                continue;
            }
            let is_level = !has_level && name.starts_with("maps/") && !name.starts_with("maps/b_");
            let model = if is_level {
                has_level = true;
                Some(CastModel::Level)
            } else {
                self.cast_model(&mut surfaces, name, None, list.colours, &mut cast)
            };
            if let Some(model) = model {
                cast.models.insert(name.clone(), model);
            }
        }
        for (name, coverage) in list.faded {
            let alpha = Some(f32::from(*coverage) / 255.0);
            let model = self.cast_model(&mut surfaces, name, alpha, &[], &mut cast);
            if let Some(model) = model {
                cast.faded.insert((name.clone(), *coverage), model);
            }
        }
        self.tell_of_missing();
        Ok((self.finish()?, cast))
    }

    fn cast_model(
        &mut self,
        surfaces: &mut Surfaces<'_>,
        name: &str,
        alpha: Option<f32>,
        colours: &[[u8; 2]],
        cast: &mut Cast,
    ) -> Option<CastModel> {
        match name.strip_prefix('*') {
            Some(number) => self.brush_model(surfaces, number.parse().ok()?, alpha),
            None => self.cast_file(name, alpha, colours, cast),
        }
    }

    fn brush_model(
        &mut self,
        surfaces: &mut Surfaces<'_>,
        number: usize,
        alpha: Option<f32>,
    ) -> Option<CastModel> {
        let bsp = &self.level.bsp;
        if number == 0 || number >= bsp.models.len() {
            return None;
        }
        let mut mesh = |world: &mut Self, alternate| {
            let look = Look {
                alternate,
                alpha,
                ..Look::default()
            };
            world.brush_mesh(surfaces, number, look)
        };
        let time = f64::from(self.options.time);
        let differs = (bsp.drawable_faces(number))
            .filter_map(|(_, face)| bsp.face_texture(face))
            .any(|t| {
                let [usual, other] = [false, true]
                    .map(|alternate| self.level.animation.frame_at(t, time, alternate));
                usual != other
            });
        let first = mesh(self, false)?;
        let second = differs.then(|| mesh(self, true)).flatten();
        Some(CastModel::Brush {
            meshes: [first, second.unwrap_or(first)],
            within: growth(bounds(bsp, number), ENTITY_GROWTH),
        })
    }

    fn cast_file(
        &mut self,
        name: &str,
        alpha: Option<f32>,
        colours: &[[u8; 2]],
        cast: &mut Cast,
    ) -> Option<CastModel> {
        match &*self.loaded(name)? {
            Loaded::Brush(mesh, within) => Some(CastModel::Brush {
                meshes: [*mesh; 2],
                within: *within,
            }),
            Loaded::Alias(parts) => {
                let mut surfaces = Vec::with_capacity(parts.len());
                for part in parts {
                    let mut model = (part.model).painted(|skin, picture| {
                        self.paint_part(name, part, [skin, picture], alpha)
                    });
                    if let Skins::Own(file) = &part.skins
                        && alias::stem(name) == "player"
                    {
                        self.colour_skins(name, file, colours, cast, &mut model.mesh);
                    }
                    let mesh = std::mem::take(&mut model.mesh);
                    surfaces.extend(self.add_moving(mesh).map(|mesh| (mesh, model)));
                }
                let mut surfaces = surfaces.into_iter();
                let (mesh, model) = surfaces.next()?;
                // The light of flames is that of light entities, and of bolts that of the frame's.
                let seen_by = match alias::is_luminous(name) {
                    true => SeenBy::CAMERA,
                    false => SeenBy::ALL,
                };
                Some(CastModel::Alias {
                    mesh,
                    model: Box::new(model),
                    others: surfaces.collect(),
                    seen_by,
                })
            }
            Loaded::Sprite(both) => {
                let mut model = SpriteModel::new(name, &both.0, |number, picture| {
                    self.paint_sprite(name, number, picture, alpha)
                });
                let quads = std::mem::take(&mut model.quads);
                let meshes = quads
                    .into_iter()
                    .map(|quad| self.add_moving(quad))
                    .collect();
                Some(CastModel::Sprite {
                    meshes,
                    model: Box::new(model),
                })
            }
        }
    }

    fn colour_skins(
        &mut self,
        name: &str,
        file: &Mdl,
        colours: &[[u8; 2]],
        cast: &mut Cast,
        mesh: &mut Mesh,
    ) {
        for (skin, pictures) in file.skins.iter().enumerate() {
            for &[shirt, trousers] in colours {
                let key = (name.to_owned(), skin, [shirt, trousers]);
                let Some(pixels) = pictures.pictures.first() else {
                    continue;
                };
                if let Entry::Vacant(place) = cast.coloured.entry(key) {
                    let pixels = alias::recoloured(pixels, shirt, trousers);
                    let material = self.paint_skin(name, file, [skin, 0], &pixels, None);
                    mesh.skins.push(material);
                    place.insert(material);
                }
            }
        }
    }

    fn add_moving(&mut self, mesh: Mesh) -> Option<usize> {
        let file = self.baked.as_mut().map_or(0, |b| b.add_evenly([1.0; 3]));
        self.add_model_mesh(mesh, file)
    }

    /// What particles are made of: a picture of the palette that shows its colours as they are.
    fn palette_material(&mut self) -> MaterialId {
        let picture = |name: &str, texel: &dyn Fn(u8) -> [u8; 3]| Texture {
            name: name.to_owned(),
            width: PALETTE_SIDE,
            height: PALETTE_SIDE,
            rgba: (0..=255)
                .map(|i| {
                    let [r, g, b] = texel(i);
                    [r, g, b, 255]
                })
                .collect(),
        };
        let palette = self.palette;
        let base = self.set.add_texture(picture("particles", &|_| [0; 3]));
        let emission = picture("particles emission", &|i| palette.rgb(i));
        let emission = self.set.add_texture(emission);
        let material = Material {
            emission: Some(emission),
            emission_scale: 1.0,
            two_sided: true,
            ..Material::new("particles", base)
        };
        self.set.add(material, false)
    }

    /// The mesh of the world, and the instance that places it.
    pub(super) fn world_mesh(&mut self, surfaces: &mut Surfaces<'_>) {
        let bsp = &self.level.bsp;
        let world = self.model_mesh(surfaces, bsp, 0, Look::default());
        self.report.open_edges = world.open_edges.len();
        self.seal(&world);
        let file = self.lightmaps(bsp, &self.level.light);
        self.add_mesh("world", world, file);
        self.instances
            .push(Instance::new(0, Affine3A::IDENTITY, "worldspawn"));
    }
}
