//! What makes two measurements measurements of the same thing.
//!
//! **Level hash**: SHA-256 over the content of the imported [`Scene`], not over files. What a
//! picture shows depends on the BSP, on `.lit` and `.ent` files beside it, the palette, item
//! models in other archives, and on the import itself; all of that meets in the scene. Names,
//! cameras and the report are left out: no sample depends on them.
//!
//! **Settings hash**: SHA-256 over what a picture's expectation depends on besides the scene:
//! size, camera, depth and time, and over the options that made the scene (lights, threshold,
//! emission scale) and [`FORMAT`]. Not over estimator, selection and seed, which change the noise alone.
//!
//! Numbers are hashed as little-endian bytes, floats by their bits, lists and texts after their
//! length, alternatives after their number.

use crate::cli::SceneArgs;
use scene::baked::{BakedLight, BakedTriangle};
use scene::camera::Lens;
use scene::cells::CellNode;
use scene::gloss::Gloss;
use scene::light::{CompilerLight, Falloff, LightSums, Spot, StyleSum};
use scene::render::Settings;
use scene::sky::{SkyKind, Sun};
use scene::{
    Emitters, Finish, Fog, Instance, LightStyle, Material, Mesh, PointLight, PoseBlend, Scene,
    SeenBy, Surface, Texture, TextureId, Triangle,
};
use sha2::{Digest as _, Sha256};

/// Version of the meaning of both hashes.
pub const FORMAT: u32 = 1;

/// SHA-256 over a sequence of values.
#[derive(Default)]
pub struct Hasher(Sha256);

impl Hasher {
    /// A whole number.
    pub fn int(&mut self, value: u64) -> &mut Self {
        self.0.update(value.to_le_bytes());
        self
    }

    /// Floats.
    pub fn floats(&mut self, values: impl IntoIterator<Item = f32>) -> &mut Self {
        for value in values {
            self.0.update(value.to_bits().to_le_bytes());
        }
        self
    }

    /// A text.
    pub fn text(&mut self, value: &str) -> &mut Self {
        self.int(value.len() as u64);
        self.0.update(value.as_bytes());
        self
    }

    /// The hash in hexadecimal digits.
    #[must_use]
    pub fn finish(self) -> String {
        use std::fmt::Write as _;
        self.0.finalize().iter().fold(String::new(), |mut text, b| {
            let _ = write!(text, "{b:02x}");
            text
        })
    }
}

/// The hash of a scene's content.
///
/// Every struct is taken apart whole, so that a field added to the scene is decided upon here.
#[must_use]
pub fn level_hash(scene: &Scene) -> String {
    let mut h = Hasher::default();
    h.text("runelight scene").int(FORMAT.into());
    let Scene {
        name: _,
        // Only how lights are chosen, not what shines.
        cells: _,
        title: _,
        meshes,
        instances,
        materials,
        textures,
        emitters,
        lights,
        light_sums,
        media,
        fog,
        clear_sky: _,
        baked,
        styles,
        sky,
        cameras: _,
        // What they show is among the instances.
        sprites: _,
        // Of scenes that frames are shown of, which have no number.
        moving: _,
        brightness: _,
        set_styles: _,
        bounds_min: _,
        bounds_max: _,
        features: _,
        report: _,
    } = scene;
    h.int(meshes.len() as u64);
    for mesh in meshes {
        hash_mesh(&mut h, mesh);
    }
    h.int(instances.len() as u64);
    for Instance {
        mesh,
        transform,
        name: _,
        pose,
        material,
        seen_by,
        id: _,
    } in instances
    {
        h.int(*mesh as u64).floats(transform.to_cols_array());
        // Scenes of brush models keep the number they had before there were others.
        if *pose != PoseBlend::default() {
            let PoseBlend { from, to, fraction } = *pose;
            h.int(from.into()).int(to.into()).floats([fraction]);
        }
        if let Some(material) = material {
            h.int(material.0.into());
        }
        if *seen_by != SeenBy::ALL {
            h.int(u64::from(seen_by.camera()));
        }
    }
    // Scenes that tell no styles apart keep the number they had before any did.
    for LightStyle { number, brightness } in styles {
        h.int((*number).into()).floats([*brightness]);
    }
    if let Some(baked) = baked {
        hash_baked(&mut h, baked);
    }
    h.int(materials.len() as u64);
    for material in materials {
        hash_material(&mut h, material);
    }
    h.int(textures.len() as u64);
    for Texture {
        name: _,
        width,
        height,
        rgba,
    } in textures
    {
        h.int((*width).into()).int((*height).into());
        h.int(rgba.len() as u64).0.update(rgba.as_flattened());
    }
    // What emits follows from the rest; how it is listed is noise, not light.
    let Emitters { list, .. } = emitters;
    h.int(list.len() as u64);
    h.int(lights.len() as u64);
    for light in lights {
        hash_light(&mut h, light);
    }
    // Levels whose lights add up keep the number they had before others' did not.
    if let Some(LightSums { gamma, styles }) = light_sums {
        h.text("sums").floats([*gamma]);
        for StyleSum {
            style,
            brightness,
            least,
            first,
            count,
        } in styles
        {
            h.int((*style).into())
                .floats([*brightness])
                .floats(least.to_array());
            h.int((*first).into()).int((*count).into());
        }
    }
    // Levels without media keep the number they had before there were any.
    for CellNode {
        normal,
        distance,
        children,
    } in &media.nodes
    {
        h.floats(normal.to_array()).floats([*distance]);
        for child in children {
            h.int((*child).into());
        }
    }
    if let Some(Fog { extinction, albedo }) = fog {
        h.text("fog").floats([*extinction]);
        h.floats(albedo.to_array());
        h.floats(sky.veil.into_iter().flat_map(|v| v.to_array()));
    }
    h.floats(sky.scale.into_iter().flat_map(|s| s.to_array()));
    h.int(sky.suns.len() as u64);
    for Sun {
        direction,
        one_minus_cos,
        radiance,
        // How a light is chosen is noise, not light.
        weight: _,
        window: _,
    } in &sky.suns
    {
        h.floats(direction.to_array()).floats(radiance.to_array());
        h.floats([*one_minus_cos]);
    }
    match sky.kind {
        SkyKind::None => h.int(0),
        SkyKind::Box(first) => h.int(3).int(first.0.into()),
        SkyKind::Flat(radiance) => h.int(1).floats(radiance.to_array()),
        SkyKind::Scrolling { back, front } => h.int(2).int(back.0.into()).int(front.0.into()),
    };
    h.finish()
}

fn hash_mesh(h: &mut Hasher, mesh: &Mesh) {
    let Mesh {
        name: _,
        positions,
        triangles,
        first_see_through,
        poses,
        normals,
        // What they look like is said by the instances that show them.
        skins: _,
    } = mesh;
    h.int(positions.len() as u64);
    for p in positions.iter().chain(poses.iter().flatten()) {
        h.floats(p.to_array());
    }
    for normal in normals.iter().flatten().flatten() {
        h.int(normal.0.into());
    }
    h.int(*first_see_through as u64).int(triangles.len() as u64);
    for Triangle {
        vertices,
        uv,
        normal,
        material,
        face: _,
    } in triangles
    {
        for v in vertices {
            h.int((*v).into());
        }
        h.floats(uv.as_flattened().iter().copied())
            .floats(normal.to_array());
        h.int(material.0.into());
    }
}

fn hash_material(h: &mut Hasher, material: &Material) {
    let Material {
        name: _,
        surface,
        base,
        emission,
        emission_scale,
        emission_weight,
        alpha_tested,
        two_sided,
        warped,
        least_light,
        finish,
        frames,
    } = material;
    h.int(match surface {
        Surface::Diffuse => 0,
        Surface::Sky => 1,
    });
    h.int(base.0.into());
    h.int(emission.map_or(0, |t| u64::from(t.0) + 1));
    h.floats([*emission_scale, *emission_weight]);
    for flag in [alpha_tested, two_sided, warped] {
        h.int((*flag).into());
    }
    if *least_light != glam::Vec3::ZERO {
        h.text("least").floats(least_light.to_array());
    }
    // Plain surfaces keep the number they had before there were others.
    if *finish != Finish::default() {
        hash_finish(h, finish);
    }
    for shown in frames {
        h.int(shown.0.into());
    }
}

fn hash_finish(h: &mut Hasher, finish: &Finish) {
    let Finish {
        alpha,
        ior,
        tint,
        absorption,
        gloss,
        normals,
    } = finish;
    let number = |t: &Option<TextureId>| t.map_or(0, |t| u64::from(t.0) + 1);
    h.text("finish").floats([*alpha, *ior]);
    h.floats(tint.to_array()).floats(absorption.to_array());
    h.int(number(normals)).int(gloss.is_some().into());
    if let Some(Gloss {
        roughness,
        metallic,
        specular,
        roughness_map,
    }) = gloss
    {
        h.floats([*roughness, *metallic, *specular]);
        h.int(number(roughness_map));
    }
}

fn hash_baked(h: &mut Hasher, BakedLight { meshes, samples }: &BakedLight) {
    for BakedTriangle {
        first,
        width,
        height,
        uv,
    } in meshes.iter().flatten()
    {
        h.int((*first).into()).int((*width).into());
        h.int((*height).into())
            .floats(uv.as_flattened().iter().copied());
    }
    h.floats(samples.as_flattened().iter().copied());
}

fn hash_light(h: &mut Hasher, light: &PointLight) {
    let PointLight {
        position,
        radius,
        intensity,
        spot,
        style,
        compiler,
    } = light;
    h.floats(position.to_array())
        .floats([*radius])
        .floats(intensity.to_array())
        .int(u64::from(*style));
    if let Some(CompilerLight {
        falloff,
        angle_scale,
    }) = compiler
    {
        let (kind, numbers) = match *falloff {
            Falloff::Linear { reach } => (1, [reach, 0.0, 0.0]),
            Falloff::Inverse { scale } => (2, [scale, 0.0, 0.0]),
            Falloff::InverseSquare { scale } => (3, [scale, 0.0, 0.0]),
            Falloff::InverseSquareShifted { scale } => (4, [scale, 0.0, 0.0]),
            Falloff::Constant => (5, [0.0; 3]),
            Falloff::Sun(direction) => (6, direction.to_array()),
            Falloff::Least => (7, [0.0; 3]),
        };
        h.int(kind).floats(numbers).floats([*angle_scale]);
    }
    match spot {
        None => h.int(0),
        Some(Spot {
            direction,
            cos_inner,
            cos_outer,
        }) => h
            .int(1)
            .floats(direction.to_array())
            .floats([*cos_inner, *cos_outer]),
    };
}

/// The hash of what a picture's expectation depends on besides the scene.
#[must_use]
pub fn settings_hash(settings: &Settings, scene: &SceneArgs) -> String {
    let mut h = Hasher::default();
    let c = &settings.camera;
    h.text("runelight settings").int(FORMAT.into());
    h.int(settings.width.into()).int(settings.height.into());
    h.floats(c.position.to_array());
    h.floats([c.pitch_deg, c.yaw_deg, c.roll_deg, c.fov_deg]);
    if let Some(Lens { radius, focus }) = c.lens {
        h.text("lens").floats([radius, focus]);
    }
    h.int(settings.depth.into()).floats([settings.time]);
    h.text(scene.lights.name());
    h.floats([scene.threshold as f32, scene.emission_scale as f32]);
    for &(number, brightness) in &scene.styles {
        h.text("style")
            .int(number.into())
            .floats([brightness as f32]);
    }
    h.finish()
}

/// Seeds of references have this bit, those of measured runs do not: they never share a random
/// number.
pub const REFERENCE_SEED: u64 = 1 << 63;

/// Seed of a measured run: curves and repeats have different ones.
#[must_use]
pub fn measured_seed(seed: u64, curve: usize, repeat: u32) -> u64 {
    let offset = ((curve as u64 + 1) << 32) + u64::from(repeat);
    seed.wrapping_add(offset) & !REFERENCE_SEED
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::camera::Camera;

    fn settings() -> Settings {
        Settings {
            width: 4,
            height: 3,
            camera: Camera {
                name: "a".into(),
                position: [0.0; 3].into(),
                pitch_deg: 0.0,
                yaw_deg: 0.0,
                roll_deg: 0.0,
                fov_deg: 90.0,
                lens: None,
            },
            estimator: scene::render::Estimator::Mis,
            selection: Default::default(),
            candidates: 1,
            sampler: scene::render::Sampler::Independent,
            depth: 3,
            time: 0.0,
            seed: 0,
            aovs: false,
            clamp: None,
        }
    }

    #[test]
    fn hashes_follow_what_pictures_depend_on_and_nothing_else() {
        let args = SceneArgs {
            at: 0.0,
            lights: crate::cli::Lights::Auto,
            threshold: 0.5,
            emission_scale: 4.0,
            styles: Vec::new(),
            fog: None,
            skyfog: None,
            entities: Default::default(),
            surfaces: Default::default(),
        };
        let of = |s: &Settings| settings_hash(s, &args);
        let base = of(&settings());
        assert_eq!(base.len(), 64);
        let mut same = settings();
        (same.seed, same.estimator) = (9, scene::render::Estimator::Naive);
        same.camera.name = "b".into();
        assert_eq!(of(&same), base);
        let mut other = settings();
        other.depth = 4;
        assert_ne!(of(&other), base);
        let mut other = settings();
        other.camera.yaw_deg = 1.0;
        assert_ne!(of(&other), base);

        let mut level = Scene {
            textures: vec![Texture {
                name: "t".into(),
                width: 1,
                height: 1,
                rgba: vec![[1, 2, 3, 255]],
            }],
            ..Scene::default()
        };
        let base = level_hash(&level);
        level.name = "renamed".into();
        assert_eq!(level_hash(&level), base);
        level.textures[0].rgba[0][2] = 4;
        assert_ne!(level_hash(&level), base);
    }

    #[test]
    fn seeds_of_runs_differ_and_never_meet_those_of_references() {
        for seed in [0, 1 << 40, u64::MAX] {
            let mut seen = std::collections::BTreeSet::new();
            for (curve, repeat) in [(0, 0), (0, 1), (1, 0), (5, 7)] {
                let s = measured_seed(seed, curve, repeat);
                assert!(s & REFERENCE_SEED == 0 && seen.insert(s));
            }
        }
    }
}
