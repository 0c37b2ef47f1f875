//! Triangle meshes in Stanford's PLY, binary little-endian.

use anyhow::{Result, bail};
use std::collections::HashMap;
use std::io::Write;

/// A mesh that grows triangle by triangle. Corners that agree in place and texture coordinates to
/// the last bit are one vertex, so that the mesh stays watertight.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Bits of place and texture coordinates to the vertex's number.
    known: HashMap<[u32; 5], u32>,
    vertices: Vec<[f32; 5]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a triangle of `x, y, z, u, v` corners. One that rounding has left without area is left
    /// out.
    pub fn push(&mut self, corners: [[f32; 5]; 3]) {
        let [a, b, c] = corners.map(|v| glam::Vec3::new(v[0], v[1], v[2]));
        if (b - a)
            .as_dvec3()
            .cross((c - a).as_dvec3())
            .length_squared()
            == 0.0
        {
            return;
        }
        let triangle = corners.map(|v| {
            // So that both zeros are one place.
            let v = v.map(|x| x + 0.0);
            *self.known.entry(v.map(f32::to_bits)).or_insert_with(|| {
                self.vertices.push(v);
                (self.vertices.len() - 1) as u32
            })
        });
        self.triangles.push(triangle);
    }

    /// Triangles so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Writes the mesh; every vertex gets `normal`, if one is given.
    ///
    /// # Errors
    /// When the file cannot be written, or has more vertices than its format can number.
    pub fn write(&self, out: &mut impl Write, normal: Option<[f32; 3]>) -> Result<()> {
        if u32::try_from(self.vertices.len()).is_err() {
            bail!("a mesh with more than 2^32 vertices");
        }
        let property = |names: &[&str]| -> String {
            (names.iter())
                .map(|n| format!("property float {n}\n"))
                .collect()
        };
        let normals = if normal.is_some() {
            property(&["nx", "ny", "nz"])
        } else {
            String::new()
        };
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{}{normals}{}\
             element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
            self.vertices.len(),
            property(&["x", "y", "z"]),
            property(&["u", "v"]),
            self.triangles.len(),
        )?;
        for v in &self.vertices {
            let place = &v[..3];
            let normal = normal.as_ref().map_or(&[][..], |n| &n[..]);
            for x in place.iter().chain(normal).chain(&v[3..]) {
                out.write_all(&x.to_le_bytes())?;
            }
        }
        for t in &self.triangles {
            out.write_all(&[3])?;
            for i in t {
                out.write_all(&i.to_le_bytes())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_that_agree_are_one_vertex() {
        let mut mesh = Mesh::default();
        let at = |x: f32, y: f32| [x, y, -0.0, 0.5, 0.0];
        mesh.push([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)]);
        mesh.push([at(1.0, 0.0), at(1.0, 1.0), at(-0.0, 1.0)]);
        mesh.push([at(1.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)]);
        assert_eq!((mesh.vertices.len(), mesh.len()), (4, 2));
        let mut bytes = Vec::new();
        mesh.write(&mut bytes, Some([0.0, 0.0, 1.0])).unwrap();
        let end = bytes
            .windows(11)
            .position(|w| w == b"end_header\n")
            .unwrap()
            + 11;
        assert_eq!(bytes.len() - end, 4 * 8 * 4 + 2 * 13);
    }
}
