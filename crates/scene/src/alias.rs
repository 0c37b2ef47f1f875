//! Alias models as meshes with poses: which poses a frame shows at a time, and which skin.

use crate::material::MaterialId;
use crate::mesh::{Mesh, PoseBlend, Triangle};
use crate::smooth::PackedNormal;
use bsp::Cycle;
use bsp::mdl::Mdl;
use bsp::posed::PosedSurface;
use glam::{Affine3A, DVec3, Quat, Vec2, Vec3};

/// Models whose poses engines never blend: flames, whose vertices jump from pose to pose.
const NEVER_BLENDED: [&str; 8] = [
    "flame",
    "flame2",
    "flame_pyre",
    "braztall",
    "brazshrt",
    "longtrch",
    "v_saw",
    "v_xfist",
];
/// Models that show a flame.
const FLAMES: [&str; 4] = ["flame", "flame0", "flame2", "flame3"];
/// Models that shine all over.
const BOLTS: [&str; 6] = ["bolt", "bolt2", "bolt3", "laser", "lavaball", "s_light"];

/// An alias model: a mesh with all its poses, and what its frames and skins show.
#[derive(Clone, Debug)]
pub struct AliasModel {
    /// All poses, in order of the frames; the triangles show the first skin. Rigid if there is one pose
    /// only.
    pub mesh: Mesh,
    /// At least one.
    pub frames: Vec<Sequence>,
    /// At least one.
    pub skins: Vec<Skin>,
    /// Bits of [`bsp::mdl::flags`].
    pub flags: u32,
    /// Whether its groups begin at another time for each entity.
    pub random_start: bool,
    /// Whether poses are blended; else one is shown until the next one is.
    pub blends: bool,
}

/// The poses of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    /// Index into [`Mesh::poses`].
    pub first: u32,
    /// When each is shown, if there are several.
    pub cycle: Option<Cycle>,
}

/// The pictures of a skin.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// At least one.
    pub materials: Vec<MaterialId>,
    /// When each is shown, if there are several.
    pub cycle: Option<Cycle>,
}

impl AliasModel {
    /// The model called `name` (`progs/soldier.mdl`). `paint` gives the material of a picture of a
    /// skin: its number among the skins, its number in a group, its palette indices.
    #[must_use]
    pub fn new(
        name: &str,
        model: &Mdl,
        mut paint: impl FnMut(usize, usize, &[u8]) -> MaterialId,
    ) -> Self {
        let skins: Vec<Skin> = (model.skins.iter().enumerate())
            .map(|(number, skin)| Skin {
                materials: (skin.pictures.iter().enumerate())
                    .map(|(part, pixels)| paint(number, part, pixels))
                    .collect(),
                cycle: skin.cycle.clone(),
            })
            .collect();
        let mut frames = Vec::with_capacity(model.frames.len());
        let mut poses: Vec<Vec<Vec3>> = Vec::with_capacity(model.pose_count());
        for frame in &model.frames {
            frames.push(Sequence {
                first: poses.len() as u32,
                cycle: frame.cycle.clone(),
            });
            let place = |&v: &[u8; 4]| Vec3::from(model.position(v));
            poses.extend((frame.poses.iter()).map(|p| p.vertices.iter().map(place).collect()));
        }
        let positions = poses.first().map_or(&[][..], Vec::as_slice);
        let triangles: Vec<Triangle> = (model.triangles.iter().zip(0..))
            .map(|(t, face)| {
                // The file runs clockwise.
                let [a, c, b] = t.vertices;
                let vertices = [a, b, c];
                Triangle {
                    vertices,
                    uv: spread(vertices.map(|v| model.skin_coordinates(t, v))),
                    normal: facet(positions, vertices).unwrap_or(Vec3::Z),
                    material: MaterialId(0),
                    face,
                }
            })
            .collect();
        Self {
            mesh: mesh(name, poses, triangles),
            frames,
            skins: Vec::new(),
            flags: model.header.flags,
            random_start: model.header.sync_type != 0,
            blends: !NEVER_BLENDED.contains(&stem(name)),
        }
        .wearing(skins)
    }

    /// What a frame shows at `time` (seconds, with what [`phase`] adds): the pose of a single frame, or
    /// the part of a group on its way to the next one. Frames that do not exist are the first.
    #[must_use]
    pub fn pose(&self, frame: usize, time: f64) -> PoseBlend {
        let Some(sequence) = self.frames.get(frame).or(self.frames.first()) else {
            return PoseBlend::default();
        };
        let Some(cycle) = &sequence.cycle else {
            return self.at(sequence.first, sequence.first, 0.0);
        };
        let (part, gone) = cycle.at(time);
        let next = (part + 1) % cycle.parts();
        self.at(
            sequence.first + part as u32,
            sequence.first + next as u32,
            gone,
        )
    }

    /// What is shown `fraction` (0 to 1) of the way from one frame to another.
    #[must_use]
    pub fn between(&self, from: usize, to: usize, fraction: f32, time: f64) -> PoseBlend {
        if from == to {
            return self.pose(to, time);
        }
        let (from, to) = (self.pose(from, time), self.pose(to, time));
        self.at(from.from, to.from, fraction)
    }

    fn at(&self, from: u32, to: u32, fraction: f32) -> PoseBlend {
        if self.blends && from != to {
            PoseBlend { from, to, fraction }
        } else {
            let pose = if fraction < 1.0 { from } else { to };
            PoseBlend {
                from: pose,
                to: pose,
                fraction: 0.0,
            }
        }
    }

    /// Which picture a skin shows at `time` (seconds): the skin's number, and the picture's in it. Skins
    /// that do not exist are the first.
    #[must_use]
    pub fn picture(&self, skin: usize, time: f64) -> (usize, usize) {
        let skin = if skin < self.skins.len() { skin } else { 0 };
        let cycle = self.skins.get(skin).and_then(|s| s.cycle.as_ref());
        (skin, cycle.map_or(0, |c| c.at(time).0))
    }

    /// The material of a skin at `time` (seconds). Skins that do not exist are the first.
    #[must_use]
    pub fn skin(&self, skin: usize, time: f64) -> MaterialId {
        let (skin, part) = self.picture(skin, time);
        let skin = self.skins.get(skin);
        let material = skin.and_then(|s| s.materials.get(part));
        material.copied().unwrap_or(MaterialId(0))
    }

    /// A rigid mesh of one pose in one skin. Triangles without area are left out.
    #[must_use]
    pub fn posed(&self, pose: PoseBlend, material: MaterialId) -> Mesh {
        let positions = self.mesh.posed(pose).into_owned();
        let mut normals = Vec::new();
        let triangles: Vec<Triangle> = (self.mesh.triangles.iter().enumerate())
            .filter_map(|(number, t)| {
                let normal = facet(&positions, t.vertices)?;
                let smooth = self.mesh.corner_normals(number, pose);
                normals.extend(smooth.map(|n| n.map(PackedNormal::new)));
                Some(Triangle {
                    normal,
                    material,
                    ..*t
                })
            })
            .collect();
        Mesh {
            name: self.mesh.name.clone(),
            positions,
            first_see_through: triangles.len(),
            triangles,
            normals: if normals.is_empty() {
                Vec::new()
            } else {
                vec![normals]
            },
            ..Mesh::default()
        }
    }
}

impl AliasModel {
    /// A surface of the model `name` that stands for an alias model: of `poses` (the vertices of all surfaces in each
    /// frame) those from `first` on. Its pictures are of `size`, and each skin has as many of them as `pictures` says.
    #[must_use]
    pub fn posed_surface(
        name: &str,
        surface: &PosedSurface,
        poses: &[Vec<[f32; 3]>],
        first: usize,
        size: [u32; 2],
        pictures: &[usize],
        flags: u32,
    ) -> Self {
        let own = first..first + surface.uv.len();
        let of_pose = |pose: &Vec<[f32; 3]>| -> Vec<Vec3> {
            let places = pose.get(own.clone()).unwrap_or_default();
            places.iter().map(|&p| p.into()).collect()
        };
        let poses: Vec<Vec<Vec3>> = poses.iter().map(of_pose).collect();
        let positions = poses.first().map_or(&[][..], Vec::as_slice);
        let [width, height] = size.map(|n| n as f32);
        let triangles: Vec<Triangle> = (surface.triangles.iter().zip(0..))
            .map(|(&[a, c, b], face)| {
                // The file runs clockwise.
                let vertices = [a, b, c];
                let at = |v: u32| surface.uv.get(v as usize).copied().unwrap_or_default();
                Triangle {
                    vertices,
                    uv: spread(vertices.map(at).map(|[s, t]| [s * width, t * height])),
                    normal: facet(positions, vertices).unwrap_or(Vec3::Z),
                    material: MaterialId(0),
                    face,
                }
            })
            .collect();
        let frames = (0..poses.len().max(1) as u32).map(|first| Sequence { first, cycle: None });
        let skins = pictures.iter().map(|&n| Skin {
            materials: vec![MaterialId(0); n],
            // Engines show ten a second.
            cycle: (n > 1).then(|| Cycle::new(&vec![0.0; n]).0),
        });
        Self {
            frames: frames.collect(),
            skins: skins.collect(),
            flags,
            random_start: false,
            blends: !NEVER_BLENDED.contains(&stem(name)),
            mesh: mesh(name, poses, triangles),
        }
    }

    /// The same with the materials that `paint` gives: by the number of the skin, and of the picture in it.
    #[must_use]
    pub fn painted(&self, mut paint: impl FnMut(usize, usize) -> MaterialId) -> Self {
        let mut skins = self.skins.clone();
        for (number, skin) in skins.iter_mut().enumerate() {
            for (part, material) in skin.materials.iter_mut().enumerate() {
                *material = paint(number, part);
            }
        }
        self.clone().wearing(skins)
    }

    /// The same in these skins; its triangles show the first.
    fn wearing(mut self, skins: Vec<Skin>) -> Self {
        self.mesh.skins = skins.iter().flat_map(|s| &s.materials).copied().collect();
        self.skins = skins;
        let first = self.skin(0, 0.0);
        for triangle in &mut self.mesh.triangles {
            triangle.material = first;
        }
        self
    }
}

/// A mesh with these poses, rigid if there is one only.
fn mesh(name: &str, poses: Vec<Vec<Vec3>>, triangles: Vec<Triangle>) -> Mesh {
    let is_rigid = poses.len() <= 1;
    Mesh {
        name: name.to_owned(),
        positions: poses.first().cloned().unwrap_or_default(),
        first_see_through: triangles.len(),
        triangles,
        poses: if is_rigid { Vec::new() } else { poses },
        ..Mesh::default()
    }
}

/// Texture coordinates of a triangle that have an area: where a model's have none, a corner moves by less
/// than a texel, so that points on the triangle can be told from their coordinates.
fn spread(uv: [[f32; 2]; 3]) -> [[f32; 2]; 3] {
    /// Texels.
    const LEAST: f32 = 1.0 / 64.0;
    /// No skin reaches further; floats can tell parts of a texel up to there.
    const FURTHEST: f32 = 16_384.0;
    let [a, b, c] = uv.map(|c| Vec2::from(c).clamp(Vec2::splat(-FURTHEST), Vec2::splat(FURTHEST)));
    let (ab, ac) = (b - a, c - a);
    let spread = if ab.perp_dot(ac).abs() > LEAST * LEAST {
        [a, b, c]
    } else if let Some(along) = ab.try_normalize() {
        [a, b, c + along.perp() * LEAST]
    } else {
        let along = ac.try_normalize().unwrap_or(Vec2::X);
        [a, b + along.perp() * LEAST, c + along * LEAST]
    };
    spread.map(|c| c.to_array())
}

/// The unit normal of a facet, counter-clockwise seen from the front; `None` if it has no area.
fn facet(positions: &[Vec3], vertices: [u32; 3]) -> Option<Vec3> {
    let [a, b, c] = vertices.map(|v| positions.get(v as usize).map(|p| p.as_dvec3()));
    let (a, b, c): (DVec3, DVec3, DVec3) = (a?, b?, c?);
    Some((b - a).cross(c - a).try_normalize()?.as_vec3())
}

/// A file's name without its folder and ending: `flame` of `progs/flame.mdl`.
#[must_use]
pub fn stem(name: &str) -> &str {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// Whether a model of this name is a light: a flame or a bolt.
#[must_use]
pub fn is_luminous(name: &str) -> bool {
    FLAMES.contains(&stem(name)) || is_bolt(name)
}

/// Whether a model of this name shines all over, whatever its skin says.
#[must_use]
pub fn is_bolt(name: &str) -> bool {
    BOLTS.contains(&stem(name))
}

/// Seconds that the groups of an entity's model are ahead of the level's time, 0 to 1: `seed` tells
/// entities apart.
#[must_use]
pub fn phase(seed: u32) -> f64 {
    // SplitMix64 (Steele, Lea, Flood 2014).
    let z = u64::from(seed)
        .wrapping_add(1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Places an alias model: `angles` are an entity's pitch, yaw and roll in degrees. Positive pitch lifts
/// the nose of an alias model, other than that of a camera.
#[must_use]
pub fn placement(origin: Vec3, [pitch, yaw, roll]: [f32; 3], scale: f32) -> Affine3A {
    let turn = Quat::from_rotation_z(yaw.to_radians())
        * Quat::from_rotation_y(-pitch.to_radians())
        * Quat::from_rotation_x(roll.to_radians());
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, origin)
}

/// Yaw of a model that turns about itself ([`bsp::mdl::flags::ROTATE`]) at `time` (seconds), degrees.
#[must_use]
pub fn turning_yaw(time: f64) -> f32 {
    (100.0 * time).rem_euclid(360.0) as f32
}

/// First palette indices of a player's shirt and trousers, sixteen each.
const SHIRT: u8 = 16;
const TROUSERS: u8 = 96;

/// The indices of a skin in a player's colours: the rows of shirt and trousers become rows `shirt` and
/// `trousers` (0 to 15) of the palette, the other way round for the rows that run from light to dark.
#[must_use]
pub fn recoloured(pixels: &[u8], shirt: u8, trousers: u8) -> Vec<u8> {
    let row = |colour: u8, step: u8| {
        let colour = colour & 15;
        colour * 16 + if colour < 8 { step } else { 15 - step }
    };
    let table: [u8; 256] = std::array::from_fn(|i| {
        let i = i as u8;
        match i {
            SHIRT..32 => row(shirt, i - SHIRT),
            TROUSERS..112 => row(trousers, i - TROUSERS),
            _ => i,
        }
    });
    pixels.iter().map(|&i| table[usize::from(i)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placement_turns_as_engines_do() {
        let near = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-5, "{a} {b}");
        let turned = |angles, p| placement(Vec3::ZERO, angles, 1.0).transform_point3(p);
        near(turned([0.0, 90.0, 0.0], Vec3::X), Vec3::Y);
        near(turned([90.0, 0.0, 0.0], Vec3::X), Vec3::Z);
        near(turned([0.0, 0.0, 90.0], Vec3::Y), Vec3::Z);
        let placed = placement(Vec3::ONE, [0.0; 3], 2.0).transform_point3(Vec3::X);
        near(placed, Vec3::new(3.0, 1.0, 1.0));
        assert_eq!(turning_yaw(1.0), 100.0);
        assert_eq!(turning_yaw(-1.0), 260.0);
    }

    #[test]
    fn players_wear_their_colours() {
        let pixels = [0, 15, 16, 31, 32, 96, 111, 112, 255];
        assert_eq!(
            recoloured(&pixels, 4, 13),
            [0, 15, 64, 79, 32, 223, 208, 112, 255]
        );
        assert_eq!(recoloured(&pixels, 1, 6), pixels);
    }

    #[test]
    fn phases_differ_and_lie_in_a_second() {
        let phases: Vec<f64> = (0..1000).map(phase).collect();
        assert!(phases.iter().all(|p| (0.0..1.0).contains(p)));
        let mean = phases.iter().sum::<f64>() / 1000.0;
        // Four standard errors of the mean of uniform numbers.
        assert!(
            (mean - 0.5).abs() < 4.0 * (1.0_f64 / 12_000.0).sqrt(),
            "{mean}"
        );
    }

    #[test]
    fn texture_coordinates_have_an_area() {
        let area = |[a, b, c]: [[f32; 2]; 3]| {
            let (a, b, c) = (Vec2::from(a), Vec2::from(b), Vec2::from(c));
            (b - a).perp_dot(c - a).abs()
        };
        let whole = [[0.5, 0.5], [9.5, 0.5], [0.5, 4.5]];
        assert_eq!(spread(whole), whole);
        let far = 3e9;
        for flat in [
            [[3.5, 3.5]; 3],
            [[3.5, 3.5], [3.5, 3.5], [9.5, 5.5]],
            [[3.5, 3.5], [9.5, 5.5], [3.5, 3.5]],
            [[3.5, 3.5], [6.5, 4.5], [9.5, 5.5]],
            [[far, far], [far, far], [-far, far]],
        ] {
            let wide = spread(flat);
            assert!(area(wide) > 1e-4, "{flat:?}");
            for (to, from) in wide.iter().flatten().zip(flat.iter().flatten()) {
                assert!((to - from.clamp(-16_384.0, 16_384.0)).abs() < 0.1);
            }
        }
    }

    #[test]
    fn names_lose_folder_and_ending() {
        assert_eq!(stem("progs/flame.mdl"), "flame");
        assert_eq!(stem("x"), "x");
        assert!(is_luminous("progs/bolt2.mdl") && !is_luminous("progs/soldier.mdl"));
    }
}
