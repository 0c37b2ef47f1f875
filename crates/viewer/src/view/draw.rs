//! From what egui says to what the screen draws.

use anyhow::Result;
use egui::epaint::{ClippedPrimitive, Primitive};
use egui::{ImageData, TextureFilter, TextureId, TexturesDelta};
use rt::{Filter, Mesh, PICTURE, Screen, Vertex};
use std::collections::HashMap;

/// The texture that is the traced picture, as egui calls it.
pub const PICTURE_ID: TextureId = TextureId::User(PICTURE);

/// Numbers of textures: egui's own count from 0, others from here.
const USER: u64 = 1 << 32;

fn number(id: TextureId) -> u64 {
    match id {
        TextureId::Managed(n) => n,
        PICTURE_ID => PICTURE,
        TextureId::User(n) => USER + n,
    }
}

/// The textures of egui. They change in parts; the screen takes them whole, because a whole new texture
/// needs not wait for frames that still show the old one.
#[derive(Default)]
pub struct Textures(HashMap<TextureId, egui::ColorImage>);

impl Textures {
    /// Hands on what is new.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn set(&mut self, screen: &mut Screen, delta: &TexturesDelta) -> Result<()> {
        for (id, change) in &delta.set {
            let ImageData::Color(part) = &change.image;
            if let Some([x, y]) = change.pos {
                let Some(whole) = self.0.get_mut(id) else {
                    continue;
                };
                let width = whole.size[0];
                for row in 0..part.size[1] {
                    let from = &part.pixels[row * part.size[0]..][..part.size[0]];
                    whole.pixels[(y + row) * width + x..][..part.size[0]].copy_from_slice(from);
                }
            } else {
                self.0.insert(*id, part.as_ref().clone());
            }
            let Some(whole) = self.0.get(id) else {
                continue;
            };
            let filter = match change.options.magnification {
                TextureFilter::Nearest => Filter::Nearest,
                TextureFilter::Linear => Filter::Linear,
            };
            let size = whole.size.map(|n| n as u32);
            let texels: Vec<[u8; 4]> = whole.pixels.iter().map(|c| c.to_array()).collect();
            screen.set_texture(number(*id), size, &texels, filter)?;
        }
        Ok(())
    }

    /// Forgets what is no longer shown.
    pub fn free(&mut self, screen: &mut Screen, delta: &TexturesDelta) {
        for id in &delta.free {
            self.0.remove(id);
            screen.forget_texture(number(*id));
        }
    }
}

/// The triangles of a frame.
#[must_use]
pub fn meshes(primitives: &[ClippedPrimitive]) -> Vec<Mesh<'_>> {
    (primitives.iter())
        .filter_map(|p| {
            let (clip, mesh) = match &p.primitive {
                Primitive::Mesh(mesh) => (p.clip_rect, mesh),
                Primitive::Callback(_) => return None,
            };
            // The same 20 bytes: position, texture coordinates, colour.
            let vertices: &[Vertex] = bytemuck::cast_slice(&mesh.vertices);
            Some(Mesh {
                texture: number(mesh.texture_id),
                clip: [clip.min.x, clip.min.y, clip.max.x, clip.max.y],
                vertices,
                indices: &mesh.indices,
            })
        })
        .collect()
}
