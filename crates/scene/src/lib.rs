//! What is in a level, said once for every renderer: meshes, materials, emitters, lights, cameras.
//!
//! This is the one room that knows both vocabularies. The import turns Quake's files
//! into the types of this crate; the renderers (`rt` on the GPU, `reference` on the CPU) know only
//! these types. It also holds what every renderer is asked and what it answers ([`render`]).
//!
//! Conventions, everywhere unless a name says otherwise:
//! - world space is Quake's: right-handed, Z up, one unit is about one inch;
//! - triangles are counter-clockwise seen from the front, and `normal` points to the front;
//! - radiance is scene-linear RGB with sRGB primaries; texels are sRGB-encoded bytes;
//! - texture coordinates are in texels (not normalised), `v` downwards, wrapping.

#![forbid(unsafe_code)]

pub mod alias;
pub mod baked;
pub mod camera;
pub mod camera_path;
pub mod cells;
pub mod emitter;
pub mod fog;
pub mod frame;
pub mod gloss;
pub mod import;
pub mod light;
pub mod material;
pub mod media;
pub mod mesh;
pub mod playback;
pub mod render;
pub mod sky;
pub mod smooth;
pub mod sprite;
pub mod timeline;

pub use baked::BakedLight;
pub use camera::Camera;
pub use camera_path::CameraPath;
pub use cells::LightCells;
pub use emitter::{Emitter, Emitters, MovingEmitters};
pub use fog::Fog;
pub use frame::Frame;
pub use light::{LightStyle, LightSums, PointLight};
pub use material::{Finish, Material, MaterialId, Surface, Texture, TextureId};
pub use media::Media;
pub use mesh::{Instance, Mesh, PoseBlend, SeenBy, Triangle};
pub use sky::{ClearSky, Sky, Sun};
pub use sprite::PlacedSprite;

use glam::{Affine3A, Vec3};

/// A level at one moment, ready to be rendered.
///
/// `meshes[0]` is the static world; every other mesh is a model that moves or repeats and is
/// placed by [`Instance`]s. `instances[0]` places the world with the identity.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for people and file names, for example `e1m1`.
    pub name: String,
    /// The level's own title (`message` of worldspawn), may be empty.
    pub title: String,
    /// Geometry, each in its own local space.
    pub meshes: Vec<Mesh>,
    /// Meshes placed in the world.
    pub instances: Vec<Instance>,
    /// What surfaces look like; indexed by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Pictures; indexed by [`TextureId`].
    pub textures: Vec<Texture>,
    /// Everything that can be chosen as a light, with its share of the power.
    pub emitters: Emitters,
    /// What emits on the meshes that frames move, in scenes that frames are shown of
    /// ([`Scene::for_frames`]).
    pub moving: MovingEmitters,
    /// Which lights matter where; may be empty.
    pub cells: LightCells,
    /// Light entities.
    pub lights: Vec<PointLight>,
    /// How compiler lights become one where not all of them add up.
    pub light_sums: Option<LightSums>,
    /// What fills space, where light passes into it.
    pub media: Media,
    /// Fog in all of space, liquids included.
    pub fog: Option<Fog>,
    /// The sky without fog, where frames may have other fog than the level.
    pub clear_sky: Option<ClearSky>,
    /// The level's own lightmaps, if they light it.
    pub baked: Option<BakedLight>,
    /// Light styles that the film tells apart; empty if it does not. The first one is number 0 with
    /// a brightness of 1: everything but the lights of the styles that follow. The intensities of
    /// those lack the brightness of their style.
    pub styles: Vec<LightStyle>,
    /// Brightness of the light styles by number at the scene's moment, which the intensities of the
    /// lights then lack. Empty if they have it.
    pub brightness: Vec<f32>,
    /// Brightness that light styles have in all frames, whatever a demo says: number and brightness.
    pub set_styles: Vec<(u16, f32)>,
    /// What sky faces show.
    pub sky: Sky,
    /// Instances that turn to the camera; see [`Scene::turn_sprites`].
    pub sprites: Vec<PlacedSprite>,
    /// Places to look from; never empty after an import. Sprites are turned to the first one.
    pub cameras: Vec<Camera>,
    /// Smallest corner of all placed geometry, in world units.
    pub bounds_min: Vec3,
    /// Largest corner of all placed geometry, in world units.
    pub bounds_max: Vec3,
    /// What the scene contains, so that a pipeline models only that.
    pub features: Features,
    /// What the import found; for `info` and for people.
    pub report: Report,
}

/// What a scene contains. A renderer leaves out what is not here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Alpha-tested surfaces exist: shadow and path rays need an any-hit test on them.
    pub fences: bool,
    /// Liquid surfaces exist (drawn warped).
    pub liquids: bool,
    /// Surfaces exist that light passes straight through, in part: shadow rays ask each.
    pub translucent: bool,
    /// Fog fills the level.
    pub fog: bool,
    /// Glossy or metallic surfaces exist.
    pub gloss: bool,
    /// Surfaces have pictures of their normals.
    pub normal_maps: bool,
    /// Sky faces exist.
    pub sky: bool,
    /// Emissive triangles other than the sky exist.
    pub emissive_surfaces: bool,
    /// Light entities exist and are switched on.
    pub point_lights: bool,
    /// Some of them are spotlights.
    pub spotlights: bool,
    /// The sky has suns.
    pub suns: bool,
    /// The film tells light styles apart.
    pub style_layers: bool,
    /// Light entities light by the light compilers' formulas.
    pub compiler_lights: bool,
    /// Compiler lights do not all add up: see [`LightSums`].
    pub light_sums: bool,
    /// The level's own lightmaps light it.
    pub baked_light: bool,
    /// Instances are placed elsewhere than where their mesh lies.
    pub instances: bool,
    /// Instances are in poses between those of their mesh.
    pub poses: bool,
    /// Instances have facets that are shaded as round.
    pub smooth_normals: bool,
    /// Instances show other materials than their mesh has.
    pub skins: bool,
    /// Instances are met by some rays alone.
    pub masks: bool,
    /// Frames are shown of the scene: instances and lights come, go and move.
    pub frames: bool,
}

impl Features {
    /// The names of the features that are on, each with the reason it is, in a fixed order.
    #[must_use]
    pub fn described(&self) -> Vec<(&'static str, &'static str)> {
        [
            (
                self.fences,
                "fences",
                "alpha-tested surfaces: any-hit shaders on those alone",
            ),
            (
                self.liquids,
                "liquids",
                "liquid surfaces: warped texture coordinates",
            ),
            (
                self.translucent,
                "translucent",
                "liquids or entities with an alpha below 1: Fresnel reflection, straight passage, \
                 absorption",
            ),
            (
                self.fog,
                "fog",
                "fog in the whole level: absorption, and light scattered once on its way",
            ),
            (
                self.gloss,
                "gloss",
                "glossy or metallic materials: microfacets over the Lambertian body",
            ),
            (
                self.normal_maps,
                "normal maps",
                "pictures of normals: shading differs from the faces' planes",
            ),
            (self.sky, "sky", "sky faces: radiance by direction"),
            (
                self.emissive_surfaces,
                "emissive surfaces",
                "fullbright texels or glowing liquids",
            ),
            (
                self.point_lights,
                "point lights",
                "light entities, each chosen and looked for",
            ),
            (self.spotlights, "spotlights", "light entities with a cone"),
            (
                self.style_layers,
                "style layers",
                "light of each light style in a layer of its own",
            ),
            (
                self.suns,
                "suns",
                "discs in the sky: light sampled in their cones",
            ),
            (
                self.compiler_lights,
                "compiler lights",
                "light entities by the light compilers' formulas instead of small spheres",
            ),
            (
                self.light_sums,
                "sums of light",
                "least light, gamma or lights that take light away: all light entities are asked at every point",
            ),
            (
                self.baked_light,
                "baked light",
                "the level's own lightmaps instead of traced light",
            ),
            (
                self.instances,
                "instances",
                "models placed beside the static world",
            ),
            (
                self.poses,
                "poses",
                "models in poses: vertices blended, facets' normals from their corners",
            ),
            (
                self.smooth_normals,
                "smooth normals",
                "models whose facets are shaded as round",
            ),
            (self.skins, "skins", "models that show another skin"),
            (
                self.masks,
                "masks",
                "models that the camera alone sees, or all but the camera",
            ),
            (
                self.frames,
                "frames",
                "moments are shown: lights that move are chosen beside those of the level",
            ),
        ]
        .into_iter()
        .filter_map(|(on, name, why)| on.then_some((name, why)))
        .collect()
    }
}

/// Counts and remarks of an import.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Faces of the file that became triangles.
    pub faces: usize,
    /// Faces left out because they carry a tool texture or belong to an invisible entity.
    pub faces_left_out: usize,
    /// Edges of the static world's mesh that are not matched by an opposite edge.
    pub open_edges: usize,
    /// Vertices inserted into edges to remove T-junctions.
    pub t_junctions_split: usize,
    /// Open edges of the static world beside which solid has no face: places where rays can enter
    /// solid. The other open edges lie on faces.
    pub holes: usize,
    /// Whether no ray should leave the level: its outside is solid, which compilers see to only if
    /// no path leads out, and there are no [`Report::holes`].
    pub sealed: bool,
    /// Texels of emitting textures that emit at the chosen threshold, over all textures.
    pub emissive_texels: usize,
    /// Light entities that are left out because a bright surface beside them is the same lamp, in
    /// order of the entities.
    pub lamp_pairs: Vec<LampPair>,
    /// Textures that entries of the materials speak of, with those entries.
    pub ruled: Vec<(String, Vec<String>)>,
    /// Textures that a picture stands for, and alias models that another model stands for, with its path.
    pub replaced: Vec<(String, String)>,
    /// Models and sprites of point entities, with how many of each are shown.
    pub models: Vec<(String, usize)>,
    /// Oddities that were repaired or skipped, one sentence each.
    pub warnings: Vec<String>,
}

/// A lamp that a level has twice: as a light entity, and drawn by a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct LampPair {
    /// Number of the entity.
    pub entity: usize,
    /// Its class.
    pub classname: String,
    /// Where its light is, world space: its origin, or beside it if that lies in solid.
    pub position: Vec3,
    /// Texture of the nearest bright surface.
    pub texture: String,
    /// Number of that surface's face in the level.
    pub face: u32,
    /// Its distance from the light, world units.
    pub distance: f32,
}

impl Scene {
    /// Fills in what follows from the rest: the bounds and the features. A scene that frames are shown
    /// of has the features of all that they may show.
    #[must_use]
    pub fn completed(mut self) -> Self {
        self.bounds_min = Vec3::INFINITY;
        self.bounds_max = Vec3::NEG_INFINITY;
        let frames = self.features.frames;
        let mut is_used = vec![frames; self.materials.len()];
        for instance in &self.instances {
            let mesh = &self.meshes[instance.mesh];
            let positions = mesh.posed(instance.pose);
            for triangle in &mesh.triangles {
                is_used[instance.material_of(triangle).0 as usize] = true;
                for vertex in triangle.vertices {
                    let p = instance
                        .transform
                        .transform_point3(positions[vertex as usize]);
                    self.bounds_min = self.bounds_min.min(p);
                    self.bounds_max = self.bounds_max.max(p);
                }
            }
        }
        let any = |test: fn(&Material) -> bool| {
            self.materials
                .iter()
                .zip(&is_used)
                .any(|(m, &used)| used && test(m))
        };
        self.features = Features {
            fences: any(|m| m.alpha_tested),
            liquids: any(|m| m.warped),
            translucent: any(|m| m.finish.alpha < 1.0),
            fog: self.fog.is_some() || self.clear_sky.is_some(),
            gloss: any(|m| m.finish.gloss.is_some()),
            normal_maps: any(|m| m.finish.normals.is_some()),
            sky: any(|m| m.surface == Surface::Sky),
            emissive_surfaces: any(|m| m.surface != Surface::Sky && m.emission.is_some()),
            point_lights: !self.lights.is_empty(),
            spotlights: self.lights.iter().any(|l| l.spot.is_some()),
            suns: !self.sky.suns.is_empty(),
            style_layers: self.styles.len() > 1,
            compiler_lights: self.lights.iter().any(|l| l.compiler.is_some()),
            light_sums: self.light_sums.is_some(),
            baked_light: self.baked.is_some(),
            instances: self
                .instances
                .iter()
                .any(|i| i.transform != Affine3A::IDENTITY)
                || frames,
            poses: self
                .instances
                .iter()
                .any(|i| !self.meshes[i.mesh].poses.is_empty())
                || frames && self.meshes.iter().any(|m| !m.poses.is_empty()),
            smooth_normals: self
                .instances
                .iter()
                .any(|i| !self.meshes[i.mesh].normals.is_empty())
                || frames && self.meshes.iter().any(|m| !m.normals.is_empty()),
            skins: self.instances.iter().any(|i| i.material.is_some()) || frames,
            masks: self.instances.iter().any(|i| i.seen_by != SeenBy::ALL) || frames,
            frames,
        };
        self
    }

    /// Turns all sprites to a camera. To be called before a renderer gets the scene.
    pub fn turn_sprites(&mut self, camera: &Camera) {
        for sprite in &self.sprites {
            let instance = &mut self.instances[sprite.instance];
            instance.transform = sprite::placement(&sprite.stance, camera);
            let side = sprite::direction_of(sprite::direction_deg(&sprite.stance, camera));
            instance.mesh = sprite.meshes[side % sprite.meshes.len()];
        }
    }

    /// Which of [`Scene::styles`] a light shines in, if they are told apart.
    #[must_use]
    pub fn style_of(&self, light: &PointLight) -> usize {
        let listed = self.styles.iter().position(|s| s.number == light.style);
        listed.unwrap_or(0)
    }

    /// The triangle that a ray from `origin` began on: the nearest one, if it is nearer than ray
    /// origins are moved off surfaces. `None` for a point in free space, such as a camera. Looks at
    /// every triangle.
    #[must_use]
    pub fn triangle_beside(&self, origin: Vec3) -> Option<&Triangle> {
        /// Share of the largest coordinate by which origins may be moved along grazing rays.
        const NEAR: f32 = 4e-5;
        let extent = (self.bounds_min.abs()).max(self.bounds_max.abs());
        let near = (NEAR * extent.max_element()).max(NEAR);
        let distances = self.instances.iter().flat_map(|instance| {
            let mesh = &self.meshes[instance.mesh];
            let positions = mesh.posed(instance.pose);
            mesh.triangles.iter().map(move |t| {
                let corners = (t.vertices).map(|v| {
                    let p = instance.transform.transform_point3(positions[v as usize]);
                    (p - origin).as_dvec3()
                });
                (mesh::distance_to_triangle(corners), t)
            })
        });
        let (distance, triangle) = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (distance <= f64::from(near)).then_some(triangle)
    }

    /// [`Sky::scale`] and [`Sky::veil`] in a frame with this fog.
    #[must_use]
    pub fn sky_now(&self, fog: Option<Fog>) -> [[Vec3; 2]; 2] {
        self.clear_sky
            .map_or([self.sky.scale, self.sky.veil], |sky| sky.in_fog(fog))
    }

    /// By material, the one that it shows at a level time of `time` seconds in frames.
    #[must_use]
    pub fn looks(&self, time: f32) -> Vec<MaterialId> {
        let look = |(id, material): (u32, &Material)| {
            let frames = &material.frames;
            let turn = bsp::miptex::turn(frames.len(), f64::from(time));
            frames.get(turn).copied().unwrap_or(MaterialId(id))
        };
        (0..).zip(&self.materials).map(look).collect()
    }

    /// Triangles over all instances, as a ray can meet them.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.instances
            .iter()
            .map(|i| self.meshes[i.mesh].triangles.len())
            .sum()
    }
}
