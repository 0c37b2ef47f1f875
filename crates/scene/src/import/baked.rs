//! The lightmaps of a level, added up over their styles, for the triangles of its meshes.

use super::notes::Notes;
use crate::baked::{BakedLight, BakedTriangle};
use crate::mesh::Mesh;
use bsp::bsp::{FaceLight, LightSamples};
use bsp::styles::{Blend, LightStyles};
use bsp::{Bsp, Limits};
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
    /// By file, by face.
    files: Vec<Vec<Grid>>,
}

impl Baked {
    /// No file yet.
    pub fn new() -> Self {
        Self {
            samples: vec![[0.0; 3], [1.0; 3]],
            files: Vec::new(),
        }
    }

    /// Adds the lightmaps of a file at `time`, lit by `samples`. Answers with its number.
    pub fn add(
        &mut self,
        bsp: &Bsp,
        samples: &LightSamples,
        styles: &LightStyles,
        time: f64,
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
            let brightness: Vec<f32> = (map.styles.iter())
                .map(|&s| styles.brightness(s, time, Blend::Step))
                .collect();
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
        self.files.push(grids);
        self.files.len() - 1
    }

    /// The light of `meshes`, each with the number of the file it is from.
    pub fn light<'a>(self, meshes: impl Iterator<Item = (&'a Mesh, usize)>) -> BakedLight {
        let meshes = meshes
            .map(|(mesh, file)| {
                let faces = &self.files[file];
                (mesh.triangles.iter())
                    .map(|t| {
                        let grid = faces
                            .get(t.face as usize)
                            .copied()
                            .unwrap_or(Grid::of(BLACK));
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
