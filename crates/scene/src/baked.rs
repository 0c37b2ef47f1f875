//! The light that a level's own compiler stored, as grids of samples on its faces.

/// Baked light at one moment: the samples of all light styles added up with their brightness.
///
/// Renderers multiply the emission of a surface with it, except where the emission texel has alpha
/// 0 (fullbright texels): the import makes every surface emit its texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedLight {
    /// For each of `Scene::meshes` the grids of its triangles, in their order.
    pub meshes: Vec<Vec<BakedTriangle>>,
    /// Light, where 1 shows a texture as it is stored.
    pub samples: Vec<[f32; 3]>,
}

/// Where a triangle's samples are, and how they lie on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakedTriangle {
    /// Index of the first sample; that of luxel (x, y) is `first + y * width + x`.
    pub first: u32,
    /// Luxels across, > 0.
    pub width: u32,
    /// Luxels down, > 0.
    pub height: u32,
    /// Luxel coordinates of the corners. Whole numbers are samples, between them light is bilinear,
    /// beyond the outer ones it stays.
    pub uv: [[f32; 2]; 3],
}
