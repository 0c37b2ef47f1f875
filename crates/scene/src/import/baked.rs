//! The lightmaps of a level, added up over their styles, for the triangles of its meshes.

use super::lights::Moment;
use super::notes::Notes;
use crate::baked::{BakedLight, BakedTriangle};
use crate::mesh::Mesh;
use bsp::bsp::{FaceLight, LightSamples, Texinfo};
use bsp::{Bsp, Limits};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Sample that leaves a face black, and the one that shows its texture as it is stored.
const BLACK: u32 = 0;
const UNLIT: u32 = 1;
/// Faces may share samples. Beyond this many times the samples there are, plus [`ANYWAY`], faces are
/// black.
const PER_SAMPLE: usize = 16;
const ANYWAY: usize = 1 << 20;

/// A face's samples and the luxel coordinates of its points.
#[derive(Clone, Copy, Debug)]
struct Grid {
    first: u32,
    size: [u32; 2],
    axes: [[f64; 4]; 2],
}

impl Grid {
    /// One sample for the whole face.
    fn of(first: u32) -> Self {
        Self {
            first,
            size: [1; 2],
            axes: [[0.0; 4]; 2],
        }
    }
}

/// The lightmaps of all files of an import.
#[derive(Debug)]
pub struct Baked {
    samples: Vec<[f32; 3]>,
    files: Vec<Lit>,
}

/// The samples of a file.
#[derive(Debug)]
enum Lit {
    /// By face.
    Faces(Vec<Grid>),
    /// The same everywhere.
    Evenly(Grid),
}

impl Baked {
    /// No file yet.
    pub fn new() -> Self {
        Self {
            samples: vec![[0.0; 3], [1.0; 3]],
            files: Vec::new(),
        }
    }

    /// Adds the lightmaps of a file at a moment, lit by `samples`. Answers with its number.
    pub fn add(
        &mut self,
        bsp: &Bsp,
        samples: &LightSamples,
        moment: &Moment<'_>,
        limits: &Limits,
        notes: &mut Notes,
    ) -> usize {
        let most = bsp
            .light_sample_count()
            .saturating_mul(PER_SAMPLE)
            .saturating_add(ANYWAY);
        let begin = self.samples.len();
        let mut known: HashMap<(usize, [u32; 2], Vec<u16>), u32> = HashMap::new();
        let mut grid = |index: usize| {
            let map = match bsp.face_light(index, limits) {
                FaceLight::Fullbright => return Grid::of(UNLIT),
                FaceLight::Black => return Grid::of(BLACK),
                FaceLight::Lightmap(map) => map,
            };
            let size = [map.width, map.height];
            let count = map.width as usize * map.height as usize;
            let key = (map.offset, size, map.styles.clone());
            if let Some(&first) = known.get(&key) {
                return Grid {
                    first,
                    size,
                    axes: map.axes,
                };
            }
            let first = u32::try_from(self.samples.len());
            let Some(first) = first
                .ok()
                .filter(|_| self.samples.len() - begin + count <= most)
            else {
                notes.add("shared lightmaps", || {
                    "faces share lightmaps too often: the rest is black".to_owned()
                });
                return Grid::of(BLACK);
            };
            let brightness: Vec<f32> = (map.styles.iter()).map(|&s| moment.now(s)).collect();
            for y in 0..map.height {
                for x in 0..map.width {
                    let mut sum = [0.0; 3];
                    for (slot, brightness) in brightness.iter().enumerate() {
                        let value = samples.value(bsp, map.sample(slot, x, y));
                        for (sum, value) in sum.iter_mut().zip(value) {
                            *sum += value * brightness;
                        }
                    }
                    self.samples.push(sum);
                }
            }
            known.insert(key, first);
            Grid {
                first,
                size,
                axes: map.axes,
            }
        };
        let grids = (0..bsp.faces.len()).map(&mut grid).collect();
        self.files.push(Lit::Faces(grids));
        self.files.len() - 1
    }

    /// Adds what is lit evenly, and answers with its number, as for a file.
    pub fn add_evenly(&mut self, light: [f32; 3]) -> usize {
        let first = self.samples.len() as u32;
        self.samples.push(light);
        self.files.push(Lit::Evenly(Grid::of(first)));
        self.files.len() - 1
    }

    /// Light of the nearest face of the level straight below a point, as engines light models; none
    /// where there is no face. The level is the first file that was added.
    pub fn below(&self, bsp: &Bsp, point: Vec3) -> [f32; 3] {
        let Some(Lit::Faces(grids)) = self.files.first() else {
            return [0.0; 3];
        };
        let point = point.as_dvec3();
        let floor = (bsp.drawable_faces(0))
            .filter_map(|(index, face)| {
                let plane = bsp.face_plane(face)?;
                let normal = DVec3::from(plane.normal.map(f64::from));
                // What faces up has light of its own.
                if normal.z < 1e-3 || bsp.face_texinfo(face).is_none_or(Texinfo::is_special) {
                    return None;
                }
                let height = (f64::from(plane.distance) - normal.truncate().dot(point.truncate()))
                    / normal.z;
                let at = point.truncate().extend(height);
                let corners: Vec<DVec3> = (bsp.face_points(face)?)
                    .map(|p| DVec3::from(p.map(f64::from)))
                    .collect();
                // The file runs clockwise.
                let inside = (0..corners.len()).all(|i| {
                    let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                    (b - a).cross(at - a).dot(normal) <= 1e-6
                });
                (inside && height <= point.z).then_some((index, at))
            })
            .max_by(|(_, a), (_, b)| a.z.total_cmp(&b.z));
        floor.map_or([0.0; 3], |(index, at)| self.sample(grids[index], at))
    }

    /// Bilinear between samples; beyond the outer ones light stays.
    fn sample(&self, grid: Grid, at: DVec3) -> [f32; 3] {
        let axis = |i: usize| {
            let [x, y, z, w] = grid.axes[i];
            let most = f64::from(grid.size[i] - 1);
            let c = (DVec3::new(x, y, z).dot(at) + w).clamp(0.0, most);
            (c.floor() as u32, c.ceil() as u32, (c - c.floor()) as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (axis(0), axis(1));
        let of =
            |x: u32, y: u32| Vec3::from(self.samples[(grid.first + y * grid.size[0] + x) as usize]);
        let row = |y: u32| of(x0, y).lerp(of(x1, y), u);
        row(y0).lerp(row(y1), v).to_array()
    }

    /// The light of `meshes`, each with the number of the file it is from.
    pub fn light<'a>(self, meshes: impl Iterator<Item = (&'a Mesh, usize)>) -> BakedLight {
        let meshes = meshes
            .map(|(mesh, file)| {
                let file = &self.files[file];
                (mesh.triangles.iter())
                    .map(|t| {
                        let grid = match file {
                            Lit::Faces(grids) => grids.get(t.face as usize).copied(),
                            Lit::Evenly(grid) => Some(*grid),
                        };
                        let grid = grid.unwrap_or(Grid::of(BLACK));
                        let uv = t.vertices.map(|v| {
                            let p = mesh.positions[v as usize].as_dvec3();
                            (grid.axes).map(|[x, y, z, w]| (p.x * x + p.y * y + p.z * z + w) as f32)
                        });
                        BakedTriangle {
                            first: grid.first,
                            width: grid.size[0],
                            height: grid.size[1],
                            uv,
                        }
                    })
                    .collect()
            })
            .collect();
        BakedLight {
            meshes,
            samples: self.samples,
        }
    }
}
