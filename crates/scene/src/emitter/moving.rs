//! What emits and does not stay put, and the choice among it at one moment.

use super::{Emitters, alias_table};
use crate::Scene;
use crate::frame::Frame;
use crate::light::PointLight;
use crate::material::{Material, MaterialId, Texture};
use crate::mesh::{Instance, Mesh};
use glam::Affine3A;
use std::collections::HashMap;

/// Least and largest share of the choices that the lights of a frame get, if there are any. By power
/// alone an explosion would be lost among the lamps of a level, most of which are elsewhere.
const SHARE_OF_LIGHTS: [f64; 2] = [0.2, 0.5];
/// The same for moving meshes that emit.
const SHARE_OF_MESHES: [f64; 2] = [0.05, 0.4];

/// What emits on the meshes that frames move, in their own spaces.
#[derive(Clone, Debug, Default)]
pub struct MovingEmitters {
    /// Emitters of a mesh in one skin as if it were the only instance, in its first pose and not
    /// moved: local space, [`super::Source::instance`] is 0. The table is over them alone, there is
    /// no tree.
    pub lists: Vec<Emitters>,
    /// The mesh and the skin of each list.
    pub looks: Vec<(usize, Option<MaterialId>)>,
    numbers: HashMap<(usize, Option<MaterialId>), u32>,
}

impl MovingEmitters {
    /// Lists what emits on every mesh but the first, in its own materials and in each of its skins.
    #[must_use]
    pub fn new(meshes: &[Mesh], materials: &[Material], textures: &[Texture]) -> Self {
        let mut all = Self::default();
        for (number, mesh) in meshes.iter().enumerate().skip(1) {
            let skins = mesh.skins.iter().copied().map(Some);
            for skin in std::iter::once(None).chain(skins) {
                let instance = Instance {
                    material: skin,
                    ..Instance::new(number, Affine3A::IDENTITY, "")
                };
                let mut emitters = Emitters::new(meshes, &[instance], materials, textures);
                let weights: Vec<f64> =
                    (emitters.list.iter().map(|e| f64::from(e.weight))).collect();
                let total: f64 = weights.iter().sum();
                if total > 0.0 && !all.looks.contains(&(number, skin)) {
                    emitters.alias = alias_table(&weights, total);
                    emitters.total_weight = total as f32;
                    all.numbers.insert((number, skin), all.lists.len() as u32);
                    all.looks.push((number, skin));
                    all.lists.push(emitters);
                }
            }
        }
        all
    }

    /// Number of the list of an instance; `None` if it is no light.
    #[must_use]
    pub fn list_of(&self, instance: &Instance) -> Option<u32> {
        let number = self.numbers.get(&(instance.mesh, instance.material))?;
        instance.seen_by.others().then_some(*number)
    }
}

/// A light that does not stay put.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovingLight {
    /// Number among the lights of the frame.
    Point(u32),
    /// Number among the instances of the frame: one of its mesh's emitters is chosen next, by the
    /// table of the list.
    Instance {
        /// Number of the instance.
        number: u32,
        /// Number of its list ([`MovingEmitters::lists`]).
        list: u32,
    },
}

/// The choice among what emits at one moment and does not stay put.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MovingLights {
    /// Probability with which one of these is chosen instead of one of the scene's own lights.
    pub share: f32,
    /// The lights: those of the frame, then instances.
    pub lights: Vec<MovingLight>,
    /// Probability of each among them.
    pub probabilities: Vec<f32>,
    /// Alias table with these probabilities: as in [`Emitters::alias`].
    pub alias: Vec<(f32, u32)>,
}

impl MovingLights {
    /// The choice in a frame of a scene.
    #[must_use]
    pub fn new(scene: &Scene, frame: &Frame) -> Self {
        let points: Vec<f64> = (frame.lights.iter().map(PointLight::weight))
            .map(f64::from)
            .collect();
        let mut lights: Vec<_> = (0..points.len() as u32).map(MovingLight::Point).collect();
        let mut meshes = Vec::new();
        for (number, instance) in (0..).zip(&frame.instances).skip(1) {
            if let Some(list) = scene.moving.list_of(instance) {
                let power = f64::from(scene.moving.lists[list as usize].total_weight);
                meshes.push(power * growth_of_area(instance));
                lights.push(MovingLight::Instance { number, list });
            }
        }
        let (of_points, of_meshes) = (points.iter().sum::<f64>(), meshes.iter().sum::<f64>());
        let own = f64::from(scene.emitters.total_weight);
        let all = own + of_points + of_meshes;
        let share = |of: f64, [least, most]: [f64; 2]| match of > 0.0 {
            true => (of / all).clamp(least, most),
            false => 0.0,
        };
        let for_points = share(of_points, SHARE_OF_LIGHTS);
        let for_meshes = share(of_meshes, SHARE_OF_MESHES);
        let both = for_points + for_meshes;
        if both <= 0.0 {
            return Self::default();
        }
        let part = |of: f64, power: f64, all: f64| if all > 0.0 { of * power / all } else { 0.0 };
        let weights: Vec<f64> = (points.iter().map(|p| part(for_points, *p, of_points)))
            .chain(meshes.iter().map(|p| part(for_meshes, *p, of_meshes)))
            .collect();
        Self {
            share: if own > 0.0 { both as f32 } else { 1.0 },
            probabilities: weights.iter().map(|w| (w / both) as f32).collect(),
            alias: alias_table(&weights, both),
            lights,
        }
    }
}

/// What a transform does to areas, on average over directions; exact if it scales evenly.
fn growth_of_area(instance: &Instance) -> f64 {
    let determinant = f64::from(instance.transform.matrix3.determinant().abs());
    determinant.powf(2.0 / 3.0)
}
