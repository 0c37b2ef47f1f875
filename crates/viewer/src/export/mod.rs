//! A scene written for other renderers: Mitsuba 3, and glTF for editors.
//!
//! [`mitsuba`] is exact where Mitsuba can be, and says in its manifest where it is not; [`gltf`] is
//! for looking and editing. `docs/export.md` says which form each thing has, and why.

mod folder;
pub mod gltf;
mod images;
mod manifest;
pub mod mitsuba;
mod polygon;

pub use folder::{Folder, MANIFEST};
pub use manifest::{Exported, Reason};

use glam::{DVec2, DVec3};
use scene::render::Settings;
use scene::{MaterialId, Scene};

/// What is exported: the scene, seen through the settings of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Camera, size, depth, time and seed. The estimator does not matter.
    pub settings: &'a Settings,
    /// Samples per pixel that a renderer of the export takes.
    pub spp: u32,
}

/// A triangle as it lies in the world.
#[derive(Clone, Copy, Debug)]
pub struct PlacedTriangle {
    /// Corners relative to an origin, counter-clockwise from the front, world units.
    pub p: [DVec3; 3],
    /// Unit normal to the front.
    pub normal: DVec3,
    /// Texture coordinates as in [`scene::Triangle::uv`].
    pub uv: [DVec2; 3],
    /// What it looks like.
    pub material: MaterialId,
}

/// All triangles as rays that carry light can meet them, relative to `origin`, in order of instances and
/// triangles. Triangles without area are left out, for no ray meets them, and so is what the camera alone
/// sees.
pub fn placed_triangles(
    scene: &Scene,
    origin: DVec3,
) -> impl Iterator<Item = PlacedTriangle> + use<'_> {
    let met = scene.instances.iter().filter(|i| i.seen_by.others());
    met.flat_map(move |instance| {
        let mesh = &scene.meshes[instance.mesh];
        let positions = mesh.posed(instance.pose);
        let is_posed = !mesh.poses.is_empty();
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        mesh.triangles.iter().filter_map(move |t| {
            // As the renderers place it: in f32. What is taken off afterwards is taken off in f64.
            let mut p = t.vertices.map(|v| {
                let local = positions[v as usize];
                instance.transform.transform_point3(local).as_dvec3() - origin
            });
            let mut uv = t.uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)));
            if mirrored {
                p.swap(1, 2);
                uv.swap(1, 2);
            }
            let cross = (p[1] - p[0]).cross(p[2] - p[0]);
            let plane = instance.transform.transform_vector3(t.normal).as_dvec3();
            let plane = plane.try_normalize().filter(|_| !is_posed);
            let normal = plane.or(cross.try_normalize())?;
            (cross.length_squared() > 0.0).then_some(PlacedTriangle {
                p,
                normal,
                uv,
                material: instance.material_of(t),
            })
        })
    })
}

/// A name that is safe in a file's: letters, digits and dashes, at most 24 of them.
fn safe_name(name: &str) -> String {
    let safe: String = (name.chars().take(24))
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    let trimmed = safe.trim_matches('-');
    if trimmed.is_empty() {
        "texture".into()
    } else {
        trimmed.to_ascii_lowercase()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_textures_become_names_of_files() {
        assert_eq!(safe_name("*lava1"), "lava1");
        assert_eq!(safe_name("{FENCE/../x"), "fence----x");
        assert_eq!(safe_name("+0"), "0");
        assert_eq!(safe_name("***"), "texture");
    }
}
