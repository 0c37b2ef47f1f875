//! Recording commands, the barriers between them, submission and timing.

use super::memory::COLOR;
use super::{Buffer, Device, Error, Image, Named};
use ash::vk;
use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

/// How a command touches memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Copies read.
    TransferRead,
    /// Copies and fills write.
    TransferWrite,
    /// Acceleration-structure builds read their inputs, other structures and scratch memory.
    BuildRead,
    /// Acceleration-structure builds write structures and scratch memory.
    BuildWrite,
    /// Ray-tracing shaders read.
    TraceRead,
    /// Ray-tracing shaders write.
    TraceWrite,
    /// Compute shaders read.
    ComputeRead,
    /// Compute shaders write.
    ComputeWrite,
    /// The host reads after the submission.
    HostRead,
}

impl Access {
    fn scope(self) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
        match self {
            Self::TransferRead => (S::ALL_TRANSFER, A::TRANSFER_READ),
            Self::TransferWrite => (S::ALL_TRANSFER, A::TRANSFER_WRITE),
            Self::BuildRead => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR | A::SHADER_READ,
            ),
            Self::BuildWrite => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR | A::ACCELERATION_STRUCTURE_WRITE_KHR,
            ),
            Self::TraceRead => (
                S::RAY_TRACING_SHADER_KHR,
                A::SHADER_READ | A::ACCELERATION_STRUCTURE_READ_KHR,
            ),
            Self::TraceWrite => (S::RAY_TRACING_SHADER_KHR, A::SHADER_READ | A::SHADER_WRITE),
            Self::ComputeRead => (S::COMPUTE_SHADER, A::SHADER_READ),
            Self::ComputeWrite => (S::COMPUTE_SHADER, A::SHADER_WRITE),
            Self::HostRead => (S::HOST, A::HOST_READ),
        }
    }

    fn writes(self) -> bool {
        matches!(
            self,
            Self::TransferWrite | Self::BuildWrite | Self::TraceWrite | Self::ComputeWrite
        )
    }
}

/// The queue, and the timeline semaphore that counts its submissions.
pub(super) struct Queue {
    raw: vk::Queue,
    pub(super) family: u32,
    timestamp_period: f32,
    timeline: vk::Semaphore,
    /// Value of the last submission; also guards the queue.
    submitted: Mutex<u64>,
    device: ash::Device,
}

impl Queue {
    pub(super) fn new(
        device: &ash::Device,
        family: u32,
        timestamp_period: f32,
    ) -> Result<Self, Error> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the family was asked for when the device was made; timeline semaphores are on.
        let (raw, timeline) = unsafe {
            let timeline = device
                .create_semaphore(&info, None)
                .named("vkCreateSemaphore")?;
            (device.get_device_queue(family, 0), timeline)
        };
        let submitted = Mutex::new(0);
        Ok(Self {
            raw,
            family,
            timestamp_period,
            timeline,
            submitted,
            device: device.clone(),
        })
    }
}

impl Queue {
    /// Calls `present` with the queue, which nobody else uses meanwhile.
    pub(super) fn locked<T>(&self, present: impl FnOnce(vk::Queue) -> T) -> T {
        let _submitted = (self.submitted.lock()).unwrap_or_else(PoisonError::into_inner);
        present(self.raw)
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        // SAFETY: the device is alive (it owns this queue), and nothing else uses the semaphore.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.device.destroy_semaphore(self.timeline, None);
        }
    }
}

/// GPU time of one named part of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Name of the part.
    pub name: &'static str,
    /// Milliseconds between its first and last command.
    pub milliseconds: f64,
}

/// Most named parts of a recording; two timestamps each.
const MAX_SPANS: u32 = 64;

/// Commands being recorded, with everything they use.
///
/// Each command says what it reads and writes; the barrier before it is derived from what was
/// recorded since the last one.
pub struct Recording {
    pub(super) commands: vk::CommandBuffer,
    pool: vk::CommandPool,
    queries: vk::QueryPool,
    spans: Vec<&'static str>,
    used: Vec<Arc<dyn Any + Send + Sync>>,
    /// Accesses since the last barrier.
    open: Vec<Access>,
    pub(super) device: Arc<Device>,
}

impl Recording {
    /// Begins a recording. Everything submitted before is visible to it.
    ///
    /// # Errors
    /// When a call fails.
    pub fn begin(device: &Arc<Device>) -> Result<Self, Error> {
        let raw = &device.raw;
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue.family);
        // SAFETY: valid create infos; the value made at once owns and frees the pools.
        unsafe {
            let pool = raw
                .create_command_pool(&pool, None)
                .named("vkCreateCommandPool")?;
            let mut recording = Self {
                commands: vk::CommandBuffer::null(),
                pool,
                queries: vk::QueryPool::null(),
                spans: Vec::new(),
                used: Vec::new(),
                open: Vec::new(),
                device: device.clone(),
            };
            if device.limits().timestamp_period > 0.0 {
                let queries = vk::QueryPoolCreateInfo::default()
                    .query_type(vk::QueryType::TIMESTAMP)
                    .query_count(2 * MAX_SPANS);
                recording.queries = raw
                    .create_query_pool(&queries, None)
                    .named("vkCreateQueryPool")?;
                raw.reset_query_pool(recording.queries, 0, 2 * MAX_SPANS);
            }
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let buffers = raw
                .allocate_command_buffers(&info)
                .named("vkAllocateCommandBuffers")?;
            recording.commands = buffers[0];
            let begin = vk::CommandBufferBeginInfo::default()
                .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            raw.begin_command_buffer(recording.commands, &begin)
                .named("vkBeginCommandBuffer")?;
            recording.barrier(
                (
                    vk::PipelineStageFlags2::ALL_COMMANDS,
                    vk::AccessFlags2::MEMORY_WRITE,
                ),
                (
                    vk::PipelineStageFlags2::ALL_COMMANDS,
                    vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
                ),
            );
            Ok(recording)
        }
    }

    /// The device it is for.
    #[must_use]
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Keeps an object alive until the GPU is done with this recording.
    pub fn keep(&mut self, object: impl Any + Send + Sync) {
        self.used.push(Arc::new(object));
    }

    /// Times what `record` records, by GPU timestamps, if the device has them.
    ///
    /// # Errors
    /// What `record` returns.
    pub fn span<T>(
        &mut self,
        name: &'static str,
        record: impl FnOnce(&mut Self) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let index = self.spans.len() as u32;
        if self.queries == vk::QueryPool::null() || index >= MAX_SPANS {
            return record(self);
        }
        self.spans.push(name);
        // All commands before have ended when the first stamp is written, so spans do not overlap.
        let stages = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the pool has two queries for each span, reset when the recording began.
        unsafe {
            self.device
                .raw
                .cmd_write_timestamp2(self.commands, stages, self.queries, 2 * index);
        }
        let result = record(self);
        // SAFETY: as above.
        unsafe {
            self.device.raw.cmd_write_timestamp2(
                self.commands,
                stages,
                self.queries,
                2 * index + 1,
            );
        }
        result
    }

    /// Puts the barrier that `accesses` need after all that was recorded so far.
    ///
    /// Memory is not told apart: a write waits for everything open, a read for all open writes.
    pub(super) fn access(&mut self, accesses: &[Access]) {
        let conflicts = |earlier: &Access| {
            accesses
                .iter()
                .any(|later| earlier.writes() || later.writes())
        };
        if self.open.iter().any(conflicts) {
            let union = |list: &[Access]| {
                list.iter().map(|a| a.scope()).fold(
                    (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE),
                    |(s, a), (stage, access)| (s | stage, a | access),
                )
            };
            let before = union(&self.open);
            self.barrier(before, union(accesses));
            self.open.clear();
        }
        for &a in accesses {
            if !self.open.contains(&a) {
                self.open.push(a);
            }
        }
    }

    fn barrier(
        &mut self,
        before: (vk::PipelineStageFlags2, vk::AccessFlags2),
        after: (vk::PipelineStageFlags2, vk::AccessFlags2),
    ) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(before.0)
            .src_access_mask(before.1)
            .dst_stage_mask(after.0)
            .dst_access_mask(after.1)];
        let info = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.commands, &info) };
    }

    /// Copies `size` bytes between buffers.
    pub fn copy(&mut self, from: &Arc<Buffer>, to: &Arc<Buffer>, offsets: (u64, u64), size: u64) {
        self.access(&[Access::TransferRead, Access::TransferWrite]);
        let region = vk::BufferCopy {
            src_offset: offsets.0,
            dst_offset: offsets.1,
            size,
        };
        assert!(
            offsets.0 + size <= from.size() && offsets.1 + size <= to.size(),
            "copy in range"
        );
        // SAFETY: both buffers are kept alive, and the ranges were checked.
        unsafe {
            self.device
                .raw
                .cmd_copy_buffer(self.commands, from.raw(), to.raw(), &[region])
        };
        self.keep(from.clone());
        self.keep(to.clone());
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: &Arc<Buffer>) {
        self.access(&[Access::TransferWrite]);
        // SAFETY: the buffer is kept alive.
        unsafe {
            self.device
                .raw
                .cmd_fill_buffer(self.commands, buffer.raw(), 0, vk::WHOLE_SIZE, 0);
        }
        self.keep(buffer.clone());
    }

    /// Fills an image from tightly packed texels at `offset` of a buffer and makes it readable by
    /// shaders. Its former contents are lost.
    pub fn upload_image(&mut self, from: &Arc<Buffer>, offset: u64, image: &Arc<Image>) {
        let to_transfer = vk::ImageMemoryBarrier2::default()
            // Whatever read it in an earlier recording is done.
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.raw())
            .subresource_range(COLOR);
        let to_shader = vk::ImageMemoryBarrier2 {
            src_stage_mask: vk::PipelineStageFlags2::ALL_TRANSFER,
            src_access_mask: vk::AccessFlags2::TRANSFER_WRITE,
            dst_stage_mask: vk::PipelineStageFlags2::ALL_COMMANDS,
            dst_access_mask: vk::AccessFlags2::SHADER_READ,
            old_layout: vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            new_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            ..to_transfer
        };
        let region = vk::BufferImageCopy::default()
            .buffer_offset(offset)
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(image.extent());
        let extent = image.extent();
        let bytes = 4 * u64::from(extent.width) * u64::from(extent.height);
        assert!(offset + bytes <= from.size(), "texels in range");
        self.access(&[Access::TransferRead]);
        // SAFETY: both objects are kept alive, the range was checked, layouts follow each other.
        unsafe {
            let raw = &self.device.raw;
            let barriers = [to_transfer];
            let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            raw.cmd_pipeline_barrier2(self.commands, &info);
            raw.cmd_copy_buffer_to_image(
                self.commands,
                from.raw(),
                image.raw(),
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &[region],
            );
            let barriers = [to_shader];
            let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            raw.cmd_pipeline_barrier2(self.commands, &info);
        }
        self.keep(from.clone());
        self.keep(image.clone());
    }

    /// Copies an image that was drawn on, in the layout `TRANSFER_SRC_OPTIMAL`, to the start of a
    /// buffer, tightly packed.
    pub fn download_image(&mut self, from: &Arc<Image>, to: &Arc<Buffer>) {
        self.access(&[Access::TransferRead, Access::TransferWrite]);
        let extent = from.extent();
        let bytes = 4 * u64::from(extent.width) * u64::from(extent.height);
        assert!(bytes <= to.size(), "room for all texels");
        let region = vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(extent);
        // SAFETY: both objects are kept alive, and the range was checked.
        unsafe {
            self.device.raw.cmd_copy_image_to_buffer(
                self.commands,
                from.raw(),
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                to.raw(),
                &[region],
            );
        }
        self.keep(from.clone());
        self.keep(to.clone());
    }

    /// Submits and waits until the GPU is done. Returns the GPU times of the spans, in order.
    ///
    /// # Errors
    /// When a call fails or the device is lost.
    pub fn submit_and_wait(self) -> Result<Vec<Timing>, Error> {
        self.submit()?.wait()
    }

    /// Submits; what is recorded next waits for it on the GPU.
    ///
    /// # Errors
    /// When a call fails or the device is lost.
    pub fn submit(self) -> Result<Submission, Error> {
        self.submit_between(None, None)
    }

    /// As [`Self::submit`]; drawing waits for the semaphore `after`, and `then` is signalled at the end.
    ///
    /// # Errors
    /// When a call fails or the device is lost.
    pub(super) fn submit_between(
        mut self,
        after: Option<vk::Semaphore>,
        then: Option<vk::Semaphore>,
    ) -> Result<Submission, Error> {
        self.access(&[Access::HostRead]);
        let device = self.device.clone();
        let (raw, queue) = (&device.raw, &device.queue);
        // SAFETY: the command buffer is complete; everything it uses is in `self.used`, which lives
        // until the semaphore has reached the submission's value.
        unsafe {
            raw.end_command_buffer(self.commands)
                .named("vkEndCommandBuffer")?;
            let mut submitted = queue
                .submitted
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            let value = *submitted + 1;
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
            let waits: Vec<_> = (after.into_iter())
                .map(|semaphore| {
                    vk::SemaphoreSubmitInfo::default()
                        .semaphore(semaphore)
                        .stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
                })
                .collect();
            let mut signals = vec![
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(queue.timeline)
                    .value(value)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS),
            ];
            signals.extend(then.map(|semaphore| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(semaphore)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            }));
            let info = vk::SubmitInfo2::default()
                .command_buffer_infos(&buffers)
                .wait_semaphore_infos(&waits)
                .signal_semaphore_infos(&signals);
            raw.queue_submit2(queue.raw, &[info], vk::Fence::null())
                .named("vkQueueSubmit2")?;
            *submitted = value;
            drop(submitted);
            Ok(Submission {
                recording: self,
                value,
            })
        }
    }

    /// Reads the timestamps of a finished recording.
    fn timings(&self) -> Result<Vec<Timing>, Error> {
        if self.spans.is_empty() {
            return Ok(Vec::new());
        }
        let mut ticks = vec![0u64; 2 * self.spans.len()];
        // SAFETY: both stamps of every span were written.
        unsafe {
            self.device
                .raw
                .get_query_pool_results(
                    self.queries,
                    0,
                    &mut ticks,
                    vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
                )
                .named("vkGetQueryPoolResults")?;
        }
        let to_ms = f64::from(self.device.queue.timestamp_period) * 1e-6;
        let spans = self.spans.iter().zip(ticks.chunks_exact(2));
        Ok(spans
            .map(|(&name, t)| Timing {
                name,
                milliseconds: t[1].wrapping_sub(t[0]) as f64 * to_ms,
            })
            .collect())
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        // SAFETY: either never submitted, or its submission has waited. (If the wait failed the device
        // is lost, and destroying is allowed.) Destroying null handles is allowed.
        unsafe {
            self.device.raw.destroy_query_pool(self.queries, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// A recording that the GPU works on. Dropping it waits.
pub struct Submission {
    recording: Recording,
    /// What the queue's semaphore is when the work is done.
    value: u64,
}

impl Submission {
    /// Waits until the GPU is done. Returns the GPU times of the spans, in order.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait(self) -> Result<Vec<Timing>, Error> {
        self.wait_for_it()?;
        self.recording.timings()
    }

    /// Whether the GPU is done.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn is_done(&self) -> Result<bool, Error> {
        let device = &self.recording.device;
        // SAFETY: the semaphore lives as long as the device.
        let value = unsafe { (device.raw).get_semaphore_counter_value(device.queue.timeline) };
        Ok(value.named("vkGetSemaphoreCounterValue")? >= self.value)
    }

    fn wait_for_it(&self) -> Result<(), Error> {
        let device = &self.recording.device;
        let (semaphores, values) = ([device.queue.timeline], [self.value]);
        let wait = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        // SAFETY: the semaphore lives as long as the device.
        unsafe { device.raw.wait_semaphores(&wait, u64::MAX) }.named("vkWaitSemaphores")
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        // What it uses is freed next. A lost device uses nothing any more.
        let _ = self.wait_for_it();
    }
}
