//! What the rays through all pixels meet, found on the processor beside the frame loop: numbers that the
//! renderer has no layer for.

use crate::level::Loaded;
use bsp::Bsp;
use rayon::prelude::*;
use reference::probe::{Probe, Seen};
use scene::import::{ImportOptions, Lighting};
use scene::{Camera, Frame, Scene};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// No such number.
pub const NONE: u32 = u32::MAX;
/// Most pixels that are looked at: larger pictures have one ray for several.
const MOST_PIXELS: u32 = 1 << 20;

/// What a pixel's ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Number of the face in the file, or [`NONE`].
    pub face: u32,
    /// Number of the instance, or [`NONE`].
    pub instance: u32,
    /// Leaf of the level in front of it, or [`NONE`].
    pub leaf: u32,
    /// Number of the emitter, or [`NONE`].
    pub emitter: u32,
    /// Baked light, where 1 shows the texture as it is stored, and what that makes of the surface; linear RGB.
    pub baked: Option<[[f32; 3]; 2]>,
}

const NOTHING: Met = Met {
    face: NONE,
    instance: NONE,
    leaf: NONE,
    emitter: NONE,
    baked: None,
};

/// What the rays of a picture met.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// By pixel, rows from the top.
    pub met: Vec<Met>,
    /// Leaf that the camera is in.
    pub leaf: Option<u32>,
    /// What was asked.
    pub key: Key,
    /// Tells it from others.
    pub(super) id: u64,
}

impl Survey {
    /// What the ray met that went through a pixel of a picture of another size.
    #[must_use]
    pub fn at(&self, pixel: [u32; 2], size: [u32; 2]) -> Met {
        let scaled = |i: usize| {
            (u64::from(pixel[i]) * u64::from(self.size[i]) / u64::from(size[i].max(1))) as u32
        };
        let [x, y] = [scaled(0), scaled(1)];
        let index = y as usize * self.size[0] as usize + x as usize;
        self.met.get(index).copied().unwrap_or(NOTHING)
    }
}

/// Tells a scene from all others: while this is held, no scene that comes later has its place in memory.
#[derive(Clone, Debug)]
pub struct SceneId(Weak<Scene>);

impl SceneId {
    /// That of a scene.
    #[must_use]
    pub fn of(scene: &Arc<Scene>) -> Self {
        Self(Arc::downgrade(scene))
    }
}

impl PartialEq for SceneId {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}

/// What a survey depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// The scene.
    pub scene: SceneId,
    /// Who looks.
    pub camera: Camera,
    /// Level time, seconds.
    pub time: f32,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Whether baked light is wanted.
    pub baked: bool,
}

/// A scene, and its level time in seconds.
type Moment = (SceneId, f32);

/// What is looked at.
#[derive(Clone)]
pub struct Subject {
    /// What the renderer has.
    pub scene: Arc<Scene>,
    /// The level's files, and how they were imported.
    pub loaded: Arc<Loaded>,
    /// How they were imported.
    pub options: ImportOptions,
    /// The moment of a demo.
    pub frame: Option<Frame>,
    /// Who looks.
    pub camera: Camera,
    /// Level time, seconds.
    pub time: f32,
    /// Pixels of the picture.
    pub size: [u32; 2],
}

/// The scenes that were made ready for rays last: another question about the same one costs nothing more.
#[derive(Default)]
pub struct Probes {
    /// With the level time that it was made ready for: light styles and textures are those of a moment.
    scene: Mutex<Option<(f32, Arc<Probe>)>>,
    baked: Mutex<Option<(Moment, Arc<Probe>)>>,
}

impl Probes {
    /// A scene to be asked.
    ///
    /// # Errors
    /// A sentence when the scene contradicts itself.
    pub fn of(&self, subject: &Subject) -> Result<Arc<Probe>, String> {
        let mut last = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |(time, probe): &&(f32, Arc<Probe>)| {
            *time == subject.time && Arc::ptr_eq(probe.scene(), &subject.scene)
        };
        if subject.frame.is_none()
            && let Some((_, probe)) = last.as_ref().filter(same)
        {
            return Ok(Arc::clone(probe));
        }
        let scene = Arc::clone(&subject.scene);
        let mut probe = Probe::new(scene, subject.time).map_err(|e| e.to_string())?;
        if let Some(frame) = &subject.frame {
            probe.show(frame).map_err(|e| e.to_string())?;
        }
        let probe = Arc::new(probe);
        *last = Some((subject.time, Arc::clone(&probe)));
        Ok(probe)
    }

    /// The same level as its own lightmaps light it. Not of demos.
    fn baked(&self, subject: &Subject) -> Result<Arc<Probe>, String> {
        let mut last = self.baked.lock().unwrap_or_else(PoisonError::into_inner);
        let of: Moment = (SceneId::of(&subject.scene), subject.time);
        if let Some((_, probe)) = last.as_ref().filter(|(asked, _)| *asked == of) {
            return Ok(Arc::clone(probe));
        }
        let options = ImportOptions {
            lighting: Lighting::Lightmap,
            light_lists: false,
            styles_apart: false,
            frames: false,
            ..subject.options.clone()
        };
        let scene = (subject.loaded.import(&options)).map_err(|e| format!("{e:#}"))?;
        let probe = Probe::new(Arc::new(scene), subject.time).map_err(|e| e.to_string())?;
        let probe = Arc::new(probe);
        *last = Some((of, Arc::clone(&probe)));
        Ok(probe)
    }

    /// Sends a ray through every pixel.
    ///
    /// # Errors
    /// A sentence when the level can't be looked at so.
    pub fn survey(&self, subject: &Subject, key: Key) -> Result<Survey, String> {
        let probe = self.of(subject)?;
        let baked = match (key.baked, &subject.frame) {
            (false, _) => None,
            (true, None) => Some(self.baked(subject)?),
            (true, Some(_)) => return Err("baked light is not looked at in demos".into()),
        };
        let bsp = &subject.loaded.level.bsp;
        let mut size = subject.size;
        while u64::from(size[0]) * u64::from(size[1]) > u64::from(MOST_PIXELS) {
            size = size.map(|n| n.div_ceil(2));
        }
        let camera = &subject.camera;
        let pixel = |i: u32| {
            let at = [i % size[0], i / size[0]].map(|n| f64::from(n) + 0.5);
            let mut met = (probe.look(camera, size, at)).map_or(NOTHING, |seen| met(&seen, bsp));
            if let Some(baked) = &baked
                && let Some(seen) = baked.look(camera, size, at)
            {
                let both = [seen.baked, seen.emitted];
                met.baked = Some(both.map(|v| v.as_vec3().to_array()));
            }
            met
        };
        let count = size[0] * size[1];
        let leaf = leaf_at(bsp, camera.position.as_dvec3());
        Ok(Survey {
            met: (0..count).into_par_iter().map(pixel).collect(),
            leaf: (leaf != NONE).then_some(leaf),
            size,
            key,
            id: super::fresh(),
        })
    }
}

fn met(seen: &Seen, bsp: &Bsp) -> Met {
    Met {
        face: seen.face,
        instance: seen.instance.map_or(NONE, |i| i as u32),
        // A little before the surface: on it a point is on either side.
        leaf: leaf_at(bsp, seen.position + seen.normal),
        emitter: seen.emitter.unwrap_or(NONE),
        baked: None,
    }
}

/// The leaf that a point is in.
#[must_use]
pub fn leaf_at(bsp: &Bsp, point: glam::DVec3) -> u32 {
    let leaf = bsp.point_leaf(0, point.as_vec3().to_array());
    leaf.map_or(NONE, |leaf| leaf as u32)
}
