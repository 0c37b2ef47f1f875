//! Small scenes, built from the scene's types directly.

use glam::{Affine3A, DVec3, Vec3};
use scene::material::{luminance, srgb_to_linear};
use scene::render::{Estimator, Film, Sampler, Selection, Settings};
use scene::{
    Camera, Emitters, Instance, Material, MaterialId, Mesh, PointLight, Scene, Texture, TextureId,
    Triangle,
};
use std::collections::HashMap;
use std::sync::Arc;

/// A scene in the making: one mesh, placed once.
#[derive(Debug, Default)]
pub struct Builder {
    /// What is there so far, without its triangles.
    pub scene: Scene,
    triangles: Vec<Triangle>,
    /// Vertices by the bits of their coordinates.
    known: HashMap<[u32; 3], u32>,
}

impl Builder {
    /// An empty scene.
    #[must_use]
    pub fn new() -> Self {
        Self {
            scene: Scene {
                meshes: vec![Mesh::default()],
                ..Scene::default()
            },
            triangles: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// A picture of the given width.
    pub fn texture(&mut self, width: usize, rgba: Vec<[u8; 4]>) -> TextureId {
        self.scene.textures.push(Texture {
            name: String::new(),
            width: width as u32,
            height: (rgba.len() / width) as u32,
            rgba,
        });
        TextureId(self.scene.textures.len() as u32 - 1)
    }

    /// A material that shows `base` and emits `emission` times `scale`.
    pub fn material(
        &mut self,
        base: TextureId,
        emission: Option<TextureId>,
        scale: f32,
    ) -> MaterialId {
        let mean = emission.map_or(0.0, |id| {
            let rgba = &self.scene.textures[id.0 as usize].rgba;
            let sum: f32 = (rgba.iter())
                .map(|t| luminance([t[0], t[1], t[2]].map(|b| srgb_to_linear(b) as f32)))
                .sum();
            sum / rgba.len() as f32
        });
        self.push(Material {
            emission,
            emission_scale: scale,
            emission_weight: mean * scale,
            ..Material::new("", base)
        })
    }

    /// A grey material of the sRGB byte `grey` that emits evenly.
    pub fn plain(&mut self, grey: u8, emitted: f32) -> MaterialId {
        let base = self.texture(1, vec![[grey, grey, grey, 255]]);
        let white = (emitted > 0.0).then(|| self.texture(1, vec![[255; 4]]));
        self.material(base, white, emitted)
    }

    /// A sky material with the given weight in light sampling.
    pub fn sky(&mut self, weight: f32) -> MaterialId {
        let id = self.plain(0, 0.0);
        let material = self.edit(id);
        material.surface = scene::Surface::Sky;
        material.emission_weight = weight;
        id
    }

    /// Adds a material.
    pub fn push(&mut self, material: Material) -> MaterialId {
        self.scene.materials.push(material);
        MaterialId(self.scene.materials.len() as u32 - 1)
    }

    /// A material that was added, to change it.
    pub fn edit(&mut self, id: MaterialId) -> &mut Material {
        &mut self.scene.materials[id.0 as usize]
    }

    /// A quadrilateral, counter-clockwise from the front; `uv` texels span its first two sides.
    pub fn quad(&mut self, corners: [Vec3; 4], material: MaterialId, uv: [f32; 2]) {
        let [a, b, c, d] = corners.map(|p| self.vertex(p));
        let normal = (corners[1] - corners[0])
            .cross(corners[3] - corners[0])
            .normalize();
        let face = self.triangles.len() as u32 / 2;
        let [u, v] = uv;
        for (vertices, uv) in [
            ([a, b, c], [[0.0, 0.0], [u, 0.0], [u, v]]),
            ([a, c, d], [[0.0, 0.0], [u, v], [0.0, v]]),
        ] {
            self.triangles.push(Triangle {
                vertices,
                uv,
                normal,
                material,
                face,
            });
        }
    }

    /// A horizontal rectangle centred at `centre` that faces up or down.
    pub fn slab(
        &mut self,
        centre: Vec3,
        half: [f32; 2],
        up: bool,
        material: MaterialId,
        uv: [f32; 2],
    ) {
        let at = |x: f32, y: f32| centre + Vec3::new(x * half[0], y * half[1], 0.0);
        let mut corners = [at(-1., -1.), at(1., -1.), at(1., 1.), at(-1., 1.)];
        if !up {
            corners.reverse();
        }
        self.quad(corners, material, uv);
    }

    /// A triangle, counter-clockwise from the front, of the face number `face`. Its normal is given,
    /// as a level's plane gives it, so that a sliver has a good one.
    pub fn triangle(&mut self, corners: [Vec3; 3], normal: Vec3, material: MaterialId, face: u32) {
        let vertices = corners.map(|p| self.vertex(p));
        self.triangles.push(Triangle {
            vertices,
            uv: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
            normal,
            material,
            face,
        });
    }

    /// The index of a vertex; equal ones are one.
    fn vertex(&mut self, p: Vec3) -> u32 {
        let positions = &mut self.scene.meshes[0].positions;
        let known = self.known.entry(p.to_array().map(f32::to_bits));
        *known.or_insert_with(|| {
            positions.push(p);
            positions.len() as u32 - 1
        })
    }

    /// An axis-aligned box that faces in or out; materials in the order -x +x -y +y -z +z.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, inward: bool, materials: [MaterialId; 6]) {
        for (corners, material) in cuboid_sides(min, max, inward).into_iter().zip(materials) {
            self.quad(corners, material, [1.0, 1.0]);
        }
    }

    /// Moves everything built so far, with the rounding of f32.
    pub fn transform(&mut self, by: Affine3A) {
        let mesh = &mut self.scene.meshes[0];
        mesh.positions
            .iter_mut()
            .for_each(|p| *p = by.transform_point3(*p));
        self.known.clear();
        for t in &mut self.triangles {
            t.normal = by.transform_vector3(t.normal).normalize();
        }
    }

    /// Adds a light entity.
    pub fn light(&mut self, light: PointLight) {
        self.scene.lights.push(light);
    }

    /// Orders the triangles and lists the emitters.
    pub fn build(mut self) -> Arc<Scene> {
        let scene = &mut self.scene;
        self.triangles
            .sort_by_key(|t| scene.materials[t.material.0 as usize].is_see_through());
        let mesh = &mut scene.meshes[0];
        mesh.first_see_through = (self.triangles)
            .partition_point(|t| !scene.materials[t.material.0 as usize].is_see_through());
        mesh.triangles = self.triangles;
        scene.instances = vec![Instance::new(0, Affine3A::IDENTITY, "worldspawn")];
        list_emitters(scene);
        Arc::new(self.scene.completed())
    }
}

/// Lists what emits in a scene, after a change of what there is.
pub fn list_emitters(scene: &mut Scene) {
    let Scene {
        meshes,
        instances,
        materials,
        textures,
        lights,
        sky,
        ..
    } = scene;
    let triangles = scene::sky::sky_triangles(meshes, instances, |m| {
        materials[m.0 as usize].surface == scene::Surface::Sky
    });
    sky.suns = scene::sky::weighed_suns(std::mem::take(&mut sky.suns), &triangles);
    scene.emitters =
        Emitters::new(meshes, instances, materials, textures).with_lights(lights, &sky.suns);
}

/// The sides of an axis-aligned box that faces in or out, counter-clockwise from the front, in the
/// order -x +x -y +y -z +z.
#[must_use]
pub fn cuboid_sides(min: Vec3, max: Vec3, inward: bool) -> [[Vec3; 4]; 6] {
    let corner = |bits: usize| {
        let pick = |axis: usize| {
            if bits >> axis & 1 == 1 {
                max[axis]
            } else {
                min[axis]
            }
        };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    std::array::from_fn(|side| {
        let (axis, upper) = (side / 2, side % 2);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = upper << axis;
        let mut corners = [base, base | u, base | u | v, base | v].map(corner);
        if (upper == 1) == inward {
            corners.reverse();
        }
        corners
    })
}

/// A camera at `position`; angles in degrees.
pub fn camera(position: Vec3, pitch_deg: f32, yaw_deg: f32, fov_deg: f32) -> Camera {
    Camera {
        name: String::new(),
        position,
        pitch_deg,
        yaw_deg,
        roll_deg: 0.0,
        fov_deg,
        lens: None,
    }
}

/// A camera at `position` whose every ray goes, as nearly as matters, straight to `target`.
pub fn probe(position: Vec3, target: Vec3) -> Camera {
    let d = (target - position).normalize();
    let pitch = (-d.z).asin().to_degrees();
    camera(position, pitch, d.y.atan2(d.x).to_degrees(), 1e-4)
}

/// Settings for a square picture without layers.
pub fn settings(camera: Camera, size: u32, estimator: Estimator, depth: u32) -> Settings {
    Settings {
        width: size,
        height: size,
        camera,
        estimator,
        selection: Selection::default(),
        // Enough to be resampled, and quick.
        candidates: 2,
        sampler: Sampler::Independent,
        depth,
        time: 0.0,
        seed: 1,
        aovs: false,
        clamp: None,
    }
}

/// Mean over the picture of each channel, and its standard error.
pub fn mean_and_error(film: &Film) -> ([f64; 3], [f64; 3]) {
    let n = film.beauty.len() as f64;
    let error = [0, 1, 2].map(|c| {
        let sum: f64 = film.variance.iter().map(|v| f64::from(v[c])).sum();
        sum.sqrt() / n
    });
    (film.mean_radiance(), error)
}

/// Asserts that the picture's mean is `expected` within `sigmas` standard errors, and a rounding of
/// `1e-5` for renderers in single precision.
///
/// # Panics
/// When it is not, or a sample was not finite.
#[track_caller]
pub fn assert_mean(film: &Film, expected: [f64; 3], sigmas: f64, what: &str) {
    let (mean, error) = mean_and_error(film);
    for c in 0..3 {
        let off = (mean[c] - expected[c]).abs();
        let allowed = sigmas * error[c] + 1e-5 * expected[c].abs();
        assert!(
            off <= allowed,
            "{what}: channel {c} is {} +- {}, expected {}",
            mean[c],
            error[c],
            expected[c]
        );
    }
    assert_eq!(film.counters.nonfinite, 0, "{what}");
}

/// A closed hall of `n` by `n` cells with uneven floors, steps, pillars and lamps; `Vec3::ZERO` is
/// free.
pub fn hall(n: i32) -> Arc<Scene> {
    const CELL: f32 = 64.0;
    let mut b = Builder::new();
    let stone = b.texture(
        2,
        vec![
            [120, 110, 100, 255],
            [90, 90, 100, 255],
            [150, 140, 120, 255],
            [110, 100, 90, 255],
        ],
    );
    let wall = b.material(stone, None, 0.0);
    let lamp = b.plain(200, 20.0);
    // A hash of the cell, for heights.
    let noise = |x: i32, y: i32, k: i32| {
        let h = (x.wrapping_mul(73_856_093)
            ^ y.wrapping_mul(19_349_663)
            ^ k.wrapping_mul(83_492_791)) as u32;
        f32::from((h.wrapping_mul(0x9e37_79b9) >> 24) as u8) / 255.0
    };
    let inside = |x: i32, y: i32| x.abs() <= n / 2 && y.abs() <= n / 2;
    let solid = |x: i32, y: i32| !inside(x, y) || (x, y) != (0, 0) && noise(x, y, 1) < 0.2;
    let floor = |x: i32, y: i32| -32.0 - (noise(x, y, 2) * 4.0).floor() * 16.0;
    let ceiling = |x: i32, y: i32| 96.0 + (noise(x / 3, y / 3, 3) * 8.0).floor() * 32.0;
    for x in -n / 2..=n / 2 {
        for y in -n / 2..=n / 2 {
            if solid(x, y) {
                continue;
            }
            let centre = Vec3::new(x as f32 * CELL, y as f32 * CELL, 0.0);
            let half = CELL / 2.0;
            // Finer floors, for a realistic number of triangles.
            for (dx, dy) in [(-1., -1.), (1., -1.), (-1., 1.), (1., 1.)] {
                let at = centre + Vec3::new(dx, dy, 0.0) * (half / 2.0);
                let quarter = [half / 2.0; 2];
                b.slab(at + Vec3::Z * floor(x, y), quarter, true, wall, [16.0; 2]);
                b.slab(
                    at + Vec3::Z * ceiling(x, y),
                    quarter,
                    false,
                    wall,
                    [16.0; 2],
                );
            }
            if noise(x, y, 4) < 0.15 {
                let at = centre + Vec3::Z * (ceiling(x, y) - 8.0);
                b.cuboid(
                    at - Vec3::new(8., 8., 4.),
                    at + Vec3::new(8., 8., 4.),
                    false,
                    [lamp; 6],
                );
            }
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let (x2, y2) = (x + dx, y + dy);
                let along = Vec3::new(-dy as f32, dx as f32, 0.0) * half;
                let edge = centre + Vec3::new(dx as f32, dy as f32, 0.0) * half;
                let mut strip = |z0: f32, z1: f32| {
                    if z1 > z0 {
                        let (lo, hi) = (edge + Vec3::Z * z0, edge + Vec3::Z * z1);
                        b.quad(
                            [lo + along, lo - along, hi - along, hi + along],
                            wall,
                            [16.0; 2],
                        );
                    }
                };
                if solid(x2, y2) {
                    strip(floor(x, y), ceiling(x, y));
                } else {
                    strip(floor(x, y), floor(x2, y2));
                    strip(ceiling(x2, y2), ceiling(x, y));
                }
            }
        }
    }
    b.build()
}

/// A unit vector from two numbers in 0..1, for tests that want their own directions.
pub fn unit(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - 2.0 * u;
    let (s, c) = (v * std::f64::consts::TAU).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * c, r * s, z)
}
