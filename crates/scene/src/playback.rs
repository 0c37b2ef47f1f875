//! States of a demo as frames that a renderer shows.
//!
//! What gives light is told once: flashes, explosions, rockets and whoever glows are spheres of light
//! ([`crate::PointLight`]), and bolts a row of them, and what carries such a light is seen by the
//! camera alone, so that it neither counts twice nor stands in its own light.

use crate::Scene;
use crate::alias::{self, AliasModel};
use crate::camera::{Camera, Lens};
use crate::fog::Fog;
use crate::frame::{Drift, Frame};
use crate::import::{Cast, CastList, CastModel, FogKeys, IRRADIANCE_PER_VALUE, LAMP_REACH};
use crate::light::PointLight;
use crate::material::MaterialId;
use crate::mesh::{Instance, Mesh, SeenBy, Triangle};
use crate::sprite::{self, Stance};
use crate::timeline::{
    Beam, DynamicLight, Entity, FrameBlend, Level, LightKind, Particle, State, Timeline,
};
use glam::{Affine3A, Quat, Vec3};
use std::collections::BTreeSet;
use std::f32::consts::PI;

/// All that a level of a demo shows, for an import to bring along.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Names of models.
    pub models: Vec<String>,
    /// Rows of the palette that players wear as shirt and trousers.
    pub colours: Vec<[u8; 2]>,
    /// Models that appear in part only, with their coverage in 255ths.
    pub faded: Vec<(String, u8)>,
    /// Whether the fog changes.
    pub fog: bool,
}

impl Parts {
    /// What a level of a demo shows; nothing of a level that it does not have.
    #[must_use]
    pub fn of(timeline: &Timeline, level: usize) -> Self {
        let Some(level) = timeline.levels().get(level) else {
            return Self::default();
        };
        let (mut models, mut faded) = (BTreeSet::new(), BTreeSet::new());
        for (model, opacity) in level.shown() {
            let name = level.models.get(usize::from(model)).map(|m| &m.name);
            let Some(name) = name.filter(|n| !n.is_empty() && **n != level.map) else {
                continue;
            };
            match coverage(opacity) {
                0 => {}
                255 => drop(models.insert(name.clone())),
                part => drop(faded.insert((name.clone(), part))),
            }
        }
        models.extend(level.beam_kinds().map(|kind| kind.model().to_owned()));
        let colours: BTreeSet<[u8; 2]> = level.worn().map(rows).collect();
        Self {
            models: std::iter::once(level.map.clone()).chain(models).collect(),
            colours: colours.into_iter().collect(),
            faded: faded.into_iter().collect(),
            fog: level.changes_fog(),
        }
    }

    /// The same as an import takes it.
    #[must_use]
    pub fn list(&self) -> CastList<'_> {
        CastList {
            models: &self.models,
            colours: &self.colours,
            faded: &self.faded,
            fog: self.fog,
        }
    }
}

/// Coverage in 255ths.
fn coverage(opacity: f32) -> u8 {
    (opacity.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Rows of the palette of shirt and trousers.
fn rows(colours: u8) -> [u8; 2] {
    [colours >> 4, colours & 15]
}

/// Who looks.
#[derive(Clone, Debug, PartialEq)]
pub enum Eye {
    /// The player, with this field of view (as [`Camera::fov_deg`]) and lens.
    Player {
        /// Degrees.
        fov_deg: f32,
        /// As [`Camera::lens`].
        lens: Option<Lens>,
    },
    /// A camera of its own: it sees the player, and no weapon in its hand.
    Free(Camera),
}

impl Eye {
    fn camera(&self, state: &State) -> Camera {
        match self {
            Self::Free(camera) => camera.clone(),
            Self::Player { fov_deg, lens } => Camera {
                name: "player".to_owned(),
                position: state.view.eye,
                pitch_deg: state.view.angles.x,
                yaw_deg: state.view.angles.y,
                roll_deg: state.view.angles.z,
                fov_deg: *fov_deg,
                lens: *lens,
            },
        }
    }
}

/// The moment `state` of `level` on a stage with its cast.
#[must_use]
pub fn frame(state: &State, level: &Level, scene: &Scene, cast: &Cast, eye: &Eye) -> Frame {
    let camera = eye.camera(state);
    let mut show = Showing {
        state,
        level,
        scene,
        cast,
        camera: &camera,
        instances: scene.instances.get(..1).unwrap_or_default().to_vec(),
    };
    let is_player = matches!(eye, Eye::Player { .. });
    for (i, still) in level.statics.iter().take(state.statics).enumerate() {
        let id = identity(STATIC, i as u64, 0.0);
        show.entity(&still.entity(i, level), SeenBy::ALL, id);
    }
    let lit: Vec<u16> = state.lights.iter().map(|l| l.entity).collect();
    for entity in &state.entities {
        let carries = lit.contains(&entity.number);
        let is_self = is_player && entity.number == state.view.entity;
        let seen_by = match (is_self, carries) {
            // In play the player looks out of its own head; afterwards the camera stands beside it.
            (true, true) => continue,
            (true, false) if state.view.intermission == 0 => SeenBy::OTHERS,
            (true, false) => continue,
            (false, true) => SeenBy::CAMERA,
            (false, false) => SeenBy::ALL,
        };
        // Another one after a jump: what was there did not move here.
        let id = identity(MOVING, entity.number.into(), entity.since);
        show.entity(entity, seen_by, id);
    }
    state.beams.iter().for_each(|beam| show.beam(beam));
    if is_player {
        show.view_model();
    }
    let mut lights: Vec<PointLight> = state.lights.iter().map(sphere).collect();
    lights.extend(state.beams.iter().flat_map(along));
    let instances = show.instances;
    let (loose, drifts) = dots(&state.particles, &camera, cast.palette);
    Frame {
        time: state.clock as f32,
        instances,
        loose,
        drifts,
        lights,
        styles: styles(state, scene),
        fog: fog(state, scene, cast.fog),
        before: None,
        camera,
    }
}

/// Brightness of the light styles by number: the demo's, but for those that were set for the scene.
fn styles(state: &State, scene: &Scene) -> Vec<f32> {
    let mut styles: Vec<f32> = state.styles.iter().map(|s| s.max(0.0)).collect();
    for &(number, brightness) in &scene.set_styles {
        let number = usize::from(number);
        if styles.len() <= number {
            // Styles that a demo does not speak of have a brightness of 1.
            styles.resize(number + 1, 1.0);
        }
        styles[number] = brightness;
    }
    styles
}

const MOVING: u64 = 1;
const STATIC: u64 = 2;
const WEAPON: u64 = 3;

/// Who an instance is from one frame to the next, since a moment.
fn identity(kind: u64, number: u64, since: f64) -> u64 {
    kind << 60 | (number & 0xf_ffff) << 40 | since.to_bits() >> 24
}

/// The same of one of its surfaces.
fn part_of(id: u64, surface: usize) -> u64 {
    id ^ (surface as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

struct Showing<'a> {
    state: &'a State,
    level: &'a Level,
    scene: &'a Scene,
    cast: &'a Cast,
    camera: &'a Camera,
    instances: Vec<Instance>,
}

impl Showing<'_> {
    fn entity(&mut self, entity: &Entity, seen_by: SeenBy, id: u64) {
        let name = self.level.models.get(usize::from(entity.model));
        let Some(name) = name.map(|m| m.name.as_str()) else {
            return;
        };
        let part = coverage(entity.alpha);
        let model = match part {
            255 => self.cast.models.get(name),
            _ => self.cast.faded.get(&(name.to_owned(), part)),
        };
        let angles = entity.angles.to_array();
        let clock = self.state.clock;
        let time = |is_random: bool| {
            clock
                + if is_random {
                    f64::from(entity.phase)
                } else {
                    0.0
                }
        };
        match model {
            None | Some(CastModel::Level) => {}
            Some(CastModel::Brush { meshes, within }) => {
                let [pitch, yaw, roll] = angles.map(f32::to_radians);
                let turn = Quat::from_rotation_z(yaw)
                    * Quat::from_rotation_y(pitch)
                    * Quat::from_rotation_x(roll);
                let scale = Vec3::splat(entity.scale);
                let place =
                    Affine3A::from_scale_rotation_translation(scale, turn, entity.origin) * *within;
                let mesh = meshes[usize::from(entity.frame.to != 0)];
                self.instances.push(Instance {
                    id,
                    seen_by,
                    ..Instance::new(mesh, place, name)
                });
            }
            Some(alias @ CastModel::Alias { .. }) => {
                let place = alias::placement(entity.origin, angles, entity.scale);
                let skin = usize::from(entity.skin);
                let worn = entity.colours.filter(|_| part == 255);
                let worn = worn.and_then(|c| self.cast.coloured(name, skin, rows(c)));
                for (surface, (mesh, model)) in alias.surfaces().enumerate() {
                    let time = time(model.random_start);
                    let instance = posed(mesh, model, place, entity.frame, entity.skin, time);
                    self.instances.push(Instance {
                        id: part_of(id, surface),
                        seen_by: self.luminous(name, entity.origin, seen_by),
                        name: name.to_owned(),
                        material: worn.or(instance.material),
                        ..instance
                    });
                }
            }
            Some(CastModel::Sprite { meshes, model }) => {
                let stance = Stance {
                    kind: model.kind,
                    origin: entity.origin,
                    angles_deg: angles,
                    scale: entity.scale,
                };
                let side = sprite::direction_deg(&stance, self.camera);
                let frame = usize::from(entity.frame.to);
                let quad = model.quad(frame, time(model.random_start), side);
                if let Some(mesh) = meshes.get(quad).copied().flatten() {
                    let place = sprite::placement(&stance, self.camera);
                    self.instances.push(Instance {
                        id,
                        seen_by: SeenBy::CAMERA,
                        ..Instance::new(mesh, place, name)
                    });
                }
            }
        }
    }

    /// Who sees a flame or bolt: the camera alone, where a light of the level stands for its light.
    fn luminous(&self, file: &str, origin: Vec3, seen_by: SeenBy) -> SeenBy {
        let near = |l: &PointLight| l.position.distance(origin) <= LAMP_REACH;
        if alias::is_luminous(file) && self.scene.lights.iter().any(near) {
            SeenBy::CAMERA
        } else {
            seen_by
        }
    }

    fn beam(&mut self, beam: &Beam) {
        let file = beam.kind.model();
        let Some(bolt) = self.cast.models.get(file) else {
            return;
        };
        for (number, part) in beam.parts().enumerate() {
            let id = beam.part_id(number);
            let place = alias::placement(part.origin, part.angles.to_array(), 1.0);
            let frame = FrameBlend::default();
            for (surface, (mesh, model)) in bolt.surfaces().enumerate() {
                self.instances.push(Instance {
                    id: part_of(id, surface),
                    seen_by: SeenBy::CAMERA,
                    name: file.to_owned(),
                    ..posed(mesh, model, place, frame, 0, self.state.clock)
                });
            }
        }
    }

    /// The weapon in hand, made small about the eye, which does not change its picture: so it is inside
    /// the player, and sticks in no wall.
    fn view_model(&mut self) {
        /// Farthest that it may reach from the eye, units: less than a player is wide.
        const REACH: f32 = 12.0;
        let Some(weapon) = &self.state.view_model else {
            return;
        };
        let name = self.level.models.get(usize::from(weapon.model));
        let Some(name) = name.map(|m| m.name.as_str()) else {
            return;
        };
        let Some(in_hand) = self.cast.models.get(name) else {
            return;
        };
        let shapes = in_hand
            .surfaces()
            .filter_map(|(mesh, _)| self.scene.meshes.get(mesh));
        // Of all poses, so that its size does not change while it moves.
        let all = shapes.flat_map(|s| s.poses.iter().flatten().chain(&s.positions));
        let radius = all.map(|p| p.length()).fold(0.0, f32::max);
        let eye = self.camera.position;
        let farthest = radius + weapon.origin.distance(eye);
        let small = (REACH / farthest.max(REACH)).min(1.0);
        let shrink = Affine3A::from_translation(eye)
            * Affine3A::from_scale(Vec3::splat(small))
            * Affine3A::from_translation(-eye);
        let place = shrink * alias::placement(weapon.origin, weapon.angles.to_array(), 1.0);
        let id = identity(WEAPON, weapon.model.into(), 0.0);
        for (surface, (mesh, model)) in in_hand.surfaces().enumerate() {
            self.instances.push(Instance {
                id: part_of(id, surface),
                seen_by: SeenBy::CAMERA,
                name: name.to_owned(),
                ..posed(mesh, model, place, weapon.frame, 0, self.state.clock)
            });
        }
    }
}

/// An alias model in a pose and a skin.
fn posed(
    mesh: usize,
    model: &AliasModel,
    place: Affine3A,
    frame: FrameBlend,
    skin: u16,
    time: f64,
) -> Instance {
    let (from, to) = (usize::from(frame.from), usize::from(frame.to));
    Instance {
        pose: model.between(from, to, frame.fraction, time),
        material: Some(model.skin(usize::from(skin), time)),
        ..Instance::new(mesh, place, "")
    }
}

/// The fog that the server has asked for, or else the level's.
fn fog(state: &State, scene: &Scene, level: FogKeys) -> Option<Fog> {
    let Some(asked) = state.fog.filter(|_| scene.clear_sky.is_some()) else {
        return scene.fog;
    };
    let [r, g, b] = level.color;
    let [density, r, g, b] = asked.in_level([level.density, r, g, b]);
    FogKeys::new(density, [r, g, b]).medium()
}

/// A light as a sphere whose irradiance is that of the engine's light where that is steepest: value
/// v = reach - distance at half the reach, of which 128 show a texture as it is (as those of the light
/// compilers without falloff by the squared distance).
fn sphere(light: &DynamicLight) -> PointLight {
    let (tint, radius) = match light.kind {
        LightKind::Explosion => (Vec3::new(1.0, 0.6, 0.3), 8.0),
        LightKind::Rocket => (Vec3::new(1.0, 0.6, 0.3), 4.0),
        LightKind::Flash => (Vec3::new(1.0, 0.8, 0.5), 4.0),
        LightKind::Bright | LightKind::Dim => (Vec3::ONE, 6.0),
    };
    PointLight {
        position: light.at,
        radius,
        intensity: tint * (PI * light.reach.max(0.0).powi(3) / 1024.0),
        ..PointLight::default()
    }
}

/// The light of a bolt: spheres along it that light a wall beside it, 32 units away, as much as 200 of
/// a lightmap.
fn along(beam: &Beam) -> impl Iterator<Item = PointLight> + use<> {
    /// Distance from one to the next.
    const SPACING: f32 = 64.0;
    const MOST: usize = 32;
    let way = beam.end - beam.start;
    let count = ((way.length() / SPACING).ceil() as usize).min(MOST);
    let step = way / count.max(1) as f32;
    let start = beam.start;
    // A row of intensities I, s apart, gives 2 I / (s d) at the distance d.
    let irradiance = IRRADIANCE_PER_VALUE * 200.0;
    let intensity = irradiance * step.length() * 32.0 / 2.0;
    (0..count).map(move |i| PointLight {
        position: start + step * (i as f32 + 0.5),
        radius: 4.0,
        intensity: Vec3::new(0.7, 0.8, 1.0) * intensity,
        ..PointLight::default()
    })
}

/// Particles as hexagons that face the camera.
fn dots(particles: &[Particle], camera: &Camera, material: MaterialId) -> (Mesh, Vec<Drift>) {
    const CORNERS: u32 = 6;
    /// Radius up to this depth; beyond, particles shrink less than things do.
    const RADIUS: f32 = 0.5;
    const NEAR: f32 = 20.0;
    const GROWTH: f32 = 0.004;
    let basis = camera.view_basis(1, 1);
    let [forward, right, up] =
        [basis.forward, basis.right, basis.up].map(|a| a.normalize().as_vec3());
    let corners: [Vec3; CORNERS as usize] = std::array::from_fn(|i| {
        let (sin, cos) = (PI / 3.0 * i as f32).sin_cos();
        right * cos + up * sin
    });
    let mut mesh = Mesh {
        name: "particles".to_owned(),
        positions: Vec::with_capacity(particles.len() * CORNERS as usize),
        triangles: Vec::with_capacity(particles.len() * 4),
        ..Mesh::default()
    };
    let mut drifts = Vec::with_capacity(mesh.positions.capacity());
    for particle in particles {
        let depth = (particle.at - camera.position).dot(forward);
        if !particle.at.is_finite() || depth <= 0.0 {
            continue;
        }
        let grown = if depth < NEAR {
            1.0
        } else {
            1.0 + GROWTH * depth
        };
        let first = mesh.positions.len() as u32;
        let at = |c: &Vec3| particle.at + *c * (RADIUS * grown);
        mesh.positions.extend(corners.iter().map(at));
        drifts.extend((0..CORNERS as usize).map(|corner| Drift {
            id: part_of(particle.id, corner),
            velocity: particle.velocity,
        }));
        let [u, v] = Cast::palette_uv(particle.colour).map(|x| x - 0.25);
        for i in 1..CORNERS - 1 {
            mesh.triangles.push(Triangle {
                vertices: [first, first + i, first + i + 1],
                // Within the texel of the colour, and with an area.
                uv: [[u, v], [u + 0.5, v], [u, v + 0.5]],
                normal: -forward,
                material,
                face: 0,
            });
        }
    }
    mesh.first_see_through = mesh.triangles.len();
    (mesh, drifts)
}
