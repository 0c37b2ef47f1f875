//! A scene as Mitsuba 3 loads it (`mitsuba scene.xml`), checked with 3.9.1 in its `rgb` variants.

mod ply;
mod shapes;
pub mod sky;
mod texels;
mod xml;

use super::manifest::{self, Exported, Reason};
use super::{Folder, Job, images, safe_name};
use anyhow::Result;
use scene::sky::SkyKind;
use scene::{MaterialId, Texture};
use serde_json::{Map, Value, json};
use shapes::{Kind, Shapes};
use std::io::Write as _;
use std::path::Path;
use xml::{Bsdf, Emitter};

/// Writes the scene into the directory `target`.
///
/// # Errors
/// When the directory cannot be written or must not be replaced; see [`Folder`].
pub fn write(job: &Job<'_>, target: &Path) -> Result<Exported> {
    let mut folder = Folder::create(target)?;
    let scene = job.scene;
    let mut shapes = shapes::shapes(job);
    let mut reasons = std::mem::take(&mut shapes.reasons);
    let mut document = xml::Document::new(job);
    let mut triangles = 0;
    let mut emitters = 0;
    let mut total_weight = 0.0;

    for (kind, shape) in shapes.by_kind.iter().filter(|(_, s)| !s.mesh.is_empty()) {
        let number = document.shapes();
        let (name, bsdf, emitter) = look(job, &shapes, *kind, &mut folder, &mut document)?;
        let file = format!("meshes/{number:03}_{name}.ply");
        let normal = match kind {
            Kind::Sky => shapes.sky_frame.map(|f| f.n.as_vec3().to_array()),
            _ => None,
        };
        folder.write(&file, |out| shape.mesh.write(out, normal))?;
        triangles += shape.mesh.len();
        let emitter = emitter.map(|mut emitter| {
            emitters += 1;
            if let Emitter::Area { radiance, weight } = &mut emitter {
                *weight = shapes::weight(shape, *radiance);
                total_weight += *weight;
            }
            emitter
        });
        document.mesh(&file, &bsdf, emitter.as_ref(), normal.is_none());
    }
    let has_sky = shapes.by_kind.contains_key(&Kind::Sky);
    explain_sky(job, &shapes, has_sky, &mut reasons);
    for light in &scene.lights {
        document.lamp(light, job.settings.camera.position);
        total_weight += f64::from(light.weight());
        emitters += 1;
    }
    explain_lamps(job, &mut reasons);
    if scene.features.gloss || scene.features.normal_maps {
        reasons.push(Reason {
            what: "gloss",
            why:
                "glossy, metallic and bumpy surfaces are Lambertian and flat, with the same albedo"
                    .into(),
            visible: true,
        });
    }
    if scene.features.smooth_normals {
        reasons.push(Reason {
            what: "smooth normals",
            why: "the facets of models are shaded flat".into(),
            visible: true,
        });
    }
    let flames = scene.instances.iter().filter(|i| !i.seen_by.others());
    let flames = flames.count();
    if flames > 0 {
        reasons.push(Reason {
            what: "flames",
            why: format!(
                "{flames} models and sprites that show lamps are left out: in Runelight the camera \
                 alone sees them, and their light is that of light entities"
            ),
            visible: true,
        });
    }
    if scene.features.translucent {
        reasons.push(Reason {
            what: "see-through surfaces",
            why:
                "light passes straight through the part that is not painted; nothing is mirrored, \
                  tinted or absorbed there"
                    .into(),
            visible: true,
        });
    }
    let hidden = scene.instances.iter().filter(|i| !i.seen_by.camera());
    let hidden = hidden.count();
    if hidden > 0 {
        reasons.push(Reason {
            what: "masks",
            why: format!("the camera sees {hidden} models that light alone should see"),
            visible: true,
        });
    }
    if scene.features.fog {
        reasons.push(Reason {
            what: "fog",
            why: "there is no fog: Mitsuba would scatter light in it more than once".into(),
            visible: true,
        });
    }
    if emitters > 0 && total_weight <= 0.0 {
        document.dark_point();
    }
    let counts: Map<String, Value> = [
        ("shapes", json!(document.shapes())),
        ("triangles", json!(triangles)),
        ("emitters", json!(emitters)),
        ("textures", json!(document.pictures())),
    ]
    .into_iter()
    .map(|(name, value)| (name.to_owned(), value))
    .collect();
    let integrator = document.integrator();
    let text = document.finish();
    folder.write("scene.xml", |out| Ok(out.write_all(text.as_bytes())?))?;
    let mut manifest = manifest::describe(job, "mitsuba", &reasons, counts);
    manifest.insert("integrator".into(), integrator.into());
    manifest.insert(
        "offset".into(),
        json!(job.settings.camera.position.to_array()),
    );
    manifest::finish(folder, manifest)
}

/// How a group of triangles looks; writes the pictures it needs that are not there yet.
fn look(
    job: &Job<'_>,
    shapes: &Shapes,
    kind: Kind,
    folder: &mut Folder,
    document: &mut xml::Document,
) -> Result<(String, Bsdf, Option<Emitter>)> {
    let scene = job.scene;
    Ok(match kind {
        Kind::Plain(id) => {
            let bsdf = material(job, id, folder, document)?;
            (safe_name(&scene.materials[id.0 as usize].name), bsdf, None)
        }
        Kind::Glow(scale, glow) => {
            let radiance = shapes::radiance(glow.emission, f32::from_bits(scale));
            let [r, g, b] = glow.emission;
            (
                format!("glow-{r:02x}{g:02x}{b:02x}"),
                Bsdf::Flat(shapes::albedo(glow.base)),
                Some(Emitter::Area {
                    radiance,
                    weight: 0.0,
                }),
            )
        }
        Kind::Picture(id) => {
            let bsdf = material(job, id, folder, document)?;
            let material = &scene.materials[id.0 as usize];
            let name = safe_name(&material.name);
            let file = format!("textures/{:03}_{name}_emission.exr", id.0);
            if let Some(emission) = material.emission {
                let texture = &scene.textures[emission.0 as usize];
                let scale = material.emission_scale;
                write_linear(folder, &file, texture, |t| shapes::radiance(t, scale))?;
                document.count_picture();
            }
            (name, bsdf, Some(Emitter::Picture { file }))
        }
        Kind::Sky => {
            let emitter = match (scene.sky.kind, &shapes.sky_frame) {
                (SkyKind::Flat(radiance), _) if !sky::has_directions(&scene.sky) => {
                    Some(Emitter::Area {
                        radiance: (radiance * scene.sky.scale[0] + scene.sky.veil[0]).to_array(),
                        weight: 0.0,
                    })
                }
                (_, Some(frame)) => {
                    let file = "textures/sky.exr".to_owned();
                    let pixels = sky::image(scene, job.settings.time, frame).unwrap_or_default();
                    folder.write(&file, |out| {
                        images::write_exr(out, &pixels, sky::WIDTH, sky::WIDTH / 2)
                    })?;
                    document.count_picture();
                    Some(Emitter::Direction { file })
                }
                _ => None,
            };
            ("sky".into(), Bsdf::Flat([0.0; 3]), emitter)
        }
    })
}

/// The textured BSDF of a material, which is written once.
fn material(
    job: &Job<'_>,
    id: MaterialId,
    folder: &mut Folder,
    document: &mut xml::Document,
) -> Result<Bsdf> {
    let scene = job.scene;
    let material = &scene.materials[id.0 as usize];
    let texture = &scene.textures[material.base.0 as usize];
    let stem = format!("textures/{:03}_{}", id.0, safe_name(&material.name));
    let name = format!("material-{}", id.0);
    if !document.has_material(&name) {
        let albedo = format!("{stem}.exr");
        write_linear(folder, &albedo, texture, shapes::albedo)?;
        document.count_picture();
        let mut opacity = None;
        if material.alpha_tested {
            let file = format!("{stem}_opacity.png");
            let pixels: Vec<u8> = texture
                .rgba
                .iter()
                .map(|t| 255 * u8::from(t[3] != 0))
                .collect();
            let (pixels, w, h) = at_least_two(&pixels, texture.width, texture.height);
            folder.write(&file, |out| images::write_gray(out, &pixels, w, h))?;
            document.count_picture();
            opacity = Some(file);
        }
        document.material(&name, &albedo, opacity.as_deref(), material.finish.alpha);
    }
    Ok(Bsdf::Named(name))
}

/// Writes a texture as linear numbers.
fn write_linear(
    folder: &mut Folder,
    file: &str,
    texture: &Texture,
    decode: impl Fn([u8; 3]) -> [f32; 3],
) -> Result<()> {
    let pixels: Vec<[f32; 3]> = (texture.rgba.iter())
        .map(|&[r, g, b, _]| decode([r, g, b]))
        .collect();
    let (pixels, w, h) = at_least_two(&pixels, texture.width, texture.height);
    folder.write(file, |out| images::write_exr(out, &pixels, w, h))
}

/// Repeats a picture of one column or row: Mitsuba pads such with black.
fn at_least_two<T: Copy>(pixels: &[T], width: u32, height: u32) -> (Vec<T>, u32, u32) {
    let mut out = pixels.to_vec();
    let (mut w, mut h) = (width, height);
    if w == 1 {
        out = out.into_iter().flat_map(|p| [p, p]).collect();
        w = 2;
    }
    if h == 1 {
        out.extend_from_within(..);
        h = 2;
    }
    (out, w, h)
}

fn explain_sky(job: &Job<'_>, shapes: &Shapes, has_sky: bool, reasons: &mut Vec<Reason>) {
    if !has_sky || !sky::has_directions(&job.scene.sky) {
        return;
    }
    let suns = job.scene.sky.suns.len();
    if suns > 0 {
        reasons.push(Reason {
            what: "suns",
            why: format!(
                "{suns} suns are pixels of the image of the sky, which Mitsuba finds by hitting \
                 them: small ones are noisy, and their edges are those of the pixels"
            ),
            visible: true,
        });
    }
    reasons.push(match shapes.sky_frame {
        Some(_) => Reason {
            what: "sky",
            why: format!(
                "the sky is an image by direction of {} by {} pixels, read with linear \
                 interpolation: the borders of its texels are soft",
                sky::WIDTH,
                sky::WIDTH / 2
            ),
            visible: false,
        },
        None => Reason {
            what: "sky",
            why:
                "sky faces look in so many directions that no shading frame suits all: the sky is \
                  black"
                    .into(),
            visible: true,
        },
    });
}

fn explain_lamps(job: &Job<'_>, reasons: &mut Vec<Reason>) {
    let lights = &job.scene.lights;
    if lights.is_empty() {
        return;
    }
    reasons.push(Reason {
        what: "lamps",
        why: format!(
            "{} light entities are spheres through which everything passes; the camera sees them, \
             in Runelight it does not",
            lights.len()
        ),
        visible: false,
    });
    let spots = lights.iter().filter(|l| l.spot.is_some()).count();
    if spots > 0 {
        reasons.push(Reason {
            what: "spotlights",
            why: format!(
                "{spots} spotlights are points with Mitsuba's falloff, linear in the angle; in \
                 Runelight they are spheres, and linear in its cosine"
            ),
            visible: true,
        });
    }
}
