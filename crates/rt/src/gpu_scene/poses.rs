//! Models in poses: each pose that is shown has its corners and a bottom-level structure, which instances
//! share and frames reuse.

use crate::passes::pose::{PoseJob, PosePass};
use crate::vk::{
    Blas, BlasGeometry, BlasInput, Buffer, Device, Error, Location, Rebuild, Recording, Scratch,
    Usage,
};
use scene::{Instance, Mesh, PoseBlend};
use std::collections::HashMap;
use std::sync::Arc;

/// Bytes of a triangle's corners.
const CORNERS: u64 = 36;

/// A mesh with poses.
#[derive(Clone, Debug)]
struct PosedMesh {
    name: String,
    /// Vertices of one pose.
    vertices: u32,
    /// First vertex of its first pose among all.
    first_vertex: u32,
    /// First of its triangles among those of meshes with poses.
    first_triangle: u32,
    triangles: u32,
    first_see_through: u32,
    /// Whether the any-hit shader is called at most once for each triangle and ray.
    once: bool,
}

/// One pose of one mesh: the corners of its triangles and the structure over them.
struct Slot {
    key: Key,
    /// First of its triangles among the corners.
    first: u32,
    blas: Arc<Blas>,
}

/// A mesh and a pose, with the fraction as bits.
pub(super) type Key = (usize, u32, u32, u32);

/// Where an instance in a pose is.
#[derive(Clone)]
pub(super) struct Posed {
    /// The structure.
    pub blas: Arc<Blas>,
    /// First of its triangles among the corners.
    pub first: u32,
}

/// All meshes with poses, and the poses that are shown.
pub(super) struct Poses {
    pass: PosePass,
    positions: Arc<Buffer>,
    indices: Arc<Buffer>,
    meshes: Vec<Option<PosedMesh>>,
    /// By mesh, the structure over its first pose: what all others are updated from, so that they
    /// depend on nothing that was shown before.
    models: Vec<Option<Arc<Blas>>>,
    slots: Vec<Slot>,
    corners: Arc<Buffer>,
    /// Triangles that the corners have room for.
    room: u32,
    scratch: Scratch,
}

/// What an instance shows; a pose alone is on its way to itself.
pub(super) fn key(instance: &Instance) -> Key {
    let PoseBlend { from, to, fraction } = instance.pose;
    if fraction == 0.0 || from == to {
        return (instance.mesh, from, from, 0);
    }
    (instance.mesh, from, to, fraction.to_bits())
}

impl Poses {
    /// Uploads what has poses and builds its structures; `None` if nothing has.
    pub fn new(device: &Arc<Device>, meshes: &[Mesh], once: bool) -> Result<Option<Self>, Error> {
        let (mut positions, mut indices) = (Vec::<[f32; 3]>::new(), Vec::<[u32; 3]>::new());
        let mut posed = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            let has_triangles = !mesh.poses.is_empty() && !mesh.triangles.is_empty();
            posed.push(has_triangles.then(|| PosedMesh {
                name: format!("BLAS {}", mesh.name),
                vertices: mesh.positions.len() as u32,
                first_vertex: positions.len() as u32,
                first_triangle: indices.len() as u32,
                triangles: mesh.triangles.len() as u32,
                first_see_through: mesh.first_see_through as u32,
                once,
            }));
            if has_triangles {
                positions.extend(mesh.poses.iter().flatten().map(|p| p.to_array()));
                indices.extend(mesh.triangles.iter().map(|t| t.vertices));
            }
        }
        if indices.is_empty() {
            return Ok(None);
        }
        let mut recording = Recording::begin(device)?;
        let mut upload = |name, bytes: &[u8]| -> Result<Arc<Buffer>, Error> {
            let size = bytes.len() as u64;
            let usage = Usage::STORAGE_BUFFER;
            let buffer = Buffer::new(device, name, size, usage, Location::Device)?;
            let staged = Buffer::with_data(device, name, Usage::empty(), bytes)?;
            recording.copy(&staged, &buffer, (0, 0), size);
            Ok(buffer)
        };
        let room = indices.len() as u32;
        let mut poses = Self {
            pass: PosePass::new(device)?,
            positions: upload("poses", bytemuck::cast_slice(&positions))?,
            indices: upload("corners of poses", bytemuck::cast_slice(&indices))?,
            models: vec![None; posed.len()],
            meshes: posed,
            slots: Vec::new(),
            corners: corners(device, room)?,
            room,
            scratch: Scratch::default(),
        };
        poses.record_models(&mut recording)?;
        recording.submit_and_wait()?;
        Ok(Some(poses))
    }

    /// Records the structures over the first poses.
    fn record_models(&mut self, recording: &mut Recording) -> Result<(), Error> {
        let device = recording.device().clone();
        let (mut jobs, mut rebuilds) = (Vec::new(), Vec::new());
        for (number, mesh) in self.meshes.iter().enumerate() {
            let Some(mesh) = mesh else { continue };
            let first = mesh.first_triangle;
            jobs.push(mesh.job((number, 0, 0, 0), first));
            let input = mesh.input(&self.corners, first);
            let blas = Blas::for_frames(&device, &input)?;
            self.models[number] = Some(blas.clone());
            rebuilds.push(Rebuild {
                blas,
                input,
                from: None,
            });
        }
        (self.pass).record(
            recording,
            &self.positions,
            &self.indices,
            &jobs,
            &self.corners,
        )?;
        Blas::record_rebuilds(recording, &rebuilds, &mut self.scratch)
    }

    /// Address of the corners.
    pub fn corners(&self) -> u64 {
        self.corners.address()
    }

    /// Bytes of the structures over the first poses.
    pub fn model_bytes(&self) -> u64 {
        self.models.iter().flatten().map(|b| b.size()).sum()
    }

    /// Records the poses of instances that are not there yet; spans `pose` and `refit BLAS`. Returns by
    /// instance where its pose is, `None` for rigid ones.
    pub fn record(
        &mut self,
        recording: &mut Recording,
        instances: &[&Instance],
    ) -> Result<Vec<Option<Posed>>, Error> {
        // Slots by what they show; of those that nothing wants, which have the right mesh.
        let mut shown: HashMap<Key, usize> = HashMap::new();
        let mut wanted: Vec<(usize, Option<Key>)> = Vec::new();
        let known: HashMap<Key, usize> =
            (self.slots.iter().enumerate().map(|(i, s)| (s.key, i))).collect();
        for (number, instance) in instances.iter().enumerate() {
            let has_poses = self.meshes[instance.mesh].is_some();
            let key = has_poses.then(|| key(instance));
            wanted.push((number, key));
            if let Some((key, slot)) = key.and_then(|k| Some((k, *known.get(&k)?))) {
                shown.insert(key, slot);
            }
        }
        let mut is_free = vec![true; self.slots.len()];
        shown.values().for_each(|&slot| is_free[slot] = false);
        let mut free: HashMap<usize, Vec<usize>> = HashMap::new();
        for (slot, _) in is_free.iter().enumerate().rev().filter(|(_, free)| **free) {
            free.entry(self.slots[slot].key.0).or_default().push(slot);
        }
        let mut changed = Vec::new();
        for key in wanted.iter().filter_map(|(_, key)| *key) {
            if shown.contains_key(&key) {
                continue;
            }
            let slot = match free.get_mut(&key.0).and_then(Vec::pop) {
                Some(slot) => {
                    self.slots[slot].key = key;
                    slot
                }
                None => self.add_slot(recording.device(), key)?,
            };
            shown.insert(key, slot);
            changed.push(slot);
        }
        let used: u32 = (self.slots.last()).map_or(0, |s| {
            s.first + self.mesh(s.key.0).map_or(0, |m| m.triangles)
        });
        if used > self.room {
            self.room = used.next_power_of_two();
            self.corners = corners(recording.device(), self.room)?;
            changed = (0..self.slots.len()).collect();
        }
        self.record_slots(recording, &changed)?;
        recording.keep(self.corners.clone());
        let posed = |key: Key| {
            let slot = &self.slots[shown[&key]];
            Posed {
                blas: slot.blas.clone(),
                first: slot.first,
            }
        };
        Ok(wanted.iter().map(|(_, key)| key.map(posed)).collect())
    }

    fn mesh(&self, number: usize) -> Option<&PosedMesh> {
        self.meshes[number].as_ref()
    }

    /// Adds a slot behind the others, where there may be no room for its corners yet.
    fn add_slot(&mut self, device: &Arc<Device>, key: Key) -> Result<usize, Error> {
        let end = |s: &Slot| s.first + self.mesh(s.key.0).map_or(0, |m| m.triangles);
        let first = self.slots.last().map_or(0, end);
        let Some(mesh) = self.mesh(key.0) else {
            return Err(Error::Scene("a rigid mesh has no poses"));
        };
        let blas = Blas::for_frames(device, &mesh.input(&self.corners, 0))?;
        self.slots.push(Slot { key, first, blas });
        Ok(self.slots.len() - 1)
    }

    fn record_slots(&mut self, recording: &mut Recording, slots: &[usize]) -> Result<(), Error> {
        let (mut jobs, mut rebuilds) = (Vec::new(), Vec::new());
        for slot in slots.iter().map(|&i| &self.slots[i]) {
            let Some(mesh) = self.mesh(slot.key.0) else {
                continue;
            };
            jobs.push(mesh.job(slot.key, slot.first));
            rebuilds.push(Rebuild {
                blas: slot.blas.clone(),
                input: mesh.input(&self.corners, slot.first),
                from: self.models[slot.key.0].clone(),
            });
        }
        if jobs.is_empty() {
            return Ok(());
        }
        recording.span("pose", |r| {
            (self.pass).record(r, &self.positions, &self.indices, &jobs, &self.corners)
        })?;
        recording.span("refit BLAS", |r| {
            Blas::record_rebuilds(r, &rebuilds, &mut self.scratch)
        })
    }
}

impl PosedMesh {
    /// Its corners in a pose, from triangle `first` of the output on.
    fn job(&self, (_, from, to, fraction): Key, first: u32) -> PoseJob {
        PoseJob {
            poses: [from, to].map(|pose| self.first_vertex + pose * self.vertices),
            first_index: 3 * self.first_triangle,
            corners: 3 * self.triangles,
            fraction: f32::from_bits(fraction),
            first_corner: 3 * first,
            padding: [0; 2],
        }
    }

    /// Its triangles, whose corners begin with those of triangle `first`.
    fn input(&self, corners: &Arc<Buffer>, first: u32) -> BlasInput {
        BlasInput {
            name: self.name.clone(),
            positions: corners.clone(),
            position_offset: u64::from(first) * CORNERS,
            position_count: 3 * self.triangles,
            indices: None,
            geometries: geometries(self.first_see_through, self.triangles, self.once),
        }
    }
}

/// The opaque and the other triangles of a mesh; those of which there are none are left out.
pub(super) fn geometries(first_see_through: u32, triangles: u32, once: bool) -> Vec<BlasGeometry> {
    let part = |first, end, opaque| BlasGeometry {
        first,
        triangles: end - first,
        opaque,
        once,
    };
    let both = [
        part(0, first_see_through, true),
        part(first_see_through, triangles, false),
    ];
    both.into_iter().filter(|g| g.triangles > 0).collect()
}

fn corners(device: &Arc<Device>, triangles: u32) -> Result<Arc<Buffer>, Error> {
    let usage = Usage::STORAGE_BUFFER | Usage::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
    let size = u64::from(triangles) * CORNERS;
    Buffer::new(device, "posed corners", size, usage, Location::Device)
}
