//! One moment of a scene in which things move.

use crate::camera::Camera;
use crate::fog::Fog;
use crate::light::PointLight;
use crate::mesh::{Instance, Mesh, PoseBlend};
use crate::{MovingEmitters, Scene};
use glam::{Affine3A, Vec3};
use std::collections::HashMap;

/// One moment of a scene: all that can differ from another moment of it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Who looks.
    pub camera: Camera,
    /// Level time in seconds, for warped and scrolling textures.
    pub time: f32,
    /// Stands for all of `Scene::instances`. The first one is the static world and is the same in all
    /// frames.
    pub instances: Vec<Instance>,
    /// Triangles of this moment alone, world space, met by camera rays and never chosen as lights:
    /// particles. They may be others in every frame.
    pub loose: Mesh,
    /// By vertex of [`Frame::loose`], how it moves; empty if all stand still.
    pub drifts: Vec<Drift>,
    /// Lights of this moment alone, in addition to those of the scene: spheres with all their
    /// brightness in their intensity.
    pub lights: Vec<PointLight>,
    /// Brightness of the light styles by number, which the scene's own lights have in this moment.
    /// Styles beyond its end have a brightness of 1.
    pub styles: Vec<f32>,
    /// Fog in all of space.
    pub fog: Option<Fog>,
    /// What the picture before showed. Without it nothing moves in the motion layer; it costs time, and is
    /// for pictures that have this layer.
    pub before: Option<Box<Before>>,
}

/// How a vertex of a frame's loose triangles moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// What it is from one frame to the next; 0 for no one in particular.
    pub id: u64,
    /// Units per second of [`Frame::time`]: says where it would have been if the frame before has not got it.
    pub velocity: Vec3,
}

/// What the picture before a frame showed.
#[derive(Clone, Debug)]
pub struct Before {
    /// Who looked.
    pub camera: Camera,
    /// By instance of the frame, where it was; `None` of what is new, and of what did not move.
    pub instances: Vec<Option<Past>>,
    /// By vertex of the frame's loose triangles, where it was, world space; empty if all stood still.
    pub loose: Vec<Vec3>,
}

/// Where an instance was, of the same mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    /// As [`Instance::transform`].
    pub transform: Affine3A,
    /// As [`Instance::pose`].
    pub pose: PoseBlend,
}

impl Frame {
    /// Says what the picture before showed: instances are those with the same [`Instance::id`], and loose
    /// vertices those with the same [`Drift::id`].
    pub fn follow(&mut self, before: &Frame) {
        let known: HashMap<u64, &Instance> = (before.instances.iter()).map(|i| (i.id, i)).collect();
        let past = |now: &Instance| {
            let then = known.get(&now.id).filter(|_| now.id != 0)?;
            let has_moved = then.transform != now.transform || then.pose != now.pose;
            (then.mesh == now.mesh && has_moved).then_some(Past {
                transform: then.transform,
                pose: then.pose,
            })
        };
        self.before = Some(Box::new(Before {
            camera: before.camera.clone(),
            instances: self.instances.iter().map(past).collect(),
            loose: self.loose_before(before),
        }));
    }

    /// Where the loose vertices were in the frame before.
    fn loose_before(&self, before: &Frame) -> Vec<Vec3> {
        let places = before.drifts.iter().zip(&before.loose.positions);
        let known: HashMap<u64, Vec3> = places.map(|(drift, &at)| (drift.id, at)).collect();
        let passed = self.time - before.time;
        (self.drifts.iter().zip(&self.loose.positions))
            .map(|(drift, &at)| match known.get(&drift.id) {
                Some(&was) if drift.id != 0 => was,
                _ => at - drift.velocity * passed,
            })
            .collect()
    }

    /// Looks for what contradicts the scene, so that a renderer can believe the rest.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self, scene: &Scene) -> Result<(), &'static str> {
        let ensure = |ok: bool, what| if ok { Ok(()) } else { Err(what) };
        ensure(scene.features.frames, "it was not made for frames")?;
        ensure(
            self.instances.first() == scene.instances.first(),
            "the first instance of a frame is not the static world",
        )?;
        (self.instances.iter()).try_for_each(|instance| scene.check_instance(instance))?;
        ensure(
            self.fog == scene.fog || scene.clear_sky.is_some(),
            "its fog is not the level's",
        )?;
        ensure(
            self.fog.is_none_or(|fog| {
                let share = fog.albedo.clamp(Vec3::ZERO, Vec3::ONE);
                fog.extinction > 0.0 && fog.extinction.is_finite() && fog.albedo == share
            }),
            "fog takes no light, or gives more than it takes",
        )?;
        let vertices = self.loose.positions.len();
        let fits = |length: usize| length == 0 || length == vertices;
        ensure(
            fits(self.drifts.len()),
            "it does not say of each loose vertex how it moves",
        )?;
        if let Some(before) = &self.before {
            ensure(
                fits(before.loose.len()) && before.loose.iter().all(|p| p.is_finite()),
                "it does not say of each loose vertex where it was",
            )?;
            ensure(
                before.instances.len() == self.instances.len(),
                "it does not say of each instance where it was",
            )?;
            ensure(
                before.instances.first().is_none_or(Option::is_none),
                "the static world was elsewhere before",
            )?;
            for (instance, past) in self.instances.iter().zip(&before.instances) {
                if let Some(Past { transform, pose }) = *past {
                    scene.check_instance(&Instance {
                        transform,
                        pose,
                        ..instance.clone()
                    })?;
                }
            }
        }
        ensure(
            self.camera.lens.is_none_or(|lens| lens.is_valid()),
            "a camera's lens is not above 0",
        )?;
        ensure(
            self.loose.triangles.iter().all(|t| {
                (t.material.0 as usize) < scene.materials.len()
                    && t.vertices.iter().all(|&v| (v as usize) < vertices)
            }) && self.loose.first_see_through <= self.loose.triangles.len()
                && self.loose.poses.is_empty(),
            "a loose triangle's vertex or material does not exist",
        )?;
        ensure(
            self.loose.positions.iter().all(|p| p.is_finite()),
            "a loose vertex is not finite",
        )?;
        ensure(
            self.lights.iter().all(|l| {
                let finite = l.position.is_finite() && l.intensity.is_finite();
                l.compiler.is_none() && l.radius > 0.0 && l.radius.is_finite() && finite
            }),
            "a light of a frame is no sphere",
        )?;
        ensure(
            self.styles.iter().all(|s| s.is_finite() && *s >= 0.0),
            "a light style's brightness is negative or not finite",
        )
    }
}

impl Scene {
    /// Makes it a scene that frames are shown of, and completes it: lists what emits on meshes that
    /// frames may move. Its own emitters must be listed on the static world alone
    /// (`Scene::instances[..1]`).
    #[must_use]
    pub fn for_frames(mut self) -> Self {
        self.moving = MovingEmitters::new(&self.meshes, &self.materials, &self.textures);
        self.features.frames = true;
        self.completed()
    }

    /// The moment that the scene holds, as a frame.
    #[must_use]
    pub fn as_frame(&self, camera: &Camera, time: f32) -> Frame {
        Frame {
            camera: camera.clone(),
            time,
            instances: self.instances.clone(),
            loose: Mesh::default(),
            drifts: Vec::new(),
            lights: Vec::new(),
            styles: self.brightness.clone(),
            fog: self.fog,
            before: None,
        }
    }

    /// Looks for what an instance has that the scene lacks.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check_instance(&self, instance: &Instance) -> Result<(), &'static str> {
        let mesh = (self.meshes.get(instance.mesh)).ok_or("an instance's mesh does not exist")?;
        let PoseBlend { from, to, fraction } = instance.pose;
        let poses = mesh.poses.len().max(1) as u64;
        if u64::from(from.max(to)) >= poses || !(0.0..=1.0).contains(&fraction) {
            return Err("an instance's pose does not exist");
        }
        if !instance.transform.is_finite() {
            return Err("an instance's transform is not finite");
        }
        let Some(id) = instance.material else {
            return Ok(());
        };
        let material =
            (self.materials.get(id.0 as usize)).ok_or("an instance's material does not exist")?;
        if material.is_see_through() && mesh.first_see_through > 0 {
            return Err("light passes through an instance's material and not through its mesh");
        }
        Ok(())
    }

    /// Brightness of a light's style that its intensity lacks, with the styles as bright as `styles`
    /// says by number: 1 where the scene's lights have it, and of those styles that the film tells
    /// apart.
    #[must_use]
    pub fn brightness_of(&self, light: &PointLight, styles: &[f32]) -> f32 {
        if self.brightness.is_empty() || self.style_of(light) > 0 {
            return 1.0;
        }
        styles.get(usize::from(light.style)).copied().unwrap_or(1.0)
    }

    /// The scene's lights as bright as their styles are.
    #[must_use]
    pub fn lights_now(&self, styles: &[f32]) -> Vec<PointLight> {
        let now = |light: &PointLight| PointLight {
            intensity: light.intensity * self.brightness_of(light, styles),
            ..*light
        };
        self.lights.iter().map(now).collect()
    }

    /// The light styles that the film tells apart, as bright as `styles` says by number.
    #[must_use]
    pub fn styles_now(&self, styles: &[f32]) -> Vec<crate::LightStyle> {
        let mut now = self.styles.clone();
        for style in now.iter_mut().skip(1) {
            let number = usize::from(style.number);
            style.brightness = styles.get(number).copied().unwrap_or(style.brightness);
        }
        now
    }
}
