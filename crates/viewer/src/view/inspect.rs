//! What is at a pixel, and where its light comes from: found on the processor, beside the frame loop.

use super::entities;
use super::looking::survey::{NONE, Probes, Subject, leaf_at};
use bsp::bsp::contents;
use egui::{Color32, ColorImage};
use reference::probe::{Luminary, Probe, Seen, Share};
use scene::{Camera, Material, Scene, Texture};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

/// Shadow rays that look for the lights of a point: the strongest then get some of their own.
pub const SAMPLES: u32 = 1 << 14;
/// Lights that are listed.
const LISTED: usize = 40;

/// All about what one pixel shows.
#[derive(Clone, Debug)]
pub struct Report {
    /// The pixel, as shares of the picture from the left and from the top.
    pub at: [f64; 2],
    /// Who looked.
    pub camera: Camera,
    /// What its ray met.
    pub seen: Seen,
    /// Name of the texture.
    pub texture: String,
    /// The texture, and its emitting texels on the darkened rest, if it has some.
    pub pictures: [Option<ColorImage>; 2],
    /// Share of its texels that emit.
    pub emitting: f32,
    /// Number of the entity, and its keys.
    pub entity: Option<(usize, Vec<(String, String)>)>,
    /// The leaf in front of it.
    pub leaf: Option<u32>,
    /// What fills that leaf.
    pub contents: &'static str,
    /// Luminance of the light that reaches it directly, and its standard error.
    pub total: [f64; 2],
    /// Where that comes from, the strongest first.
    pub lights: Vec<Light>,
    /// How many there are besides.
    pub more: usize,
}

/// A light that reaches the point.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// What it is.
    pub name: String,
    /// Number of its light style.
    pub style: u16,
    /// Share of the light at the point, and its standard error, 0 to 1.
    pub share: [f64; 2],
    /// Irradiance over pi, linear RGB.
    pub light: [f32; 3],
    /// Where it is, world space; `None` of what is far away.
    pub at: Option<[f32; 3]>,
}

/// A question under way.
pub struct Inspection {
    answer: Receiver<Result<Option<Report>, String>>,
}

impl Inspection {
    /// Asks what a point of the picture shows, given as shares of it from the left and from the top.
    #[must_use]
    pub fn start(subject: Subject, at: [f64; 2], probes: &Arc<Probes>) -> Self {
        let (sender, answer) = channel();
        let probes = Arc::clone(probes);
        std::thread::spawn(move || {
            let report = probes
                .of(&subject)
                .map(|probe| inspect(&probe, &subject, at));
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(report);
        });
        Self { answer }
    }

    /// The answer, once it is there: `None` in it where there is nothing at the pixel.
    pub fn poll(&self) -> Option<Result<Option<Report>, String>> {
        self.answer.try_recv().ok()
    }
}

fn inspect(probe: &Probe, subject: &Subject, at: [f64; 2]) -> Option<Report> {
    let size = subject.size;
    let pixel = [0, 1].map(|i| at[i] * f64::from(size[i]));
    let seen = probe.look(&subject.camera, size, pixel)?;
    let (scene, level) = (probe.scene(), &subject.loaded.level);
    let material = &scene.materials[seen.material.0 as usize];
    let (base, glow, emitting) = pictures(scene, material);
    let instances = (subject.frame.as_ref()).map_or(&scene.instances, |f| &f.instances);
    let entity = seen.instance.and_then(|i| {
        let numbers = entities::of_instances(instances, &scene.meshes, level);
        let number = numbers.get(i).copied().filter(|&n| n != NONE)? as usize;
        let keys = level.entities.get(number)?.iter();
        let keys = keys.map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
        Some((number, keys))
    });
    let leaf = leaf_at(&level.bsp, seen.position + seen.normal);
    let found = probe.lights(&seen, SAMPLES, 0);
    let whole: f64 = found.shares.iter().map(|s| s.luminance.abs()).sum();
    let lights = found.shares.iter().take(LISTED).map(|share| Light {
        name: name_of(share, probe, subject),
        style: share.style,
        share: [share.luminance, share.error].map(|v| v / whole.max(f64::MIN_POSITIVE)),
        light: share.light.as_vec3().to_array(),
        at: match share.luminary {
            Luminary::Sun(_) | Luminary::Surface(_) => None,
            _ => Some(share.at.as_vec3().to_array()),
        },
    });
    Some(Report {
        at,
        camera: subject.camera.clone(),
        texture: material.name.clone(),
        pictures: [base, glow],
        emitting,
        entity,
        leaf: (leaf != NONE).then_some(leaf),
        contents: contents_of(level.bsp.leafs.get(leaf as usize).map(|l| l.contents)),
        total: found.total,
        lights: lights.collect(),
        more: found.shares.len().saturating_sub(LISTED),
        seen,
    })
}

/// What the light is called, for people.
fn name_of(share: &Share, probe: &Probe, subject: &Subject) -> String {
    let (scene, level) = (probe.scene(), &subject.loaded.level);
    let material = |id: scene::MaterialId| scene.materials[id.0 as usize].name.as_str();
    match share.luminary {
        Luminary::Lamp(_) => match entities::lamp_at(level, share.at.as_vec3(), share.style) {
            Some(number) => {
                let entity = &level.entities[number];
                format!("{} (entity {number})", entity.classname())
            }
            None => "lamp".into(),
        },
        Luminary::Moving(number) => format!("light {number} of the demo"),
        Luminary::Sun(number) => format!("sun {number}"),
        Luminary::Surface(id) => material(id).to_owned(),
        Luminary::Texels { instance, number } => {
            let emitter = match instance {
                None => scene.emitters.list.get(number as usize),
                Some(_) => None,
            };
            let Some(emitter) = emitter else {
                return format!("texels of what moves ({number})");
            };
            let source = scene.emitters.sources.get(emitter.first_source as usize);
            let face = source.and_then(|s| {
                let instance = scene.instances.get(s.instance as usize)?;
                let mesh = &scene.meshes[instance.mesh];
                mesh.triangles.get(s.triangle as usize).map(|t| t.face)
            });
            let size = match emitter.shape {
                scene::emitter::Shape::Texels {
                    rectangle: [x0, y0, x1, y1],
                    ..
                } => {
                    format!("{} x {} texels", x1 - x0, y1 - y0)
                }
                scene::emitter::Shape::Part { .. } => "a part".into(),
            };
            let face = face.map_or(String::new(), |f| format!(" of face {f}"));
            format!("{}: {size}{face}", material(emitter.material))
        }
    }
}

/// The base texture and its emitting texels as pictures, and the share of texels that emit.
fn pictures(scene: &Scene, material: &Material) -> (Option<ColorImage>, Option<ColorImage>, f32) {
    let texture = |id: scene::TextureId| scene.textures.get(id.0 as usize);
    let picture = |t: &Texture, shade: &dyn Fn(usize, [u8; 4]) -> Color32| {
        let size = [t.width as usize, t.height as usize];
        let pixels = (t.rgba.iter().enumerate()).map(|(i, &texel)| shade(i, texel));
        ColorImage::new(size, pixels.collect())
    };
    let plain = |_: usize, [r, g, b, a]: [u8; 4]| Color32::from_rgba_unmultiplied(r, g, b, a);
    let Some(base) = texture(material.base) else {
        return (None, None, 0.0);
    };
    let Some(glow) = material.emission.and_then(texture) else {
        return (Some(picture(base, &plain)), None, 0.0);
    };
    let shines = |[r, g, b, _]: [u8; 4]| r.max(g).max(b) > 0;
    let share =
        glow.rgba.iter().filter(|t| shines(**t)).count() as f32 / glow.rgba.len().max(1) as f32;
    let same = (base.width, base.height) == (glow.width, glow.height);
    let emitting = picture(glow, &|i, texel| {
        if shines(texel) {
            return plain(i, texel);
        }
        // The rest as a hint of where on the texture it is.
        let [r, g, b, _] = base
            .rgba
            .get(i)
            .copied()
            .filter(|_| same)
            .unwrap_or_default();
        Color32::from_rgb(r / 5, g / 5, b / 5)
    });
    (
        Some(picture(base, &plain)),
        (share > 0.0).then_some(emitting),
        share,
    )
}

fn contents_of(number: Option<i32>) -> &'static str {
    match number.map(contents::base) {
        Some(contents::EMPTY) => "air",
        Some(contents::SOLID) => "solid",
        Some(contents::WATER) => "water",
        Some(contents::SLIME) => "slime",
        Some(contents::LAVA) => "lava",
        Some(contents::SKY) => "sky",
        Some(_) => "something else",
        None => "nothing known",
    }
}
