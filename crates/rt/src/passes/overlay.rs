//! Panels and text over the picture, and the picture itself: `shaders/overlay.vert` and `.frag`.

use super::spirv;
use crate::vk::{
    Buffer, Device, Draw, DrawTexture, Error, Filter, Format, Image, RasterPipeline, Recording,
    Target, Usage,
};
use std::collections::HashMap;
use std::sync::Arc;

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// Points from the upper left corner of the screen.
    pub position: [f32; 2],
    /// 0 to 1 across and down the texture.
    pub texture_at: [f32; 2],
    /// Display codes, premultiplied by alpha: red, green, blue, alpha.
    pub color: [u8; 4],
}

/// Some triangles with one texture.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Number of the texture, [`PICTURE`] or one that was given.
    pub texture: u64,
    /// Pixels outside of this rectangle stay: left, top, right, bottom, in points.
    pub clip: [f32; 4],
    /// Corners.
    pub vertices: &'a [Vertex],
    /// Three for each triangle.
    pub indices: &'a [u32],
}

/// Number of the texture that is the traced picture.
pub const PICTURE: u64 = u64::MAX;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    size: [f32; 2],
}

/// The pass, with its textures.
pub(crate) struct Overlay {
    pipeline: Arc<RasterPipeline>,
    format: Format,
    textures: HashMap<u64, (Arc<Image>, Filter, Arc<DrawTexture>)>,
}

impl Overlay {
    /// Makes the pass for pictures of one format.
    pub fn new(device: &Arc<Device>, format: Format) -> Result<Self, Error> {
        Ok(Self {
            pipeline: pipeline(device, format)?,
            format,
            textures: HashMap::new(),
        })
    }

    /// Takes another format, if it is another.
    pub fn follow(&mut self, device: &Arc<Device>, format: Format) -> Result<(), Error> {
        if self.format != format {
            self.pipeline = pipeline(device, format)?;
            self.format = format;
            for (image, filter, texture) in self.textures.values_mut() {
                *texture = self.pipeline.texture(image, *filter)?;
            }
        }
        Ok(())
    }

    /// Gives a texture a number, in place of what had it.
    pub fn set(&mut self, number: u64, image: &Arc<Image>, filter: Filter) -> Result<(), Error> {
        let texture = self.pipeline.texture(image, filter)?;
        (self.textures).insert(number, (Arc::clone(image), filter, texture));
        Ok(())
    }

    /// Whether a texture has this number.
    pub fn has(&self, number: u64, image: &Arc<Image>, filter: Filter) -> bool {
        (self.textures.get(&number)).is_some_and(|t| Arc::ptr_eq(&t.0, image) && t.1 == filter)
    }

    /// Forgets a texture.
    pub fn forget(&mut self, number: u64) {
        self.textures.remove(&number);
    }

    /// Draws on black; `scale` is pixels per point. Meshes without a texture are left out.
    ///
    /// # Errors
    /// When there is no memory for the triangles.
    pub fn record(
        &self,
        recording: &mut Recording,
        target: &Target,
        meshes: &[Mesh<'_>],
        scale: f32,
    ) -> Result<(), Error> {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        let mut draws = Vec::new();
        let [width, height] = target.size();
        for mesh in meshes {
            let Some((_, _, texture)) = self.textures.get(&mesh.texture) else {
                continue;
            };
            // The device is not asked to doubt what it is given.
            let count = mesh.vertices.len() as u32;
            assert!(mesh.indices.iter().all(|&i| i < count), "indices in range");
            let [left, top, right, bottom] = mesh.clip.map(|c| (c * scale).round().max(0.0) as u32);
            draws.push(Draw {
                texture: Arc::clone(texture),
                clip: [left, top, right.min(width), bottom.min(height)],
                indices: [indices.len() as u32, mesh.indices.len() as u32],
                first_vertex: vertices.len() as i32,
            });
            vertices.extend_from_slice(mesh.vertices);
            indices.extend_from_slice(mesh.indices);
        }
        let params = Params {
            size: [width, height].map(|n| n as f32 / scale),
        };
        let device = recording.device();
        let buffer = |name, usage, data| Buffer::with_data(device, name, usage, data);
        let vertices = bytemuck::cast_slice(&vertices);
        let vertices = buffer("overlay vertices", Usage::VERTEX_BUFFER, vertices)?;
        let indices = bytemuck::cast_slice(&indices);
        let indices = buffer("overlay indices", Usage::INDEX_BUFFER, indices)?;
        recording.span("overlay", |r| {
            let params = bytemuck::bytes_of(&params);
            (self.pipeline).record(r, target, [&vertices, &indices], params, &draws);
            Ok(())
        })
    }
}

fn pipeline(device: &Arc<Device>, format: Format) -> Result<Arc<RasterPipeline>, Error> {
    let code = [spirv!("overlay.vert"), spirv!("overlay.frag")];
    let size = size_of::<Params>() as u32;
    RasterPipeline::new(device, "overlay", [&code[0], &code[1]], size, format)
}
