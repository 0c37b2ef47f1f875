//! What a moment of a scene has: everything that frames change, in one buffer that is written at once.

use super::loose::LOOSE;
use super::poses::{self, Posed};
use super::{GpuScene, finish, light, material, placement};
use crate::abi;
use crate::vk::{Buffer, Error, Location, Recording, Tlas, TlasInstance, Usage};
use bytemuck::Zeroable as _;
use glam::{Affine3A, Vec3};
use scene::emitter::{MovingLight, MovingLights};
use scene::frame::Past;
use scene::{Frame, Instance, Scene, SeenBy};

/// Alignment of the parts of the buffer.
const ALIGNMENT: usize = 256;

/// The arrays of a moment, one after the other.
struct Arrays {
    bytes: Vec<u8>,
}

impl Arrays {
    /// Adds an array; returns where it begins.
    fn add<T: bytemuck::NoUninit>(&mut self, data: &[T]) -> u64 {
        let at = self.bytes.len();
        self.bytes.extend_from_slice(bytemuck::cast_slice(data));
        let end = self.bytes.len().next_multiple_of(ALIGNMENT);
        self.bytes.resize(end, 0);
        at as u64
    }
}

/// An instance's number and flags, as hit shaders read them.
fn custom_index(number: usize, instance: &Instance, posed: bool) -> u32 {
    let flag = |on: bool, flag: u32| if on { flag } else { 0 };
    number as u32
        | flag(
            instance.transform != Affine3A::IDENTITY,
            abi::INSTANCE_PLACED,
        )
        | flag(posed, abi::INSTANCE_POSED)
        | flag(!instance.seen_by.others(), abi::INSTANCE_APART)
}

/// Which rays meet an instance.
fn mask(seen_by: SeenBy) -> u8 {
    let mask = match (seen_by.camera(), seen_by.others()) {
        (true, true) => abi::MASK_ALL,
        (true, false) => abi::MASK_CAMERA,
        (false, _) => abi::MASK_OTHERS,
    };
    mask as u8
}

impl GpuScene {
    /// Shows a moment: records what follows from where everything is. The frame fits the scene
    /// ([`Frame::check`]); `size` is that of the picture.
    ///
    /// # Errors
    /// When it is larger than the device allows, or there is no memory.
    pub fn record_moment(
        &mut self,
        recording: &mut Recording,
        frame: &Frame,
        size: [u32; 2],
    ) -> Result<(), Error> {
        // Instances as they are, then those that moved as they were.
        let were = as_they_were(frame);
        let shown: Vec<&Instance> = frame.instances.iter().chain(&were).collect();
        let mut posed = match &mut self.poses {
            Some(poses) => {
                let posed = poses.record(recording, &shown)?;
                self.data.posed_corners = poses.corners();
                posed
            }
            None => vec![None; shown.len()],
        };
        let posed_before = posed.split_off(frame.instances.len());
        let pasts = self.pasts(frame, &posed_before);
        let mut placed = self.placed(frame, &posed);
        let loose = self.record_loose(recording, &frame.loose, frame.instances.len())?;
        let moving = MovingLights::new(&self.scene, frame);
        self.tell_view_before(frame, size);
        self.record_arrays(recording, frame, &posed, &pasts, &moving)?;
        placed.extend(loose);
        if placed.len() > self.tlas.capacity() as usize {
            let device = recording.device().clone();
            self.tlas = Tlas::new(&device, (placed.len() as u32).next_power_of_two())?;
        }
        self.tlas.record_build(recording, &placed)?;
        self.bounds = self.bounds_of(frame);
        Ok(())
    }

    /// The instances of a frame for the top-level structure. Meshes without triangles are left out.
    fn placed(&self, frame: &Frame, posed: &[Option<Posed>]) -> Vec<TlasInstance> {
        (frame.instances.iter().zip(posed).enumerate())
            .filter_map(|(number, (instance, posed))| {
                let blas = match posed {
                    Some(posed) => posed.blas.clone(),
                    None => self.blas[instance.mesh].clone()?,
                };
                Some(TlasInstance {
                    blas,
                    transform: instance.transform,
                    custom_index: custom_index(number, instance, posed.is_some()),
                    mask: mask(instance.seen_by),
                    hit_group: u32::from(self.scene.meshes[instance.mesh].first_see_through == 0),
                })
            })
            .collect()
    }

    /// Writes the arrays that shaders read.
    fn record_arrays(
        &mut self,
        recording: &mut Recording,
        frame: &Frame,
        posed: &[Option<Posed>],
        pasts: &[abi::Past],
        moving: &MovingLights,
    ) -> Result<(), Error> {
        let scene = self.scene.clone();
        let probabilities = probabilities(frame, moving);
        let mut instances: Vec<abi::Instance> = (frame.instances.iter().enumerate())
            .map(|(number, i)| self.instance(number, i))
            .collect();
        let mut figures: Vec<abi::Figure> = (frame.instances.iter().zip(posed).enumerate())
            .map(|(number, (instance, posed))| abi::Figure {
                skin: instance.material.map_or(abi::NO_SKIN, |m| m.0),
                posed: posed.as_ref().map_or(0, |p| {
                    p.first
                        .wrapping_sub(self.parts[instance.mesh].triangle_base)
                }),
                probability: probabilities[number],
                ..self.shading(instance)
            })
            .collect();
        // The loose triangles are an instance behind the others.
        instances.push(self.loose_instance(&frame.loose));
        figures.push(LOOSE);
        let own = scene.emitters.total_weight;
        let per_weight = if own > 0.0 { 1.0 / own } else { 0.0 };
        let lights: Vec<abi::Light> = (scene.lights_now(&frame.styles).iter())
            .zip(&scene.lights)
            // A style that is dark now does not change the choice.
            .map(|(now, listed)| light(now, listed.weight() * per_weight))
            .collect();
        let styles = scene.styles_now(&frame.styles);
        let light_styles: Vec<abi::StyleOfLight> = (scene.lights.iter())
            .map(|l| {
                let plane = scene.style_of(l);
                abi::StyleOfLight {
                    plane: plane as u32,
                    brightness: styles.get(plane).map_or(1.0, |s| s.brightness),
                }
            })
            .collect();
        let spheres: Vec<abi::Light> = frame.lights.iter().map(|l| light(l, 0.0)).collect();
        let moving_lights = self.moving_lights(frame, posed, moving);
        let (materials, finishes) = self.looks(frame);
        let [scale, veil] = scene.sky_now(frame.fog);

        let mut arrays = Arrays { bytes: Vec::new() };
        arrays.add(&[self.data]);
        let places = [
            arrays.add(&instances),
            arrays.add(&figures),
            arrays.add(pasts),
            arrays.add(&super::loose::corners_before(frame)),
            arrays.add(&lights),
            arrays.add(&light_styles),
            arrays.add(&spheres),
            arrays.add(&moving_lights),
            arrays.add(&materials),
            arrays.add(&finishes),
        ];
        let size = arrays.bytes.len() as u64;
        if self.moment.size() < size {
            let room = size.next_power_of_two();
            let device = recording.device().clone();
            let usage = Usage::STORAGE_BUFFER;
            self.moment = Buffer::new(&device, "moment", room, usage, Location::Device)?;
            self.address = self.moment.address();
        }
        let [
            instances,
            figures,
            pasts,
            loose_corners,
            lights,
            light_styles,
            spheres,
            moving_lights,
            materials_now,
            finishes_now,
        ] = places.map(|at| self.address + at);
        self.data = abi::SceneData {
            instances,
            figures,
            pasts,
            loose_corners,
            lights,
            light_styles,
            moving_spheres: spheres,
            moving_lights,
            moving_share: moving.share,
            moving_count: moving.lights.len() as u32,
            sky_upper: scale[0].to_array(),
            sky_lower: scale[1].to_array(),
            veil_upper: veil[0].to_array(),
            veil_lower: veil[1].to_array(),
            fog_albedo: frame.fog.map_or([0.0; 3], |f| f.albedo.to_array()),
            fog_extinction: frame.fog.map_or(0.0, |f| f.extinction),
            ..self.data
        };
        if !materials.is_empty() {
            self.data.materials = materials_now;
            self.data.finishes = finishes_now;
        }
        let head = bytemuck::bytes_of(&self.data);
        arrays.bytes[..head.len()].copy_from_slice(head);
        let device = recording.device().clone();
        let staged = Buffer::with_data(&device, "moment", Usage::empty(), &arrays.bytes)?;
        recording.span("upload moment", |r| {
            r.copy(&staged, &self.moment, (0, 0), size);
            Ok(())
        })
    }

    /// Which normals an instance is shaded with; the rest is 0.
    fn shading(&self, instance: &Instance) -> abi::Figure {
        let part = &self.parts[instance.mesh];
        let Some(first) = part.first_normals else {
            return abi::Figure::zeroed();
        };
        let (_, from, to, fraction) = poses::key(instance);
        let triangles = self.scene.meshes[instance.mesh].triangles.len() as u32;
        let of_pose = |pose: u32| (first + pose * triangles).wrapping_sub(part.triangle_base);
        abi::Figure {
            smooth_shaded: 1,
            normals_from: of_pose(from),
            normals_to: of_pose(to),
            fraction: f32::from_bits(fraction),
            ..abi::Figure::zeroed()
        }
    }

    /// The record of an instance.
    fn instance(&self, number: usize, instance: &Instance) -> abi::Instance {
        let (part, mesh) = (
            &self.parts[instance.mesh],
            &self.scene.meshes[instance.mesh],
        );
        let alpha_base = part.triangle_base + part.first_see_through;
        // A mesh of alpha-tested triangles alone has them as geometry 0.
        let only_alpha = mesh.first_see_through == 0;
        let source_start = match self.scene.features.frames {
            false => self.source_starts[number],
            true if number == 0 => self.source_starts[0],
            true => (self.scene.moving.list_of(instance))
                .map_or(0, |list| self.source_starts[1 + list as usize]),
        };
        abi::Instance {
            opaque_base: if only_alpha {
                alpha_base
            } else {
                part.triangle_base
            },
            alpha_base,
            source_offset: source_start.wrapping_sub(part.triangle_base),
            ..placement(&instance.transform)
        }
    }

    /// What materials look like in a frame; nothing if it is what they always do.
    fn looks(&self, frame: &Frame) -> (Vec<abi::Material>, Vec<abi::Finish>) {
        let scene = &self.scene;
        let changes = |m: &scene::Material| !m.frames.is_empty();
        if !scene.features.frames || !scene.materials.iter().any(changes) {
            return (Vec::new(), Vec::new());
        }
        (scene.looks(frame.time).iter())
            .map(|id| {
                let shown = &scene.materials[id.0 as usize];
                (material(shown, scene), finish(&shown.finish))
            })
            .unzip()
    }

    /// Where the instances of a frame were, and the loose triangles behind them, as shaders read it;
    /// `posed` has those that moved. Empty if there was no picture before.
    fn pasts(&self, frame: &Frame, posed: &[Option<Posed>]) -> Vec<abi::Past> {
        let Some(before) = &frame.before else {
            return Vec::new();
        };
        let mut posed = posed.iter();
        let past = |(instance, past): (&Instance, &Option<Past>)| {
            let (Some(past), Some(posed)) = (past, past.and_then(|_| posed.next())) else {
                return abi::Past::default();
            };
            let abi::Instance {
                row0, row1, row2, ..
            } = placement(&past.transform);
            let part = &self.parts[instance.mesh];
            abi::Past {
                row0,
                row1,
                row2,
                posed: (posed.as_ref()).map_or(0, |p| p.first.wrapping_sub(part.triangle_base)),
                flags: abi::PAST_MOVED | posed.as_ref().map_or(0, |_| abi::PAST_POSED),
                padding: [0; 2],
            }
        };
        let mut all: Vec<abi::Past> = (frame.instances.iter().zip(&before.instances))
            .map(past)
            .collect();
        all.push(match before.loose.is_empty() {
            true => abi::Past::default(),
            false => abi::Past {
                posed: 0_u32.wrapping_sub(self.own_triangles),
                flags: abi::PAST_MOVED | abi::PAST_LOOSE,
                ..abi::Past::default()
            },
        });
        all
    }

    /// Says how the picture before was seen.
    fn tell_view_before(&mut self, frame: &Frame, [width, height]: [u32; 2]) {
        self.data.has_before = u32::from(frame.before.is_some());
        if let Some(before) = &frame.before {
            let view = before.camera.view_basis(width, height);
            let axes = [view.origin, view.forward, view.right, view.up];
            let [origin, forward, right, up] = axes.map(|v| v.as_vec3().to_array());
            self.data.before_origin = origin;
            self.data.before_forward = forward;
            self.data.before_right = right;
            self.data.before_up = up;
        }
    }

    /// The choice among what moves, as shaders read it.
    fn moving_lights(
        &self,
        frame: &Frame,
        posed: &[Option<Posed>],
        moving: &MovingLights,
    ) -> Vec<abi::MovingLight> {
        let entries = (moving.lights.iter().zip(&moving.probabilities)).zip(&moving.alias);
        entries
            .map(|((light, probability), &(keep, other))| {
                let entry = abi::MovingLight {
                    instance: abi::NO_INSTANCE,
                    first: 0,
                    count: 0,
                    alias: 0,
                    probability: moving.share * probability,
                    keep,
                    other,
                    padding: 0,
                };
                match *light {
                    MovingLight::Point(first) => abi::MovingLight { first, ..entry },
                    MovingLight::Instance { number, list } => {
                        let number = number as usize;
                        let (instance, posed) = (&frame.instances[number], &posed[number]);
                        let list = &self.lists[list as usize];
                        abi::MovingLight {
                            instance: custom_index(number, instance, posed.is_some()),
                            first: list.first_emitter,
                            count: list.emitters,
                            alias: list.first_alias,
                            ..entry
                        }
                    }
                }
            })
            .collect()
    }

    /// Bounds of a frame and the scene.
    fn bounds_of(&self, frame: &Frame) -> (Vec3, Vec3) {
        let scene = &self.scene;
        let mut bounds = (scene.bounds_min, scene.bounds_max);
        let mut hold = |p: Vec3| bounds = (bounds.0.min(p), bounds.1.max(p));
        for instance in frame.instances.iter().skip(1) {
            let (low, high) = self.parts[instance.mesh].bounds;
            for corner in 0..8 {
                let pick = |axis: usize| [low, high][corner >> axis & 1][axis];
                let p = Vec3::new(pick(0), pick(1), pick(2));
                if p.is_finite() {
                    hold(instance.transform.transform_point3(p));
                }
            }
        }
        frame.loose.positions.iter().copied().for_each(hold);
        bounds
    }

    /// The moment that the scene holds, whatever the camera.
    pub(super) fn first_moment(scene: &Scene) -> Frame {
        Frame {
            camera: scene::Camera {
                name: String::new(),
                position: Vec3::ZERO,
                pitch_deg: 0.0,
                yaw_deg: 0.0,
                roll_deg: 0.0,
                fov_deg: scene::camera::DEFAULT_FOV_DEG,
                lens: None,
            },
            time: 0.0,
            instances: scene.instances.clone(),
            loose: scene::Mesh::default(),
            drifts: Vec::new(),
            lights: Vec::new(),
            styles: scene.brightness.clone(),
            fog: scene.fog,
            before: None,
        }
    }
}

/// The instances of a frame that moved, as they were in the picture before.
fn as_they_were(frame: &Frame) -> Vec<Instance> {
    let Some(before) = &frame.before else {
        return Vec::new();
    };
    let pairs = frame.instances.iter().zip(&before.instances);
    pairs
        .filter_map(|(instance, past)| {
            let Past { transform, pose } = (*past)?;
            Some(Instance {
                transform,
                pose,
                ..instance.clone()
            })
        })
        .collect()
}

/// By instance, the probability with which light sampling chooses it.
fn probabilities(frame: &Frame, moving: &MovingLights) -> Vec<f32> {
    let mut all = vec![0.0; frame.instances.len()];
    for (light, probability) in moving.lights.iter().zip(&moving.probabilities) {
        if let MovingLight::Instance { number, .. } = *light {
            all[number as usize] = moving.share * probability;
        }
    }
    all
}
