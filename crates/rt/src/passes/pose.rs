//! Models in poses: `shaders/pose.comp`.

use super::spirv;
use crate::vk::{Buffer, ComputePipeline, Device, Error, Recording, Usage};
use std::sync::Arc;

/// One model to be posed, as the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PoseJob {
    /// First vertex of the pose at fraction 0, and of that at fraction 1.
    pub poses: [u32; 2],
    /// First corner among the indices.
    pub first_index: u32,
    /// Corners: three for each triangle.
    pub corners: u32,
    /// How far from the one to the other.
    pub fraction: f32,
    /// First corner in the output.
    pub first_corner: u32,
    /// Unused, keeps the size a multiple of 16 bytes.
    pub padding: [u32; 2],
}

/// Rows of workgroups that every device can run.
const MOST_JOBS: usize = 65_535;
/// Threads of a workgroup.
const THREADS: u32 = 64;

/// The pass.
pub(crate) struct PosePass {
    pipeline: Arc<ComputePipeline>,
}

impl PosePass {
    pub fn new(device: &Arc<Device>) -> Result<Self, Error> {
        let code = spirv!("pose.comp");
        Ok(Self {
            pipeline: ComputePipeline::new(device, "pose", &code, 4, 0)?,
        })
    }

    /// Records the corners of models: from `positions` of all poses and `indices` of all corners into
    /// `corners`.
    pub fn record(
        &self,
        recording: &mut Recording,
        positions: &Arc<Buffer>,
        indices: &Arc<Buffer>,
        jobs: &[PoseJob],
        corners: &Arc<Buffer>,
    ) -> Result<(), Error> {
        let device = recording.device().clone();
        for jobs in jobs.chunks(MOST_JOBS) {
            let bytes = bytemuck::cast_slice(jobs);
            let usage = Usage::STORAGE_BUFFER;
            let list = Buffer::with_data(&device, "poses", usage, bytes)?;
            let most = jobs.iter().map(|j| j.corners).max().unwrap_or(0);
            let buffers = [positions, indices, &list, corners].map(|b| (b, b.size()));
            let groups = [most.div_ceil(THREADS), jobs.len() as u32];
            self.pipeline
                .record_dispatch(recording, &buffers, &[], groups)?;
        }
        Ok(())
    }
}
