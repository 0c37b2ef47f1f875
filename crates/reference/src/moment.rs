//! What is where at a moment: the parts of a world that stands still, and of one that frames are shown
//! of.

use crate::Error;
use crate::bvh::{MAX_TRIANGLES, Tree};
use crate::part::{Emitting, Part, Placed, Sight};
use crate::world::{Place, World};
use glam::Affine3A;
use rayon::prelude::*;
use scene::emitter::{Emitters, MovingLight, MovingLights};
use scene::{Frame, Instance, Mesh, Scene, SeenBy};
use std::sync::Arc;

impl World {
    /// Places the instances of a scene of which no frames are shown: all that everyone sees in one part.
    pub fn stand_still(&mut self) -> Result<(), Error> {
        let scene = self.scene.clone();
        let is_common = |i: &&Instance| i.seen_by == SeenBy::ALL;
        let common: Vec<Placed<'_>> = (scene
            .instances
            .iter()
            .filter(is_common)
            .map(|i| placed(&scene, i)))
        .collect();
        self.parts = vec![Arc::new(Part::new(&common, Emitting::Own, Sight::ALL)?)];
        // By instance, its part and where its triangles begin there.
        let (mut places, mut begin) = (Vec::new(), 0);
        for instance in &scene.instances {
            if instance.seen_by == SeenBy::ALL {
                places.push((0, begin));
                begin += scene.meshes[instance.mesh].triangles.len();
            } else {
                places.push((self.parts.len(), 0));
                let seen = Sight::of(instance.seen_by);
                let part = Part::new(&[placed(&scene, instance)], Emitting::Own, seen)?;
                self.parts.push(Arc::new(part));
            }
        }
        self.number_own_sources(&places);
        self.gather();
        Ok(())
    }

    /// Shows a frame: places what is not where it was.
    pub fn show(&mut self, frame: &Frame) -> Result<(), Error> {
        let scene = self.scene.clone();
        frame.check(&scene).map_err(Error::InvalidScene)?;
        let triangles = |i: &Instance| scene.meshes[i.mesh].triangles.len();
        let count = frame.instances.iter().map(triangles).sum::<usize>();
        if count + frame.loose.triangles.len() > MAX_TRIANGLES {
            return Err(Error::InvalidScene("it has more than 2^27 triangles"));
        }
        if self.parts.is_empty() {
            let world = placed(&scene, &scene.instances[0]);
            self.parts = vec![Arc::new(Part::new(&[world], Emitting::Own, Sight::ALL)?)];
            self.number_own_sources(&[(0, 0)]);
        }
        let before: Vec<(&Instance, &Arc<Part>)> =
            (self.shown.iter().zip(&self.parts[1..])).collect();
        let same = |i: usize, instance: &Instance| {
            let is_it = |(old, _): &&(&Instance, _)| looks_alike(old, instance);
            let at_its_place = before.get(i).filter(is_it);
            (at_its_place.or_else(|| before.iter().find(is_it))).map(|(_, part)| (*part).clone())
        };
        let moving = &frame.instances[1..];
        let parts: Result<Vec<Arc<Part>>, Error> = (moving.par_iter().enumerate())
            .map(|(i, instance)| match same(i, instance) {
                Some(part) => Ok(part),
                None => moving_part(&scene, instance).map(Arc::new),
            })
            .collect();
        let mut parts = parts?;
        if !frame.loose.triangles.is_empty() {
            let instance = Instance::new(0, Affine3A::IDENTITY, "");
            let loose: Placed<'_> = (&frame.loose, &instance, None);
            let part = Part::new(&[loose], Emitting::Nothing, Sight::CAMERA)?;
            parts.push(Arc::new(part));
        }
        self.parts.truncate(1);
        self.parts.append(&mut parts);
        self.shown = moving.to_vec();
        self.time = f64::from(frame.time);
        self.looks = scene.looks(frame.time);
        self.fog = frame.fog;
        self.sky = scene.sky_now(frame.fog);
        self.lights = scene.lights_now(&frame.styles);
        self.styles = scene.styles_now(&frame.styles);
        self.frame_lights = frame.lights.clone();
        self.moving = MovingLights::new(&scene, frame);
        self.moving_probabilities = vec![0.0; self.parts.len()];
        for (light, &p) in self.moving.lights.iter().zip(&self.moving.probabilities) {
            if let MovingLight::Instance { number, .. } = *light {
                self.moving_probabilities[number as usize] = f64::from(p);
            }
        }
        self.gather();
        Ok(())
    }

    /// What emits on a part.
    pub fn emitters_of(&self, part: u32) -> Option<&Emitters> {
        match self.parts[part as usize].emitting {
            Emitting::Own => Some(&self.scene.emitters),
            Emitting::List(list) => Some(&self.scene.moving.lists[list as usize]),
            Emitting::Nothing => None,
        }
    }

    /// Where a source of what emits on a part is.
    pub fn source_place(&self, part: u32, source: usize) -> Place {
        let Emitting::List(list) = self.parts[part as usize].emitting else {
            return self.source_places[source];
        };
        let emitters = &self.scene.moving.lists[list as usize];
        let triangle = emitters.sources[source].triangle as usize;
        Place {
            part,
            slot: self.parts[part as usize].slots[triangle],
        }
    }

    /// Numbers the triangles that the scene's own emitters lie on; `places` has by instance its part and
    /// where its triangles begin there.
    fn number_own_sources(&mut self, places: &[(usize, usize)]) {
        self.source_places.clear();
        for (number, source) in (0..).zip(&self.scene.emitters.sources) {
            let (part, begin) = places[source.instance as usize];
            let Some(its) = Arc::get_mut(&mut self.parts[part]) else {
                continue;
            };
            let slot = its.slots[begin + source.triangle as usize];
            its.sources[slot as usize] = number;
            let part = part as u32;
            self.source_places.push(Place { part, slot });
        }
    }

    /// Builds the hierarchy over the parts after the first.
    fn gather(&mut self) {
        let (boxes, numbers): (Vec<_>, Vec<u32>) = (self.parts.iter().zip(0..).skip(1))
            .filter_map(|(part, number)| Some((part.bvh.bounds()?, number)))
            .unzip();
        let (top, order) = Tree::build(&boxes);
        self.top = top;
        self.top_order = order.iter().map(|&i| numbers[i as usize]).collect();
    }
}

fn placed<'a>(scene: &'a Scene, instance: &'a Instance) -> Placed<'a> {
    let mesh: &Mesh = &scene.meshes[instance.mesh];
    let grids = scene
        .baked
        .as_ref()
        .map(|b| b.meshes[instance.mesh].as_slice());
    (mesh, instance, grids)
}

/// The part of an instance that frames move.
fn moving_part(scene: &Scene, instance: &Instance) -> Result<Part, Error> {
    let list = scene.moving.list_of(instance);
    let emitting = list.map_or(Emitting::Nothing, Emitting::List);
    let seen = Sight::of(instance.seen_by);
    let mut part = Part::new(&[placed(scene, instance)], emitting, seen)?;
    if let Some(list) = list {
        let sources = &scene.moving.lists[list as usize].sources;
        for (number, source) in (0..).zip(sources) {
            part.sources[part.slots[source.triangle as usize] as usize] = number;
        }
    }
    Ok(part)
}

/// Whether two instances have the same triangles, whatever they are called.
fn looks_alike(a: &Instance, b: &Instance) -> bool {
    let what = |i: &Instance| (i.mesh, i.pose, i.material, i.seen_by);
    what(a) == what(b) && a.transform == b.transform
}
