//! One moment of a scene in which things move.

use crate::camera::Camera;
use crate::light::PointLight;
use crate::mesh::{Instance, Mesh};

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
    /// Lights of this moment alone, in addition to those of the scene: spheres with all their
    /// brightness in their intensity.
    pub lights: Vec<PointLight>,
    /// Brightness of the light styles by number, which the scene's own lights have in this moment.
    /// Styles beyond its end have a brightness of 1.
    pub styles: Vec<f32>,
}
