//! All luxels of a level in one picture: each face's grid beside the next, in shelves.

use super::compare::{Comparison, FaceLuxels, Luxel};

/// Pixels across.
const WIDTH: u32 = 1024;
/// Most pixels of a picture.
const MAX_PIXELS: u64 = 1 << 28;

/// Where the faces are in the picture.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Left upper corner of each face's grid, in the order of the comparison.
    places: Vec<[u32; 2]>,
}

/// A layer: a value for each pixel, rows from the top.
pub type Layer = Vec<[f32; 3]>;

impl Atlas {
    /// Places all faces; `None` if there are none or they do not fit into a picture.
    #[must_use]
    pub fn new(comparison: &Comparison) -> Option<Self> {
        let faces = &comparison.faces;
        let width = faces.iter().map(|f| f.width).max()?.max(WIDTH);
        let mut order: Vec<usize> = (0..faces.len()).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(faces[i].height));
        let (mut x, mut y, mut shelf) = (0, 0_u32, 0);
        let mut places = vec![[0; 2]; faces.len()];
        for i in order {
            let FaceLuxels {
                width: w,
                height: h,
                ..
            } = faces[i];
            if x + w > width {
                (x, y) = (0, y.checked_add(shelf + 1)?);
                shelf = 0;
            }
            places[i] = [x, y];
            shelf = shelf.max(h);
            x += w + 1;
        }
        let height = y.checked_add(shelf)?;
        (u64::from(width) * u64::from(height) <= MAX_PIXELS).then_some(Self {
            width,
            height,
            places,
        })
    }

    /// A layer of values of luxels; what is no luxel is `empty`.
    pub fn layer(
        &self,
        comparison: &Comparison,
        empty: [f32; 3],
        value: impl Fn(&Luxel) -> [f32; 3],
    ) -> Layer {
        let mut out = vec![empty; self.width as usize * self.height as usize];
        for (face, [x0, y0]) in comparison.faces.iter().zip(&self.places) {
            for (luxel, i) in face.luxels.iter().zip(0..) {
                let (x, y) = (x0 + i % face.width, y0 + i / face.width);
                out[y as usize * self.width as usize + x as usize] = value(luxel);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_luxel_has_its_own_pixel() {
        let face = |width, height| FaceLuxels {
            face: 0,
            width,
            height,
            luxels: vec![Luxel::Outside; (width * height) as usize],
        };
        let faces: Vec<FaceLuxels> = (1..60).map(|i| face(40 + i, 1 + i % 7)).collect();
        let luxels: usize = faces.iter().map(|f| f.luxels.len()).sum();
        let comparison = Comparison {
            faces,
            unlit_faces: 0,
        };
        let atlas = Atlas::new(&comparison).unwrap();
        let layer = atlas.layer(&comparison, [0.0; 3], |_| [1.0; 3]);
        let set = layer.iter().filter(|p| p[0] == 1.0).count();
        assert_eq!(set, luxels);
        assert!(Atlas::new(&Comparison::default()).is_none());
    }
}
