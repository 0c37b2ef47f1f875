//! Mitsuba's scene file.

use crate::export::Job;
use glam::{DVec3, Vec3};
use scene::PointLight;
use scene::camera::Lens;
use std::f32::consts::PI;
use std::fmt::Write as _;

/// How a shape reflects.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// One of the document's materials.
    Named(String),
    /// One albedo.
    Flat([f32; 3]),
}

/// How a shape emits.
#[derive(Clone, Debug, PartialEq)]
pub enum Emitter {
    /// One radiance, to the front; how much of the sampling it gets.
    Area {
        /// Linear RGB.
        radiance: [f32; 3],
        /// Estimated power over pi.
        weight: f64,
    },
    /// Radiance from a picture, to the front. Found by hitting it, never sampled.
    Picture {
        /// An EXR.
        file: String,
    },
    /// Radiance by direction, to both sides. Found by hitting it, never sampled.
    Direction {
        /// An EXR.
        file: String,
    },
}

/// A scene file that grows.
#[derive(Debug)]
pub struct Document {
    head: String,
    materials: Vec<String>,
    body: String,
    shapes: usize,
    pictures: usize,
    integrator: &'static str,
}

/// A number as `f32` has it, in the fewest digits.
fn triple(v: [f32; 3]) -> String {
    format!("{}, {}, {}", v[0], v[1], v[2])
}

impl Document {
    /// The beginning: integrator, sensor, film and sampler.
    #[must_use]
    pub fn new(job: &Job<'_>) -> Self {
        let settings = job.settings;
        let scene = job.scene;
        // Rays pass holes, see-through surfaces and lamps without a path vertex only in the volumetric integrator.
        let passes = scene.features.fences || scene.features.translucent;
        let integrator = if passes || !scene.lights.is_empty() {
            "volpath"
        } else {
            "path"
        };
        let depth = match settings.depth {
            0 => -1,
            n => i64::from(n),
        };
        // Roulette changes no expectation: where paths have a limit, Mitsuba follows them to it.
        let roulette = match settings.depth {
            0 => i64::from(scene::render::ROULETTE_START),
            n => i64::from(n) + 1,
        };
        let basis = settings.camera.view_basis(settings.width, settings.height);
        let (right, up) = (basis.right.normalize(), basis.up.normalize());
        // Mitsuba's cameras look along +Z with +X to the left.
        let columns = [-right, up, basis.forward];
        let row = |i: usize| {
            let c = columns.map(|c| c[i]);
            format!("{} {} {} 0", c[0], c[1], c[2])
        };
        let matrix = format!("{} {} {} 0 0 0 1", row(0), row(1), row(2));
        let fov = 2.0 * basis.right.length().atan().to_degrees();
        let far = farthest(job) * 2.0 + 16.0;
        let p = settings.camera.position;
        let (sensor, lens) = match basis.lens {
            None => ("perspective", String::new()),
            Some(Lens { radius, focus }) => (
                "thinlens",
                format!(
                    r#"
        <float name="aperture_radius" value="{radius}"/>
        <float name="focus_distance" value="{focus}"/>"#
                ),
            ),
        };
        let head = format!(
            r#"<?xml version="1.0" encoding="utf-8"?>
<!-- Written by Runelight {version}. Places are relative to the camera, which is at
     {x} {y} {z} in the level; one unit is one of the level's. For the rgb variants. -->
<scene version="3.0.0">
    <default name="spp" value="{spp}"/>
    <default name="seed" value="{seed}"/>
    <default name="depth" value="{depth}"/>
    <default name="rr_depth" value="{roulette}"/>
    <default name="width" value="{width}"/>
    <default name="height" value="{height}"/>
    <integrator type="{integrator}">
        <integer name="max_depth" value="$depth"/>
        <integer name="rr_depth" value="$rr_depth"/>
    </integrator>
    <sensor type="{sensor}">
        <transform name="to_world"><matrix value="{matrix}"/></transform>
        <string name="fov_axis" value="x"/>
        <float name="fov" value="{fov}"/>
        <float name="near_clip" value="0.01"/>
        <float name="far_clip" value="{far}"/>{lens}
        <film type="hdrfilm">
            <integer name="width" value="$width"/>
            <integer name="height" value="$height"/>
            <string name="pixel_format" value="rgb"/>
            <string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
        <sampler type="independent">
            <integer name="sample_count" value="$spp"/>
            <integer name="seed" value="$seed"/>
        </sampler>
    </sensor>
"#,
            version = env!("CARGO_PKG_VERSION"),
            x = p.x,
            y = p.y,
            z = p.z,
            spp = job.spp,
            seed = settings.seed,
            width = settings.width,
            height = settings.height,
        );
        Self {
            head,
            materials: Vec::new(),
            body: String::new(),
            shapes: 0,
            pictures: 0,
            integrator,
        }
    }

    /// Shapes so far.
    #[must_use]
    pub fn shapes(&self) -> usize {
        self.shapes
    }

    /// Pictures so far.
    #[must_use]
    pub fn pictures(&self) -> usize {
        self.pictures
    }

    /// Notes that a picture was written.
    pub fn count_picture(&mut self) {
        self.pictures += 1;
    }

    /// The integrator's name.
    #[must_use]
    pub fn integrator(&self) -> &'static str {
        self.integrator
    }

    /// Whether a material of this name is there.
    #[must_use]
    pub fn has_material(&self, name: &str) -> bool {
        self.materials.iter().any(|m| m == name)
    }

    /// Adds a material that is Lambertian on both sides; where the opacity is 0 it is not there.
    pub fn material(&mut self, name: &str, albedo: &str, opacity: Option<&str>, alpha: f32) {
        let picture = |role: &str, file: &str| bitmap(role, file);
        let diffuse = format!(
            "<bsdf type=\"twosided\"><bsdf type=\"diffuse\">{}</bsdf></bsdf>",
            picture("reflectance", albedo)
        );
        let constant = format!("<float name=\"opacity\" value=\"{alpha}\"/>");
        let text = match opacity {
            None if alpha < 1.0 => {
                format!("<bsdf type=\"mask\" id=\"{name}\">{constant}{diffuse}</bsdf>")
            }
            Some(file) if alpha < 1.0 => format!(
                "<bsdf type=\"mask\" id=\"{name}\">{}<bsdf type=\"mask\">{constant}{diffuse}</bsdf>\
                 </bsdf>",
                picture("opacity", file)
            ),
            None => diffuse.replacen(
                "<bsdf type=\"twosided\">",
                &format!("<bsdf type=\"twosided\" id=\"{name}\">"),
                1,
            ),
            Some(file) => format!(
                "<bsdf type=\"mask\" id=\"{name}\">{}{diffuse}</bsdf>",
                picture("opacity", file)
            ),
        };
        let _ = writeln!(self.head, "    {text}");
        self.materials.push(name.to_owned());
    }

    /// Adds a mesh.
    pub fn mesh(&mut self, file: &str, bsdf: &Bsdf, emitter: Option<&Emitter>, flat: bool) {
        let bsdf = match bsdf {
            Bsdf::Named(name) => format!("<ref id=\"{name}\"/>"),
            Bsdf::Flat(albedo) => format!(
                "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" \
                 value=\"{}\"/></bsdf></bsdf>",
                triple(*albedo)
            ),
        };
        let emitter = emitter.map_or(String::new(), |emitter| match emitter {
            Emitter::Area { radiance, weight } => format!(
                "\n        <emitter type=\"area\"><rgb name=\"radiance\" value=\"{}\"/>\
                 <float name=\"sampling_weight\" value=\"{weight}\"/></emitter>",
                triple(*radiance)
            ),
            Emitter::Picture { file } => format!(
                "\n        <emitter type=\"area\">{}<float name=\"sampling_weight\" value=\"0\"/>\
                 </emitter>",
                bitmap("radiance", file)
            ),
            Emitter::Direction { file } => format!(
                "\n        <emitter type=\"envmap\"><string name=\"filename\" value=\"{file}\"/>\
                 <float name=\"sampling_weight\" value=\"0\"/></emitter>"
            ),
        });
        let _ = writeln!(
            self.body,
            "    <shape type=\"ply\">\n        <string name=\"filename\" value=\"{file}\"/>\
             <boolean name=\"face_normals\" value=\"{flat}\"/>\n        {bsdf}{emitter}\n    \
             </shape>"
        );
        self.shapes += 1;
    }

    /// Adds a light entity: a sphere through which everything passes, or a spotlight.
    pub fn lamp(&mut self, light: &PointLight, eye: Vec3) {
        let at = light.position.as_dvec3() - eye.as_dvec3();
        let place = format!("x=\"{}\" y=\"{}\" z=\"{}\"", at.x, at.y, at.z);
        let weight = light.weight();
        let text = match light.spot {
            None => {
                let radiance = light.intensity / (PI * light.radius * light.radius);
                format!(
                    "<shape type=\"sphere\" id=\"lamp-{}\"><point name=\"center\" {place}/><float \
                     name=\"radius\" value=\"{}\"/><bsdf type=\"null\"/>\n        \
                     <emitter type=\"area\"><rgb name=\"radiance\" value=\"{}\"/><float \
                     name=\"sampling_weight\" value=\"{weight}\"/></emitter></shape>",
                    self.shapes,
                    light.radius,
                    triple(radiance.to_array()),
                )
            }
            Some(spot) => {
                let degrees = |cos: f32| f64::from(cos).clamp(-1.0, 1.0).acos().to_degrees();
                let (inner, outer) = (degrees(spot.cos_inner), degrees(spot.cos_outer));
                let d = spot.direction.as_dvec3();
                let (up, _) = d.any_orthonormal_pair();
                let target = at + d;
                format!(
                    "<emitter type=\"spot\"><transform name=\"to_world\"><lookat origin=\"{} {} \
                     {}\" target=\"{} {} {}\" up=\"{} {} {}\"/></transform>\n        <rgb \
                     name=\"intensity\" value=\"{}\"/><float name=\"cutoff_angle\" value=\"{outer}\
                     \"/><float name=\"beam_width\" value=\"{}\"/><float name=\"sampling_weight\" \
                     value=\"{weight}\"/></emitter>",
                    at.x,
                    at.y,
                    at.z,
                    target.x,
                    target.y,
                    target.z,
                    up.x,
                    up.y,
                    up.z,
                    triple(light.intensity.to_array()),
                    inner.min(outer * 0.999),
                )
            }
        };
        let _ = writeln!(self.body, "    {text}");
        self.shapes += usize::from(light.spot.is_none());
    }

    /// Adds a light without light: with weights of 0 alone nothing could be chosen.
    pub fn dark_point(&mut self) {
        self.body +=
            "    <emitter type=\"point\"><rgb name=\"intensity\" value=\"0\"/></emitter>\n";
    }

    /// The whole text.
    #[must_use]
    pub fn finish(self) -> String {
        format!("{}{}</scene>\n", self.head, self.body)
    }
}

/// A texture read as Runelight reads it: nearest, wrapping, numbers as they are.
fn bitmap(role: &str, file: &str) -> String {
    format!(
        "<texture type=\"bitmap\" name=\"{role}\"><string name=\"filename\" value=\"{file}\"/>\
         <string name=\"filter_type\" value=\"nearest\"/><string name=\"wrap_mode\" \
         value=\"repeat\"/><boolean name=\"raw\" value=\"true\"/><string name=\"format\" \
         value=\"variant\"/></texture>"
    )
}

/// Distance from the eye to the farthest corner of the level.
fn farthest(job: &Job<'_>) -> f64 {
    let eye = job.settings.camera.position.as_dvec3();
    let (lo, hi) = (
        job.scene.bounds_min.as_dvec3() - eye,
        job.scene.bounds_max.as_dvec3() - eye,
    );
    DVec3::max(lo.abs(), hi.abs()).length()
}
