//! What casts shadows for the light compilers: the world's solid faces and fences, and brush models
//! that say so. Liquids of the world do not.

use bsp::Bsp;
use bsp::Level;
use bsp::bsp::{Face, contents};
use bsp::entity::Entity;
use glam::{DVec3, Vec3};
use reference::rays::{Occluder, OccluderHit, Occluders};
use scene::import::least_color;
use std::cell::Cell;

/// A point nearer to solid than this counts as in it, world units.
const TOUCHING: f64 = 0.1;
/// A fence's palette index for holes.
const HOLE: u8 = 255;

/// What a brush model's entity says about light.
#[derive(Clone, Copy, Debug)]
pub struct ModelKeys {
    /// Casts shadows on everything.
    pub shadow: bool,
    /// Casts shadows on itself.
    pub shadow_self: bool,
    /// Casts shadows on the world.
    pub shadow_world: bool,
    /// Opacity, 1 opaque.
    pub alpha: f32,
    /// Least light, in the unit of lights.
    pub least: f32,
    /// Its colour, 1 is full.
    pub least_color: Vec3,
    /// No light falls on it.
    pub ignores_light: bool,
}

impl ModelKeys {
    fn of(entity: Option<&Entity>) -> Self {
        let value = |key| entity.and_then(|e| e.float_loose(key)).unwrap_or(0.0);
        let is_set = |key| value(key) != 0.0;
        Self {
            shadow: is_set("shadow"),
            shadow_self: is_set("shadowself") || is_set("selfshadow"),
            shadow_world: is_set("shadowworldonly"),
            alpha: Some(value("alpha")).filter(|&a| a > 0.0).unwrap_or(1.0),
            least: value("minlight"),
            least_color: entity.map_or(Vec3::ONE, least_color),
            ignores_light: is_set("lightignore"),
        }
    }
}

/// A triangle's face.
#[derive(Clone, Copy, Debug)]
struct Source {
    face: usize,
    model: usize,
    is_sky: bool,
}

/// A level's shadow casters.
#[derive(Debug)]
pub struct Shadows<'a> {
    bsp: &'a Bsp,
    /// By brush model.
    pub models: Vec<ModelKeys>,
    occluders: Occluders,
    corners: Vec<[Vec3; 3]>,
    sources: Vec<Source>,
}

/// How free a way is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Nothing is there.
    Free,
    /// Something is.
    Blocked,
    /// Only glass is, which would tint the light.
    Glass,
}

impl<'a> Shadows<'a> {
    /// The shadow casters of `level`.
    #[must_use]
    pub fn new(level: &'a Level) -> Self {
        let bsp = &level.bsp;
        let mut models = vec![ModelKeys::of(None); bsp.models.len()];
        for entity in &level.entities {
            if let Some(model) = entity.brush_model().and_then(|m| models.get_mut(m)) {
                *model = ModelKeys::of(Some(entity));
            }
        }
        let (mut triangles, mut sources) = (Vec::new(), Vec::new());
        for (model, keys) in models.iter().enumerate() {
            if model > 0 && !(keys.shadow || keys.shadow_self || keys.shadow_world) {
                continue;
            }
            for (face, record) in bsp.drawable_faces(model) {
                let name = texture_name(bsp, record);
                let is_fence = name.starts_with('{');
                if model == 0 && name.starts_with('*') {
                    continue;
                }
                let source = Source {
                    face,
                    model,
                    is_sky: name.get(..3).is_some_and(|n| n.eq_ignore_ascii_case("sky")),
                };
                let is_asked = is_fence || (model > 0 && (!keys.shadow || keys.alpha < 1.0));
                let points: Vec<Vec3> = (bsp.face_points(record).into_iter().flatten())
                    .map(Vec3::from)
                    .collect();
                if model == 0 && is_illusion(bsp, record, &points) {
                    continue;
                }
                for pair in points.windows(2).skip(1) {
                    let corners = [points[0], pair[0], pair[1]];
                    triangles.push(Occluder { corners, is_asked });
                    sources.push(source);
                }
            }
        }
        Self {
            bsp,
            models,
            occluders: Occluders::new(&triangles),
            corners: triangles.iter().map(|t| t.corners).collect(),
            sources,
        }
    }

    /// Whether light from `to` reaches `from`, a point before a face of `model`.
    pub fn way(&self, from: DVec3, to: DVec3, model: usize) -> Way {
        let glass = Cell::new(false);
        let is_there = |hit: OccluderHit| self.is_there(&hit, model, &glass);
        match (self.occluders.is_blocked(from, to, is_there), glass.get()) {
            (true, _) => Way::Blocked,
            (false, true) => Way::Glass,
            (false, false) => Way::Free,
        }
    }

    /// Whether a sky face is the first thing in a direction.
    pub fn way_to_sky(&self, from: DVec3, direction: DVec3, model: usize) -> Way {
        let glass = Cell::new(false);
        let is_there = |hit: OccluderHit| self.is_there(&hit, model, &glass);
        let hit = self.occluders.nearest(from, direction, is_there);
        match (
            hit.is_some_and(|h| self.sources[h.index].is_sky),
            glass.get(),
        ) {
            (false, _) => Way::Blocked,
            (true, true) => Way::Glass,
            (true, false) => Way::Free,
        }
    }

    /// Whether a point is in what takes light away from samples: solid or sky of the world, the
    /// sample's own model, or an opaque model that casts shadows.
    pub fn is_in_solid(&self, point: DVec3, model: usize) -> bool {
        let is_solid = |model| self.bsp.touches_solid(model, point.to_array(), TOUCHING);
        is_solid(0)
            || (model > 0 && is_solid(model))
            || (self.models.iter().enumerate().skip(1))
                .any(|(m, keys)| keys.shadow && keys.alpha >= 1.0 && is_solid(m))
    }

    fn is_there(&self, hit: &OccluderHit, model: usize, glass: &Cell<bool>) -> bool {
        let source = self.sources[hit.index];
        let keys = &self.models[source.model];
        let on_all = source.model == 0 || keys.shadow;
        let on_this =
            (keys.shadow_self && model == source.model) || (keys.shadow_world && model == 0);
        if !on_all && !on_this {
            return false;
        }
        if source.model > 0 && keys.alpha < 1.0 {
            glass.set(true);
            return false;
        }
        let [a, b, c] = self.corners[hit.index].map(Vec3::as_dvec3);
        let [u, v, w] = hit.weights;
        !is_hole(self.bsp, source.face, a * u + b * v + c * w)
    }
}

/// The name of a face's texture; empty if it is missing.
pub fn texture_name<'a>(bsp: &'a Bsp, face: &Face) -> &'a str {
    (bsp.face_texture(face))
        .and_then(|i| bsp.textures.get(i)?.as_ref())
        .map_or("", |t| t.name.as_str())
}

/// Whether a face of the world has no solid behind it either: of `func_detail_illusionary`, which casts no shadows.
fn is_illusion(bsp: &Bsp, face: &Face, points: &[Vec3]) -> bool {
    let Some(plane) = bsp.face_plane(face) else {
        return false;
    };
    let centre = points.iter().sum::<Vec3>() / points.len().max(1) as f32;
    [-1.0, 1.0].into_iter().all(|side| {
        let beside = centre + Vec3::from(plane.normal) * side;
        bsp.point_contents(0, beside.to_array())
            .is_some_and(|c| c != contents::SOLID && c != contents::SKY)
    })
}

/// Whether a fence has a hole at a point. One whose texels are not there is all hole, as for the compilers.
fn is_hole(bsp: &Bsp, face: usize, point: DVec3) -> bool {
    let texture = || {
        let face = bsp.faces.get(face)?;
        let texture = bsp.textures.get(bsp.face_texture(face)?)?.as_ref()?;
        let [s, t] = bsp.face_texinfo(face)?.st(point.as_vec3().to_array());
        texture.name.starts_with('{').then_some((texture, s, t))
    };
    texture().is_some_and(|(texture, s, t)| {
        let at = |c: f64, size: u32| (c.floor() as i64).rem_euclid(i64::from(size.max(1))) as usize;
        let index = at(t, texture.height) * texture.width as usize + at(s, texture.width);
        texture.pixels.get(index).is_none_or(|&texel| texel == HOLE)
    })
}
