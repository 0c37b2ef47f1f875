//! The triangles of one moment alone: behind those of the scene, in a structure that is built anew.

use super::{GpuScene, triangle, wound};
use crate::abi;
use crate::vk::{
    Blas, BlasGeometry, BlasInput, Buffer, Device, Error, Location, Rebuild, Recording, Scratch,
    TlasInstance, Usage,
};
use glam::Affine3A;
use scene::{Frame, Mesh};
use std::sync::Arc;

/// Room for loose triangles at first, when there are some.
const LEAST_ROOM: u32 = 1024;

/// What their instance has besides its place.
pub(super) const LOOSE: abi::Figure = abi::Figure {
    skin: abi::NO_SKIN,
    posed: 0,
    probability: 0.0,
    smooth_shaded: 0,
    normals_from: 0,
    normals_to: 0,
    fraction: 0.0,
    padding: 0,
};

/// Room for the loose triangles.
#[derive(Default)]
pub(super) struct Loose {
    /// How many there is room for.
    room: u32,
    blas: Option<Arc<Blas>>,
    scratch: Scratch,
}

impl GpuScene {
    /// The instance of the loose triangles, which stands behind all others.
    pub(super) fn loose_instance(&self, mesh: &Mesh) -> abi::Instance {
        let first = self.own_triangles;
        abi::Instance {
            opaque_base: first,
            alpha_base: first + mesh.first_see_through as u32,
            ..super::placement(&Affine3A::IDENTITY)
        }
    }

    /// Records the upload of loose triangles and the build of their structure, span `build loose BLAS`.
    /// Returns how they are placed, if there are some.
    pub(super) fn record_loose(
        &mut self,
        recording: &mut Recording,
        mesh: &Mesh,
        number: usize,
    ) -> Result<Option<TlasInstance>, Error> {
        let count = mesh.triangles.len() as u32;
        if count == 0 {
            return Ok(None);
        }
        let device = recording.device().clone();
        self.make_room(recording, &device, count)?;
        let triangles: Vec<abi::Triangle> = (mesh.triangles.iter())
            .map(|t| triangle(&mesh.positions, &wound(mesh, t), &Affine3A::IDENTITY))
            .collect();
        // With one more, so that there is something where the last part of none begins.
        let corners: Vec<[[f32; 3]; 3]> = (triangles.iter())
            .map(|t| [t.p0, t.p1, t.p2])
            .chain([[[0.0; 3]; 3]])
            .collect();
        let bytes: &[u8] = bytemuck::cast_slice(&triangles);
        let staged = Buffer::with_data(&device, "loose triangles", Usage::empty(), bytes)?;
        let at = u64::from(self.own_triangles) * size_of::<abi::Triangle>() as u64;
        recording.copy(&staged, &self.triangles, (0, at), bytes.len() as u64);
        let usage = Usage::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let corners = Buffer::with_data(
            &device,
            "loose corners",
            usage,
            bytemuck::cast_slice(&corners),
        )?;
        let once = self.scene.features.translucent;
        let counts = [
            mesh.first_see_through as u32,
            count - mesh.first_see_through as u32,
        ];
        let input = input(&corners, counts, once);
        let blas = match &self.loose.blas {
            Some(blas) => blas.clone(),
            None => {
                let room = self.loose.room;
                let blas = Blas::for_frames(&device, &self::input(&corners, [room; 2], once))?;
                self.loose.blas = Some(blas.clone());
                blas
            }
        };
        let rebuild = [Rebuild {
            blas: blas.clone(),
            input,
            from: None,
        }];
        recording.span("build loose BLAS", |r| {
            Blas::record_rebuilds(r, &rebuild, &mut self.loose.scratch)
        })?;
        Ok(Some(TlasInstance {
            blas,
            transform: Affine3A::IDENTITY,
            custom_index: number as u32 | abi::INSTANCE_APART,
            mask: abi::MASK_CAMERA as u8,
            hit_group: 0,
        }))
    }

    /// Makes room for so many loose triangles behind those of the scene.
    fn make_room(
        &mut self,
        recording: &mut Recording,
        device: &Arc<Device>,
        count: u32,
    ) -> Result<(), Error> {
        if count <= self.loose.room {
            return Ok(());
        }
        let size = size_of::<abi::Triangle>() as u64;
        let own = u64::from(self.own_triangles) * size;
        let room = count.next_power_of_two().max(LEAST_ROOM);
        let all = own + u64::from(room) * size;
        let usage = Usage::STORAGE_BUFFER;
        let triangles = Buffer::new(device, "triangles", all, usage, Location::Device)?;
        if own > 0 {
            recording.copy(&self.triangles, &triangles, (0, 0), own);
        }
        self.data.triangles = triangles.address();
        self.triangles = triangles;
        self.loose.room = room;
        self.loose.blas = None;
        Ok(())
    }
}

/// Where the corners of the loose triangles were in the picture before; empty if they stood still.
pub(super) fn corners_before(frame: &Frame) -> Vec<[[f32; 3]; 3]> {
    let before = frame.before.as_ref().map_or(&[][..], |b| &b.loose);
    let triangles = frame.loose.triangles.iter().filter(|_| !before.is_empty());
    triangles
        .map(|t| {
            wound(&frame.loose, t)
                .vertices
                .map(|v| before[v as usize].to_array())
        })
        .collect()
}

/// Opaque triangles and others, so many of each, whose corners stand in their order.
fn input(corners: &Arc<Buffer>, [opaque, others]: [u32; 2], once: bool) -> BlasInput {
    let part = |first, triangles, opaque| BlasGeometry {
        first,
        triangles,
        opaque,
        once,
    };
    BlasInput {
        name: "BLAS loose".into(),
        positions: corners.clone(),
        position_offset: 0,
        position_count: 3 * (opaque + others),
        indices: None,
        geometries: vec![part(0, opaque, true), part(opaque, others, false)],
    }
}
