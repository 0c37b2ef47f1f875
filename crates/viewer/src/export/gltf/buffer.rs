//! The binary buffer of a glTF document, with its views and accessors.

use anyhow::{Context as _, Result};
use serde_json::{Value, json};
use std::collections::HashMap;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A vertex of a flat-shaded mesh.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Place in metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates, 1 is the whole texture, `v` downwards.
    pub uv: [f32; 2],
}

impl Vertex {
    fn bits(&self) -> [u32; 8] {
        let (p, n, t) = (self.position, self.normal, self.uv);
        [p[0], p[1], p[2], n[0], n[1], n[2], t[0], t[1]].map(|x| (x + 0.0).to_bits())
    }
}

/// A buffer that grows.
#[derive(Debug, Default)]
pub struct Buffer {
    /// The content; every view starts at a multiple of 4.
    pub bytes: Vec<u8>,
    /// The document's `bufferViews`.
    pub views: Vec<Value>,
    /// The document's `accessors`.
    pub accessors: Vec<Value>,
}

impl Buffer {
    /// Adds triangles, three vertices each, and returns a primitive without material. Equal
    /// vertices are stored once.
    ///
    /// # Errors
    /// When there are more vertices than can be numbered.
    pub fn triangles(&mut self, corners: &[Vertex]) -> Result<Value> {
        let mut numbers: HashMap<[u32; 8], u32> = HashMap::new();
        let mut vertices: Vec<Vertex> = Vec::new();
        let mut indices: Vec<u32> = Vec::with_capacity(corners.len());
        for corner in corners {
            let next = u32::try_from(vertices.len()).context("too many vertices")?;
            indices.push(*numbers.entry(corner.bits()).or_insert_with(|| {
                vertices.push(*corner);
                next
            }));
        }
        let position = self.floats(vertices.iter().map(|v| v.position));
        let (lo, hi) = vertices.iter().fold(
            ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]),
            |(lo, hi), v| {
                let p = v.position;
                (
                    std::array::from_fn(|i| lo[i].min(p[i])),
                    std::array::from_fn(|i| hi[i].max(p[i])),
                )
            },
        );
        self.accessors[position]["min"] = json!(lo);
        self.accessors[position]["max"] = json!(hi);
        let normal = self.floats(vertices.iter().map(|v| v.normal));
        let uv = self.floats(vertices.iter().map(|v| v.uv));
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let index = self.accessor(view, UNSIGNED_INT, indices.len(), "SCALAR");
        Ok(json!({
            "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv},
            "indices": index,
        }))
    }

    /// Adds vectors; returns the accessor's number.
    fn floats<const N: usize>(&mut self, vectors: impl Iterator<Item = [f32; N]>) -> usize {
        let bytes: Vec<u8> = vectors.flatten().flat_map(f32::to_le_bytes).collect();
        let count = bytes.len() / (4 * N);
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        self.accessor(view, FLOAT, count, if N == 2 { "VEC2" } else { "VEC3" })
    }

    fn accessor(&mut self, view: usize, component: u32, count: usize, kind: &str) -> usize {
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    /// Adds bytes; returns the view's number.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }
}
