//! Models and sprites of point entities into meshes, and the entities themselves into instances.

use super::appearance::{self, Beside};
use super::emitters::LAMP_REACH;
use super::inhabitants::{Inhabitant, inhabitants};
use super::lights::EntityLight;
use super::names::NameKind;
use super::picture::Indexed;
use super::poses::Pose;
use super::replaced::{Shown, Skins};
use super::rest;
use super::rules::Rule;
use super::surfaces::{self, Look, Surfaces};
use super::world::{ENTITY_GROWTH, World, bounds, growth};
use super::{LightMode, Lighting, translucent};
use crate::alias::{self, AliasModel};
use crate::material::{Material, MaterialId};
use crate::mesh::{Instance, Mesh, PoseBlend, SeenBy};
use crate::sprite::{PlacedSprite, SpriteModel, Stance};
use bsp::mdl::{Mdl, flags};
use bsp::miptex::{Animation, MipTex};
use bsp::spr::{Spr, SprPicture, Times};
use bsp::{Bsp, Level, Warnings};
use glam::{Affine3A, Quat, Vec3};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

/// Triangles that all models may have together, in every pose that is shown: a few bytes of entity text
/// can ask for another pose.
const MAX_TRIANGLES: usize = 1 << 20;
/// Parts of a second in which groups that begin at random times do: each is a mesh of its own.
const PHASES: f64 = 8.0;

/// The models of an import.
#[derive(Default)]
pub struct Models {
    files: HashMap<String, Option<Rc<Loaded>>>,
    /// Files that are not there.
    missing: BTreeSet<String>,
    meshes: HashMap<MeshKey, usize>,
    painted: HashMap<PaintKey, MaterialId>,
    triangles: usize,
    /// By alias model, the model that stands for it.
    pub replaced: BTreeMap<String, String>,
    /// How many entities show each file.
    pub shown: BTreeMap<String, usize>,
    /// Instances that turn to the camera.
    pub sprites: Vec<PlacedSprite>,
    /// Instances that shine as a whole and light their surroundings, if no light entity does.
    pub luminous: Vec<usize>,
}

/// A file as it is needed here.
pub enum Loaded {
    /// A brush model's mesh, and what makes it win over coplanar faces.
    Brush(usize, Affine3A),
    /// An alias model, or the surfaces of one that stands for it, not painted yet.
    Alias(Vec<AliasPart>),
    /// A sprite, not painted yet.
    Sprite(Box<(Spr, SpriteModel)>),
}

/// What is drawn of an alias model, as one mesh with one skin at a time.
pub struct AliasPart {
    /// Its file, and its surface if that has several.
    pub name: String,
    /// Its poses.
    pub model: AliasModel,
    /// Its pictures.
    pub skins: Skins,
}

/// File, pose, skin's material, and the entity where each has light of its own.
type MeshKey = (String, [u32; 3], MaterialId, Option<usize>);
/// File, skin or picture, part, coverage.
type PaintKey = (String, usize, usize, Option<u32>);

/// A picture of palette indices that becomes a material.
struct Painting<'p> {
    name: String,
    size: [u32; 2],
    pixels: &'p [u8],
    holes: bool,
    glow: Glow,
    two_sided: bool,
    alpha: Option<f32>,
}

/// What of a picture shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Glow {
    /// Bright texels, as on walls.
    Texels,
    /// All that ignores lighting, and everything if nothing does.
    Flame,
    /// Everything.
    Whole,
}

impl World<'_> {
    /// Shows all point entities that show something.
    pub fn point_entities(&mut self, poses: &[Pose<'_>]) {
        let Level { bsp, entities, .. } = self.level;
        for (number, who) in inhabitants(entities, self.options) {
            let Some(loaded) = self.loaded(&who.file) else {
                continue;
            };
            let origin = if self.shallow {
                rest::at_rest(bsp, poses, who.origin, who.rest)
            } else {
                who.origin
            };
            let before = self.instances.len();
            match &*loaded {
                Loaded::Brush(mesh, growth) => {
                    let turned = Quat::from_rotation_z(who.angles_deg[1].to_radians());
                    let place = Affine3A::from_rotation_translation(turned, origin);
                    self.place(Instance {
                        seen_by: self.seen_by(&who),
                        ..Instance::new(*mesh, place * *growth, who.classname)
                    });
                }
                Loaded::Alias(parts) => {
                    for part in parts {
                        self.place_alias(&who, number, origin, part);
                    }
                }
                Loaded::Sprite(both) => {
                    self.place_sprite(&who, number, origin, &both.0, &both.1);
                }
            }
            if self.instances.len() > before {
                *self.models.shown.entry(who.file.into_owned()).or_default() += 1;
            }
        }
        self.tell_of_missing();
    }

    /// One remark on all files that are not there.
    pub(super) fn tell_of_missing(&mut self) {
        let names: Vec<&str> = self.models.missing.iter().map(String::as_str).collect();
        if !names.is_empty() {
            let (count, names) = (names.len(), names.join(", "));
            self.notes.add("missing models", || {
                format!("{count} models are not shown, for they are not beside the level: {names}")
            });
        }
    }

    /// Flames that no light entity of their own stands for light their surroundings, unless another one
    /// beside them does: then the camera alone sees them.
    pub fn leave_light_to(&mut self, lights: &[EntityLight]) {
        for &number in &self.models.luminous {
            let instance = &mut self.instances[number];
            let origin = Vec3::from(instance.transform.translation);
            let near = |l: &EntityLight| l.light.position.distance(origin) <= LAMP_REACH;
            if lights.iter().any(near) {
                instance.seen_by = SeenBy::CAMERA;
            }
        }
    }

    fn time(&self, random_start: bool, number: usize) -> f64 {
        let phase = if random_start {
            (alias::phase(number as u32) * PHASES).floor() / PHASES
        } else {
            0.0
        };
        f64::from(self.options.time) + phase
    }

    /// Who sees an entity's model.
    fn seen_by(&self, who: &Inhabitant<'_>) -> SeenBy {
        match (self.options.lighting, self.options.lights) {
            // The compilers know of no models.
            (Lighting::Compiler, _) => SeenBy::CAMERA,
            (Lighting::Physical, LightMode::Textures) => SeenBy::ALL,
            // Its light is that of its light entity, which is inside it.
            (Lighting::Physical, _) if who.is_lamp => SeenBy::CAMERA,
            _ => SeenBy::ALL,
        }
    }

    fn place_alias(
        &mut self,
        who: &Inhabitant<'_>,
        number: usize,
        origin: Vec3,
        alias: &AliasPart,
    ) {
        let model = &alias.model;
        let time = self.time(model.random_start, number);
        let seen_by = self.seen_by(who);
        let is_luminous = alias::is_luminous(&who.file);
        let (skin, part) = model.picture(who.skin as usize, time);
        let key = (alias.name.clone(), skin, part, who.alpha.map(f32::to_bits));
        let material = match self.models.painted.get(&key) {
            Some(&known) => known,
            None => {
                let material = self.paint_part(&who.file, alias, [skin, part], who.alpha);
                self.models.painted.insert(key, material);
                material
            }
        };
        let (from, to, fraction) = who.frame_at(f64::from(self.options.time), number as u32);
        let pose = model.between(from, to, fraction, time);
        let Some(mesh) = self.posed_mesh(alias, number, origin, pose, material) else {
            return;
        };
        let mut angles = who.angles_deg;
        if model.flags & flags::ROTATE != 0 {
            angles[1] = alias::turning_yaw(f64::from(self.options.time));
        }
        let place = alias::placement(origin, angles, who.scale);
        let before = self.instances.len();
        self.place(Instance {
            seen_by,
            ..Instance::new(mesh, place, who.classname)
        });
        if is_luminous && seen_by.others() && self.instances.len() > before {
            self.models.luminous.push(before);
        }
    }

    /// The rigid mesh of a pose.
    fn posed_mesh(
        &mut self,
        alias: &AliasPart,
        number: usize,
        origin: Vec3,
        pose: PoseBlend,
        material: MaterialId,
    ) -> Option<usize> {
        // Lightmaps light each entity as the floor below it.
        let own = self.baked.is_some().then_some(number);
        let bits = [pose.from, pose.to, pose.fraction.to_bits()];
        let key = (alias.name.clone(), bits, material, own);
        if let Some(&known) = self.models.meshes.get(&key) {
            return Some(known);
        }
        let mesh = alias.model.posed(pose, material);
        let file = self.light_below(origin);
        let index = self.add_model_mesh(mesh, file)?;
        self.models.meshes.insert(key, index);
        Some(index)
    }

    fn light_below(&mut self, origin: Vec3) -> usize {
        let bsp = &self.level.bsp;
        (self.baked.as_mut()).map_or(0, |b| {
            let light = b.below(bsp, origin);
            b.add_evenly(light)
        })
    }

    /// Adds a mesh, if it has triangles and there are not too many already.
    pub(super) fn add_model_mesh(&mut self, mesh: Mesh, file: usize) -> Option<usize> {
        self.models.triangles += mesh.triangles.len();
        if self.models.triangles > MAX_TRIANGLES {
            self.notes.add("too many poses", || {
                "models are shown in too many poses: the rest is left out".to_owned()
            });
            return None;
        }
        if mesh.triangles.is_empty() {
            return None;
        }
        self.meshes.push(mesh);
        self.files_of_meshes.push(file);
        Some(self.meshes.len() - 1)
    }

    fn place_sprite(
        &mut self,
        who: &Inhabitant<'_>,
        number: usize,
        origin: Vec3,
        file: &Spr,
        model: &SpriteModel,
    ) {
        let time = self.time(model.random_start, number);
        let frame = if (who.frames.0 as usize) < model.frames.len() {
            who.frames.0 as usize
        } else {
            0
        };
        let shown = &model.frames[frame];
        let quads = match shown.times {
            Times::Angled => shown.first..shown.first + bsp::spr::ANGLES,
            _ => {
                let quad = model.quad(frame, time, 0.0);
                quad..quad + 1
            }
        };
        let pictures: Vec<_> = file.frames.iter().flat_map(|f| &f.pictures).collect();
        let mut meshes = Vec::new();
        for quad in quads {
            let key = (who.file.to_string(), quad, 0, who.alpha.map(f32::to_bits));
            let material = match self.models.painted.get(&key) {
                Some(&known) => known,
                None => {
                    let picture = pictures[quad];
                    if picture.pixels.is_empty() {
                        return;
                    }
                    let material = self.paint_sprite(&who.file, quad, picture, who.alpha);
                    self.models.painted.insert(key, material);
                    material
                }
            };
            let key = (who.file.to_string(), [quad as u32, 0, 0], material, None);
            let mesh = match self.models.meshes.get(&key) {
                Some(&known) => known,
                None => {
                    let mut mesh = model.quads[quad].clone();
                    mesh.triangles
                        .iter_mut()
                        .for_each(|t| t.material = material);
                    let file = self.baked.as_mut().map_or(0, |b| b.add_evenly([1.0; 3]));
                    let Some(index) = self.add_model_mesh(mesh, file) else {
                        return;
                    };
                    self.models.meshes.insert(key, index);
                    index
                }
            };
            meshes.push(mesh);
        }
        let stance = Stance {
            kind: model.kind,
            origin,
            angles_deg: who.angles_deg,
            scale: who.scale,
        };
        let instance = self.instances.len();
        self.place(Instance {
            seen_by: SeenBy::CAMERA,
            ..Instance::new(meshes[0], Affine3A::from_translation(origin), who.classname)
        });
        if self.instances.len() > instance {
            self.models.sprites.push(PlacedSprite {
                instance,
                stance,
                meshes,
            });
        }
    }

    /// A file, read when it is first asked for. What it is, its first bytes say.
    pub(super) fn loaded(&mut self, path: &str) -> Option<Rc<Loaded>> {
        if let Some(known) = self.models.files.get(path) {
            return known.clone();
        }
        let made = self.load(path).map(Rc::new);
        self.models.files.insert(path.to_owned(), made.clone());
        made
    }

    fn load(&mut self, path: &str) -> Option<Loaded> {
        let Some(data) = (self.files)(path) else {
            self.models.missing.insert(path.to_owned());
            return None;
        };
        let mut warnings = Warnings::new();
        let limits = &self.options.limits;
        let read = match data.get(..4) {
            Some(b"IDPO") => Mdl::parse(&data, limits, &mut warnings)
                .map(|file| Some(Loaded::Alias(self.alias_parts(path, file)))),
            Some(b"IDSP") => Spr::parse(&data, limits, &mut warnings).map(|file| {
                let model = SpriteModel::new(path, &file, |_, _| MaterialId(0));
                Some(Loaded::Sprite(Box::new((file, model))))
            }),
            _ => Bsp::parse(&data, limits, &mut warnings)
                .map(|bsp| self.load_brush(path, &bsp, &mut warnings)),
        };
        for warning in warnings.iter() {
            self.notes.add(&format!("{path} {warning}"), || {
                format!("{path}: {warning}")
            });
        }
        read.unwrap_or_else(|error| {
            self.notes.add(path, || format!("{path}: {error}"));
            None
        })
    }

    fn load_brush(&mut self, path: &str, bsp: &Bsp, warnings: &mut Warnings) -> Option<Loaded> {
        let animation = Animation::new(&bsp.textures, warnings);
        let mut surfaces = Surfaces::new(bsp, &animation, self.palette, self.beside());
        let part = self.model_mesh(&mut surfaces, bsp, 0, Look::default());
        let number = self.lightmaps(bsp, &bsp.own_light_samples());
        (!part.triangles.is_empty()).then(|| {
            let mesh = self.add_mesh(path, part, number);
            Loaded::Brush(mesh, growth(bounds(bsp, 0), ENTITY_GROWTH))
        })
    }

    /// The material of a picture of a skin of `file`, by its numbers.
    pub(super) fn paint_part(
        &mut self,
        file: &str,
        alias: &AliasPart,
        [skin, part]: [usize; 2],
        alpha: Option<f32>,
    ) -> MaterialId {
        match &alias.skins {
            Skins::Own(own) => {
                let pixels = &own.skins[skin].pictures[part];
                self.paint_skin(file, own, [skin, part], pixels, alpha)
            }
            Skins::Beside(skins) => {
                let shown = &skins[skin][part];
                let holes = alias.model.flags & flags::HOLES != 0;
                self.paint_picture(file, shown, holes, alpha)
            }
        }
    }

    /// The material of a picture that stands for a skin of `file`, in light as it is.
    fn paint_picture(
        &mut self,
        file: &str,
        shown: &Shown,
        holes: bool,
        alpha: Option<f32>,
    ) -> MaterialId {
        let options = self.options;
        let kind = if holes {
            NameKind::Fence
        } else {
            NameKind::Plain
        };
        let rule = options.materials.of(file);
        if !rule.entries.is_empty() {
            (self.set.ruled).insert(file.to_owned(), rule.entries.clone());
        }
        let glow = glow_of(file);
        let mut base = shown.base.clone();
        let mut emission = shown.emission.clone();
        if glow == Glow::Whole || (glow == Glow::Flame && emission.is_none()) {
            let black = vec![[0, 0, 0, 255]; base.rgba.len()];
            emission = Some((std::mem::replace(&mut base, shown.base.clone()), 0));
            base.rgba = black;
        }
        let opacity = rule.alpha.or(alpha).unwrap_or(1.0);
        let finish = translucent::finish(kind, opacity, &base, &rule);
        let set = &mut self.set;
        let mut material = Material {
            emission_scale: options.emission_scale * finish.alpha * rule.emission.unwrap_or(1.0),
            alpha_tested: holes,
            finish,
            ..Material::new(base.name.clone(), set.add_texture(base))
        };
        if options.lights != LightMode::Entities || glow != Glow::Texels {
            surfaces::emit(&mut material, emission, kind, &rule, set);
        }
        set.add(material, false)
    }

    /// The material of a picture of a skin: its numbers, and its palette indices.
    pub(super) fn paint_skin(
        &mut self,
        name: &str,
        file: &Mdl,
        [skin, part]: [usize; 2],
        pixels: &[u8],
        alpha: Option<f32>,
    ) -> MaterialId {
        let painting = Painting {
            name: match file.skins.get(skin).map_or(1, |s| s.pictures.len()) {
                1 => format!("{name} skin {skin}"),
                _ => format!("{name} skin {skin}.{part}"),
            },
            size: [file.header.skin_width, file.header.skin_height],
            pixels,
            holes: file.header.flags & flags::HOLES != 0,
            glow: glow_of(name),
            two_sided: false,
            alpha,
        };
        self.paint(name, &painting)
    }

    /// The material of a sprite's picture.
    pub(super) fn paint_sprite(
        &mut self,
        name: &str,
        number: usize,
        picture: &SprPicture,
        alpha: Option<f32>,
    ) -> MaterialId {
        let painting = Painting {
            name: format!("{name} picture {number}"),
            size: [picture.width, picture.height],
            pixels: &picture.pixels,
            holes: true,
            glow: Glow::Whole,
            two_sided: true,
            alpha,
        };
        self.paint(name, &painting)
    }

    /// The material of a picture of `file`.
    fn paint(&mut self, file: &str, painting: &Painting<'_>) -> MaterialId {
        let options = self.options;
        let miptex = MipTex {
            name: painting.name.clone(),
            raw_name: [0; 16],
            width: painting.size[0],
            height: painting.size[1],
            pixels: painting.pixels.to_vec(),
            palette: None,
        };
        let kind = if painting.holes {
            NameKind::Fence
        } else {
            NameKind::Plain
        };
        let is_physical = options.lighting == Lighting::Physical;
        let mut rule = if is_physical {
            options.materials.of(file)
        } else {
            Rule::default()
        };
        if !rule.entries.is_empty() {
            (self.set.ruled).insert(file.to_owned(), rule.entries.clone());
        }
        if painting.glow == Glow::Flame {
            // What burns does so however dark.
            rule.threshold = rule.threshold.or(Some(0.0));
        }
        let indexed = Indexed::new(&miptex, self.palette, painting.holes);
        let whole = match painting.glow {
            Glow::Texels => false,
            // As engines do where no texel says so.
            Glow::Flame => indexed.emission(0.0).is_none(),
            Glow::Whole => true,
        };
        let beside = Beside {
            files: &nothing,
            ..self.beside()
        };
        let seen = appearance::of(
            &miptex,
            self.palette,
            kind,
            &rule,
            &beside,
            options,
            &mut self.notes,
        );
        let set = &mut self.set;
        let (mut base, mut emission) =
            seen.map_or((indexed.base(), None), |s| (s.base, s.emission));
        let finish = translucent::finish(
            kind,
            rule.alpha.or(painting.alpha).unwrap_or(1.0),
            &base,
            &rule,
        );
        if whole && is_physical {
            let mut picture = base;
            for texel in picture.rgba.iter_mut().filter(|t| t[3] == 0) {
                *texel = [0, 0, 0, 255];
            }
            emission = Some((picture, 0));
            base = indexed.base_without(|_| true);
        }
        let mut material = Material {
            emission_scale: options.emission_scale * finish.alpha * rule.emission.unwrap_or(1.0),
            alpha_tested: painting.holes,
            two_sided: painting.two_sided,
            finish,
            ..Material::new(painting.name.clone(), set.add_texture(base))
        };
        match options.lighting {
            Lighting::Physical
                if options.lights != LightMode::Entities || painting.glow != Glow::Texels =>
            {
                surfaces::emit(&mut material, emission, kind, &rule, set);
            }
            Lighting::Physical => {}
            lighting => surfaces::show(&mut material, &indexed, whole, set, lighting),
        }
        set.add(material, false)
    }
}

/// What of a model's skins shines.
fn glow_of(file: &str) -> Glow {
    if alias::is_bolt(file) {
        Glow::Whole
    } else if alias::is_luminous(file) {
        Glow::Flame
    } else {
        Glow::Texels
    }
}

/// No file: skins have no pictures beside them.
fn nothing(_: &str) -> Option<Vec<u8>> {
    None
}
