//! Puts a scene together: meshes, instances, lights, cameras, report.

use super::appearance::{Beside, MAX_TEXELS};
use super::baked::Baked;
use super::emitters::Twice;
use super::fog::FogKeys;
use super::geometry::{self, FacePolygon, ModelMesh, TextureMapping};
use super::lights::{EntityLight, Moment};
use super::models::Models;
use super::names::NameKind;
use super::notes::Notes;
use super::poses::Pose;
use super::suns::SkyLight;
use super::surfaces::{FaceSurface, Look, LookKey, MaterialSet, Surfaces};
use super::translucent::{self, LiquidAlphas};
use super::{Files, ImportError, ImportOptions, LightMode, Lighting};
use super::{cameras, cells, emitters, fog, lights, poses, seal, sky, suns, trees};
use crate::emitter::{Emitter, Emitters, MovingEmitters};
use crate::light::PointLight;
use crate::material::{MaterialId, Surface, WARP_TILE};
use crate::mesh::{Instance, Mesh, SeenBy};
use crate::sky::{Sun, sky_triangles, weighed_suns};
use crate::{LampPair, LightCells, Media, Report, Scene};
use bsp::bsp::LightSamples;
use bsp::bsp::{Face, Texinfo};
use bsp::lmp::Palette;
use bsp::{Bsp, Level};
use glam::{Affine3A, DVec3, Vec3};
use std::cell::Cell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;

/// How far each face of a brush entity's bounds is moved outwards, in world units, so that it lies
/// before the world's faces that share its plane. Where several entities fill the same box each is
/// moved by this much more than the one before.
pub const ENTITY_GROWTH: f32 = 1.0 / 64.0;
/// So many entities in one box are told apart; what lies deeper is seen by nobody.
const MAX_IN_ONE_PLACE: u8 = 16;

/// Instances may place this many times the triangles of all meshes, and so many in any case.
const PLACED_PER_TRIANGLE: usize = 16;
const PLACED_ANYWAY: usize = 1 << 18;

/// Entities that grow by more than this factor are left as they are: flat ones have no inside to
/// scale from.
const MAX_GROWTH_FACTOR: f32 = 1.25;

/// An import under way.
pub struct World<'a> {
    pub(super) level: &'a Level,
    pub(super) palette: &'a Palette,
    pub(super) files: &'a Files<'a>,
    pub(super) options: &'a ImportOptions,
    pub(super) set: MaterialSet,
    /// Suns of the level, without their weights.
    suns: Vec<Sun>,
    pub(super) notes: Notes,
    pub(super) report: Report,
    pub(super) meshes: Vec<Mesh>,
    pub(super) instances: Vec<Instance>,
    /// Whether the level's trees can be asked often.
    pub(super) shallow: bool,
    /// Triangles placed by instances so far.
    placed: usize,
    /// Texels that pictures beside the level may still have.
    picture_room: Rc<Cell<u64>>,
    /// The lightmaps, if they light the scene.
    pub(super) baked: Option<Baked>,
    /// Models and sprites.
    pub(super) models: Models,
    /// For each mesh the number of its file among the lightmaps.
    pub(super) files_of_meshes: Vec<usize>,
    /// Meshes of the level's brush models, by model and texture frames shown.
    brush_meshes: BTreeMap<(usize, LookKey), Option<usize>>,
    /// Whether frames place all but the world itself.
    pub(super) is_stage: bool,
    /// The fog that the level has of its own.
    pub(super) level_fog: FogKeys,
    /// Frames may have other fog than the level.
    pub(super) changes_fog: bool,
}

impl<'a> World<'a> {
    /// Begins an import.
    pub fn new(
        level: &'a Level,
        palette: &'a Palette,
        files: &'a Files<'a>,
        options: &'a ImportOptions,
    ) -> Self {
        let mut notes = Notes::default();
        let sky_light = match options.lighting {
            Lighting::Physical => suns::sky_light(&level.entities, &mut notes),
            // The sky shows as in Quake, and compilers' suns are not seen.
            _ => SkyLight::default(),
        };
        let mut set = MaterialSet::new(sky_light.domes, LiquidAlphas::of(level.entities.first()));
        let mut level_fog = FogKeys::OFF;
        // Lightmaps and the textures know of no fog, and pictures of them are to be compared.
        if options.lighting == Lighting::Physical {
            let (keys, share) = fog::of_level(level.entities.first(), &mut notes);
            level_fog = options.fog.unwrap_or(keys);
            set.fog = level_fog.medium();
            set.clear_sky.share = options.sky_fog.unwrap_or(share);
        }
        let own =
            (level.entities.first()).and_then(|world| world.get_any(&["sky", "skyname", "qlsky"]));
        set.skybox = (options.skybox.as_deref().or(own))
            .filter(|name| !name.is_empty())
            .and_then(|name| sky::skybox(name, files, &options.limits, &mut notes));
        Self {
            level,
            palette,
            files,
            options,
            set,
            suns: sky_light.suns,
            notes,
            report: Report::default(),
            meshes: Vec::new(),
            instances: Vec::new(),
            shallow: trees::are_shallow(&level.bsp),
            placed: 0,
            picture_room: Rc::new(Cell::new(MAX_TEXELS)),
            baked: (options.lighting == Lighting::Lightmap).then(Baked::new),
            models: Models::default(),
            files_of_meshes: Vec::new(),
            brush_meshes: BTreeMap::new(),
            is_stage: false,
            level_fog,
            changes_fog: false,
        }
    }

    /// Does all of it.
    pub fn build(mut self) -> Result<Scene, ImportError> {
        let bsp = &self.level.bsp;
        let mut surfaces = Surfaces::new(bsp, &self.level.animation, self.palette, self.beside());
        self.world_mesh(&mut surfaces);
        let poses = self.brush_entities(&mut surfaces);
        if self.options.inhabitants {
            self.point_entities(&poses);
        }
        self.finish()
    }

    pub(super) fn beside(&self) -> Beside<'a> {
        Beside {
            files: self.files,
            map: &self.level.name,
            room: self.picture_room.clone(),
        }
    }

    /// The mesh of one brush model. Tool faces are left out and counted.
    pub(super) fn model_mesh(
        &mut self,
        surfaces: &mut Surfaces<'_>,
        bsp: &Bsp,
        model: usize,
        look: Look,
    ) -> ModelMesh {
        let mut polygons = Vec::new();
        for (index, face) in bsp.drawable_faces(model) {
            let surface = surfaces.get(
                bsp.face_texture(face),
                Look {
                    unlit: self.options.lighting == Lighting::Compiler
                        && bsp.face_texinfo(face).is_none_or(Texinfo::is_special),
                    ..look
                },
                &mut self.set,
                self.options,
                &mut self.notes,
            );
            if surface.kind == NameKind::Tool {
                self.report.faces_left_out += 1;
            } else if let Some(mut polygon) = polygon(bsp, index, face, &surface) {
                polygon.inward = polygon.liquid
                    && surface.translucent
                    && self.shallow
                    && translucent::looks_inwards(bsp, model, &polygon.points, polygon.normal);
                polygons.push(polygon);
            }
        }
        let built = geometry::build(polygons);
        self.report.faces += built.faces;
        self.report.t_junctions_split += built.inserted;
        if built.exhausted {
            self.notes.add("edges", || {
                format!(
                    "brush model {model} has so many vertices on edges that not all are split: \
                     light may leak"
                )
            });
        }
        built
    }

    /// Says whether the level is sealed, and if only a face is lacking, where.
    pub(super) fn seal(&mut self, world: &ModelMesh) {
        let bsp = &self.level.bsp;
        if !self.shallow {
            self.notes.add("deep tree", || {
                "the level's tree is looped or absurdly deep: it is not asked where solid is"
                    .to_owned()
            });
            return;
        }
        if !seal::outside_is_solid(bsp) {
            return;
        }
        let holes = seal::holes(bsp, &world.positions, &world.open_edges);
        self.report.sealed = holes.is_empty();
        self.report.holes = holes.len();
        if let Some(first) = holes.first() {
            self.notes.add("holes", || {
                format!(
                    "the level has solid without faces at {} edges, for example at {:.0} {:.0} \
                     {:.0}: rays can leave it there",
                    holes.len(),
                    first.x,
                    first.y,
                    first.z
                )
            });
        }
    }

    /// Places the brush entities; gives where they are.
    pub(super) fn brush_entities(&mut self, surfaces: &mut Surfaces<'_>) -> Vec<Pose<'a>> {
        let Level { bsp, entities, .. } = self.level;
        let (poses, hidden) = poses::poses(bsp, entities, self.options, &mut self.notes);
        for model in hidden {
            self.report.faces_left_out += bsp.drawable_faces(model).count();
        }
        let least_light = |pose: &Pose<'_>| match self.options.lighting {
            Lighting::Compiler => lights::least_of_model(self.level, pose.entity, self.options),
            _ => Vec3::ZERO,
        };
        let least: Vec<Vec3> = poses.iter().map(least_light).collect();
        let mut merged = HashSet::new();
        let mut places: HashMap<[i64; 6], u8> = HashMap::new();
        for (pose, least_light) in poses.iter().zip(least) {
            let bounds = bounds(bsp, pose.model);
            let taken = places.entry(place_key(bounds, pose.offset)).or_default();
            let growth = growth(bounds, ENTITY_GROWTH * f32::from(*taken + 1));
            *taken = (*taken + 1).min(MAX_IN_ONE_PLACE - 1);
            let look = Look {
                alternate: pose.alternate,
                alpha: pose.alpha,
                least_light,
                ..Look::default()
            };
            let seen_by = match self.options.lighting {
                Lighting::Compiler if !lights::casts_shadows(pose.entity) => SeenBy::CAMERA,
                _ => SeenBy::ALL,
            };
            // A second entity of the same model is an instance, so that a few bytes of entity text
            // can't make many triangles.
            let is_fixed = pose.fixed && !self.is_stage && seen_by == SeenBy::ALL;
            if is_fixed && merged.insert(pose.model) {
                let mut part = self.model_mesh(surfaces, bsp, pose.model, look);
                for p in &mut part.positions {
                    *p = growth.transform_point3(*p);
                }
                append(&mut self.meshes[0], part);
                continue;
            }
            if let Some(mesh) = self.brush_mesh(surfaces, pose.model, look) {
                let place = Affine3A::from_translation(pose.offset) * growth;
                self.place(Instance {
                    seen_by,
                    ..Instance::new(mesh, place, pose.classname)
                });
            }
        }
        poses
    }

    /// Number of the mesh of a brush model of the level, if it has something to draw.
    pub(super) fn brush_mesh(
        &mut self,
        surfaces: &mut Surfaces<'_>,
        model: usize,
        look: Look,
    ) -> Option<usize> {
        let key = (model, look.key());
        if let Some(&known) = self.brush_meshes.get(&key) {
            return known;
        }
        let part = self.model_mesh(surfaces, &self.level.bsp, model, look);
        let index =
            (!part.triangles.is_empty()).then(|| self.add_mesh(&format!("*{model}"), part, 0));
        self.brush_meshes.insert(key, index);
        index
    }

    /// Places a mesh, unless a few bytes of entity text have placed too many triangles already.
    pub(super) fn place(&mut self, instance: Instance) {
        let there: usize = self.meshes.iter().map(|m| m.triangles.len()).sum();
        self.placed += self.meshes[instance.mesh].triangles.len();
        if self.placed > PLACED_PER_TRIANGLE * there + PLACED_ANYWAY {
            self.notes.add("too many instances", || {
                "models are placed too often: the rest is left out".to_owned()
            });
            return;
        }
        self.instances.push(instance);
    }

    /// Adds a mesh out of the file with this number among the lightmaps.
    pub(super) fn add_mesh(&mut self, name: &str, part: ModelMesh, file: usize) -> usize {
        self.meshes.push(mesh(name, part));
        self.files_of_meshes.push(file);
        self.meshes.len() - 1
    }

    /// Adds a file's lightmaps, if lightmaps are wanted.
    pub(super) fn lightmaps(&mut self, bsp: &Bsp, samples: &LightSamples) -> usize {
        let options = self.options;
        let moment = Moment::of(self.level, options);
        let notes = &mut self.notes;
        (self.baked.as_mut()).map_or(0, |b| b.add(bsp, samples, &moment, &options.limits, notes))
    }

    /// The light entities that shine, with their entities.
    fn entity_lights(&mut self) -> Vec<EntityLight> {
        let (level, shallow, notes) = (self.level, self.shallow, &mut self.notes);
        let moment = Moment::of(level, self.options);
        match (self.options.lighting, self.options.lights) {
            (Lighting::Lightmap | Lighting::Fullbright, _) => Vec::new(),
            (Lighting::Compiler, _) => lights::compiler_lights_at(level, shallow, &moment, notes),
            (Lighting::Physical, LightMode::Textures) => Vec::new(),
            (Lighting::Physical, _) => lights::spheres(level, shallow, &moment, notes),
        }
    }

    pub(super) fn finish(mut self) -> Result<Scene, ImportError> {
        let Level { bsp, entities, .. } = self.level;
        for mesh in &mut self.meshes {
            see_through_last(mesh, |m| self.set.materials[m.0 as usize].is_see_through());
        }
        if self.meshes.iter().all(|m| m.triangles.is_empty()) {
            return Err(ImportError::NothingToDraw(self.level.name.clone()));
        }
        let lights = self.entity_lights();
        self.leave_light_to(&lights);
        let MaterialSet {
            materials,
            textures,
            ..
        } = &self.set;
        let emitters = match self.options.lighting {
            Lighting::Physical => Emitters::new(&self.meshes, &self.instances, materials, textures),
            // What emits is seen, and lights nothing.
            _ => Emitters::default(),
        };
        let (lights, twice) =
            emitters::choose_lights(lights, self.options.lights, &emitters.list, |e| {
                self.set.lamps[e.material.0 as usize]
            });
        self.tell_of_lamps_twice(&twice, &emitters);
        let mut lights: Vec<PointLight> = lights.into_iter().map(|l| l.light).collect();
        let moment = Moment::of(self.level, self.options);
        let styles = moment.told_apart(&mut lights, &mut self.notes);
        let brightness = moment.table(&lights);
        let light_sums = match self.options.lighting {
            Lighting::Compiler => {
                let of_models = self
                    .set
                    .materials
                    .iter()
                    .any(|m| m.least_light != Vec3::ZERO);
                lights::sums(self.level, &moment, &mut lights, of_models)
            }
            _ => None,
        };
        if self.options.lighting == Lighting::Physical {
            lights::make_room(
                lights.iter_mut(),
                &placed_corners(&self.meshes, &self.instances),
            );
            self.remark_what_is_not_modelled();
        }
        let sky = sky_triangles(&self.meshes, &self.instances, |material| {
            self.set.materials[material.0 as usize].surface == Surface::Sky
        });
        self.set.sky.suns = match self.options.lights {
            LightMode::Textures => Vec::new(),
            _ => weighed_suns(std::mem::take(&mut self.suns), &sky),
        };
        let is_lit = matches!(
            self.options.lighting,
            Lighting::Physical | Lighting::Compiler
        );
        let suns = &self.set.sky.suns;
        let is_dark = emitters.list.is_empty() && lights.is_empty() && suns.is_empty();
        if is_lit && is_dark && light_sums.is_none() {
            self.notes.add("dark", || {
                "nothing shines: pictures of the level are black".to_owned()
            });
        }

        let world = entities.first();
        self.report.emissive_texels = self.set.emissive_texels;
        self.report.ruled = self.set.ruled.into_iter().collect();
        self.set.replaced.append(&mut self.models.replaced);
        self.report.replaced = self.set.replaced.into_iter().collect();
        self.report.models = self.models.shown.into_iter().collect();
        self.report.warnings = (self.level.warnings.iter().map(ToString::to_string))
            .chain(self.notes.into_sentences())
            .collect();
        if self.is_stage {
            self.instances.truncate(1);
        }
        // Which lights stand for lamps that are drawn, too, was decided by all that emits.
        let emitters = match self.options.frames && !emitters.list.is_empty() {
            true => Emitters::new(
                &self.meshes,
                &self.instances[..1],
                &self.set.materials,
                &self.set.textures,
            ),
            false => emitters,
        };
        let emitters = emitters.with_lights(&lights, suns);
        let cells = if self.shallow && self.options.light_lists && light_sums.is_none() {
            cells::light_cells(bsp, &emitters, &lights, suns, &sky)
        } else {
            LightCells::default()
        };
        let fills = &self.set.fills;
        let media = if fills.is_empty() || !self.shallow {
            Media::default()
        } else {
            let nodes = cells::nodes(bsp).unwrap_or_default();
            translucent::media(bsp, nodes, |kind| fills.get(&kind).copied())
        };
        let mut scene = Scene {
            name: self.level.name.clone(),
            title: world
                .and_then(|w| w.get("message"))
                .map(|m| bsp::entity::unescape(m).trim().to_owned())
                .unwrap_or_default(),
            emitters,
            styles,
            cells,
            lights,
            light_sums,
            media,
            fog: self.set.fog,
            clear_sky: self.changes_fog.then_some(self.set.clear_sky),
            baked: (self.baked).map(|b| b.light(self.meshes.iter().zip(self.files_of_meshes))),
            meshes: self.meshes,
            instances: self.instances,
            materials: self.set.materials,
            textures: self.set.textures,
            sky: self.set.sky,
            cameras: cameras::cameras(bsp, entities),
            brightness,
            set_styles: self.options.style_brightness.clone(),
            sprites: self.models.sprites,
            report: self.report,
            ..Scene::default()
        };
        if let Some(camera) = scene.cameras.first().cloned() {
            scene.turn_sprites(&camera);
        }
        Ok(match (self.options.frames, self.options.lighting) {
            (false, _) => scene.completed(),
            (true, Lighting::Physical) => scene.for_frames(),
            (true, _) => Scene {
                moving: MovingEmitters::default(),
                ..scene.for_frames()
            },
        })
    }

    /// Reports the lamps that are there as a surface and as a light entity.
    fn tell_of_lamps_twice(&mut self, twice: &[Twice], emitters: &Emitters) {
        for pair in twice {
            let emitter: &Emitter = &emitters.list[pair.emitter];
            let source = &emitters.sources[emitter.first_source as usize];
            let mesh = &self.meshes[self.instances[source.instance as usize].mesh];
            let triangle = &mesh.triangles[source.triangle as usize];
            self.report.lamp_pairs.push(LampPair {
                entity: pair.light.entity,
                classname: pair.light.classname.clone(),
                position: pair.light.light.position,
                texture: self.set.materials[triangle.material.0 as usize]
                    .name
                    .clone(),
                face: triangle.face,
                distance: pair.distance,
            });
        }
        if !twice.is_empty() {
            self.notes.add("lamps twice", || {
                let (lights, are) = match twice.len() {
                    1 => ("light entity", "stands"),
                    _ => ("light entities", "stand"),
                };
                let count = twice.len();
                format!("{count} {lights} {are} for bright surfaces beside them: left out")
            });
        }
    }

    /// Says what the level asks for and the scene does not have.
    fn remark_what_is_not_modelled(&mut self) {
        let Some(world) = self.level.entities.first() else {
            return;
        };
        let notes = &mut self.notes;
        if ["light", "minlight"]
            .iter()
            .any(|key| world.float_loose(key).is_some_and(|v| v > 0.0))
        {
            notes.add("least light", || {
                "the least light of all surfaces (worldspawn's light) is not modelled: it comes \
                 from nowhere"
                    .to_owned()
            });
        }
        if self
            .set
            .materials
            .iter()
            .any(|m| m.warped && m.finish.alpha >= 1.0)
        {
            notes.add("liquids", || {
                "liquid surfaces are opaque: water reflects light evenly, lava, teleporters and \
                 slime glow"
                    .to_owned()
            });
        }
    }
}

/// Corners of all triangles that light meets as they are placed, world space.
fn placed_corners(meshes: &[Mesh], instances: &[Instance]) -> Vec<[Vec3; 3]> {
    (instances.iter())
        .filter(|instance| instance.seen_by.others())
        .flat_map(|instance| {
            let mesh = &meshes[instance.mesh];
            let place = |v: u32| {
                instance
                    .transform
                    .transform_point3(mesh.positions[v as usize])
            };
            (mesh.triangles.iter()).map(move |t| t.vertices.map(place))
        })
        .collect()
}

/// Bounds of a brush model as the file has them, or of its faces where the file's do not hold them.
pub(super) fn bounds(bsp: &Bsp, model: usize) -> (Vec3, Vec3) {
    let Some(record) = bsp.models.get(model) else {
        return (Vec3::ZERO, Vec3::ZERO);
    };
    let mut lo = Vec3::INFINITY;
    let mut hi = Vec3::NEG_INFINITY;
    for (_, face) in bsp.drawable_faces(model) {
        for p in bsp.face_points(face).into_iter().flatten() {
            lo = lo.min(Vec3::from(p));
            hi = hi.max(Vec3::from(p));
        }
    }
    let [mins, maxs] = [record.mins, record.maxs].map(Vec3::from);
    let holds = mins.cmple(lo + 1.0).all() && maxs.cmpge(hi - 1.0).all();
    let sane = (maxs - mins).max_element() <= 2.0 * (hi - lo).max_element() + 64.0;
    if holds && sane {
        (mins, maxs)
    } else {
        (lo, hi)
    }
}

/// What tells a box placed at `offset` from others, to a quarter of [`ENTITY_GROWTH`].
fn place_key((lo, hi): (Vec3, Vec3), offset: Vec3) -> [i64; 6] {
    let [a, b] = [lo + offset, hi + offset].map(|p| (p * (4.0 / ENTITY_GROWTH)).round());
    [a.x, a.y, a.z, b.x, b.y, b.z].map(|c| c as i64)
}

/// The scaling that makes an entity win over coplanar faces: its sides move out by `by` units.
pub(super) fn growth((lo, hi): (Vec3, Vec3), by: f32) -> Affine3A {
    if !(lo.is_finite() && hi.is_finite()) {
        return Affine3A::IDENTITY;
    }
    let centre = (lo + hi) / 2.0;
    let half = (hi - lo) / 2.0;
    let factor = ((half + by) / half).map(|f| {
        if f.is_finite() && f <= MAX_GROWTH_FACTOR {
            f
        } else {
            1.0
        }
    });
    Affine3A::from_translation(centre)
        * Affine3A::from_scale(factor)
        * Affine3A::from_translation(-centre)
}

fn polygon(bsp: &Bsp, index: usize, face: &Face, surface: &FaceSurface) -> Option<FacePolygon> {
    let mut points: Vec<Vec3> = bsp.face_points(face)?.map(Vec3::from).collect();
    // The file runs clockwise.
    points.reverse();
    let normal = DVec3::from(bsp.face_plane(face)?.normal.map(f64::from));
    Some(FacePolygon {
        points,
        normal: normal.try_normalize()?,
        material: surface.material,
        liquid: surface.kind.is_liquid(),
        inward: false,
        face: u32::try_from(index).ok()?,
        mapping: mapping(bsp.face_texinfo(face), surface),
    })
}

fn mapping(texinfo: Option<&Texinfo>, surface: &FaceSurface) -> TextureMapping {
    let usable = |axis: [f32; 4]| axis.iter().all(|c| c.abs() <= 1e6);
    let (s, t) = match texinfo {
        Some(info) if usable(info.s) && usable(info.t) => {
            (info.s.map(f64::from), info.t.map(f64::from))
        }
        _ => ([0.0; 4], [0.0; 4]),
    };
    if surface.kind.is_liquid() {
        // The warp repeats every 128 units, a whole number of tiles.
        let without_offset = |[x, y, z, _]: [f64; 4]| [x, y, z, 0.0];
        return TextureMapping {
            s: without_offset(s),
            t: without_offset(t),
            tile: [2.0 * WARP_TILE; 2],
        };
    }
    TextureMapping {
        s: s.map(|c| c * surface.scale[0]),
        t: t.map(|c| c * surface.scale[1]),
        tile: surface.size.map(f64::from),
    }
}

fn mesh(name: &str, part: ModelMesh) -> Mesh {
    Mesh {
        name: name.to_owned(),
        positions: part.positions,
        first_see_through: part.triangles.len(),
        triangles: part.triangles,
        ..Mesh::default()
    }
}

fn append(mesh: &mut Mesh, part: ModelMesh) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(part.positions);
    mesh.triangles
        .extend(part.triangles.into_iter().map(|mut t| {
            t.vertices = t.vertices.map(|v| v + base);
            t
        }));
}

fn see_through_last(mesh: &mut Mesh, is_see_through: impl Fn(MaterialId) -> bool) {
    let (rest, opaque): (Vec<_>, Vec<_>) = std::mem::take(&mut mesh.triangles)
        .into_iter()
        .partition(|t| is_see_through(t.material));
    mesh.first_see_through = opaque.len();
    mesh.triangles = opaque;
    mesh.triangles.extend(rest);
}
