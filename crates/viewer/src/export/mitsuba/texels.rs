//! Which texels of an emitting texture emit what, as few rectangles.

use glam::DVec2;
use scene::Texture;

/// What all texels of a rectangle have in common: emitted and reflected colour as sRGB bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Glow {
    /// Emitted colour, not black.
    pub emission: [u8; 3],
    /// Base colour.
    pub base: [u8; 3],
}

/// A rectangle of texels that glow alike, or not at all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// First column and row.
    pub lo: [u32; 2],
    /// One past the last column and row.
    pub hi: [u32; 2],
    /// `None` for texels that do not emit, whatever their base colour.
    pub glow: Option<Glow>,
}

impl Patch {
    /// The rectangle in the tile `tile` of the wrapped texture of `size` texels.
    #[must_use]
    pub fn in_tile(&self, tile: [f64; 2], size: [u32; 2]) -> [DVec2; 2] {
        [self.lo, self.hi].map(|at| {
            DVec2::from(std::array::from_fn(|i| {
                tile[i] * f64::from(size[i]) + f64::from(at[i])
            }))
        })
    }
}

/// Cuts a texture into rectangles of equal texels: rows first, then equal rows together. Every
/// texel lies in exactly one.
#[must_use]
pub fn patches(base: &Texture, emission: &Texture) -> Vec<Patch> {
    let (w, h) = (base.width, base.height);
    let glow = |x: u32, y: u32| {
        let at = (y * w + x) as usize;
        let [r, g, b, _] = emission.rgba.get(at).copied().unwrap_or_default();
        let [br, bg, bb, _] = base.rgba.get(at).copied().unwrap_or_default();
        ([r, g, b] != [0; 3]).then_some(Glow {
            emission: [r, g, b],
            base: [br, bg, bb],
        })
    };
    let mut done: Vec<Patch> = Vec::new();
    // Rectangles that the row above ended with; they grow while the rows below are the same.
    let mut open: Vec<Patch> = Vec::new();
    for y in 0..h {
        let mut row: Vec<Patch> = Vec::new();
        for x in 0..w {
            let glow = glow(x, y);
            match row.last_mut() {
                Some(last) if last.glow == glow => last.hi[0] = x + 1,
                _ => row.push(Patch {
                    lo: [x, y],
                    hi: [x + 1, y + 1],
                    glow,
                }),
            }
        }
        let mut next = Vec::with_capacity(row.len());
        for mut patch in row {
            let above = open
                .iter()
                .position(|o| (o.lo[0], o.hi[0], o.glow) == (patch.lo[0], patch.hi[0], patch.glow));
            if let Some(i) = above {
                patch.lo = open.swap_remove(i).lo;
            }
            next.push(patch);
        }
        done.append(&mut open);
        open = next;
    }
    done.append(&mut open);
    done.sort_by_key(|p| (p.lo[1], p.lo[0]));
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, rows: &[&str]) -> Texture {
        Texture {
            name: String::new(),
            width,
            height: rows.len() as u32,
            rgba: (rows.iter().flat_map(|r| r.bytes()))
                .map(|b| {
                    if b == b'.' {
                        [0, 0, 0, 255]
                    } else {
                        [b, 1, 1, 255]
                    }
                })
                .collect(),
        }
    }

    #[test]
    fn rectangles_cover_every_texel_once() {
        let emission = texture(6, &["..aa..", "..aa..", "baaaa.", "b....."]);
        let base = texture(6, &["cccccc"; 4]);
        let patches = patches(&base, &emission);
        let mut covered = [[0; 6]; 4];
        for p in &patches {
            for y in p.lo[1]..p.hi[1] {
                for x in p.lo[0]..p.hi[0] {
                    covered[y as usize][x as usize] += 1;
                    let texel = emission.rgba[(y * 6 + x) as usize];
                    let expected = (texel[0] != 0).then_some([texel[0], 1, 1]);
                    assert_eq!(p.glow.map(|g| g.emission), expected);
                }
            }
        }
        assert_eq!(covered, [[1; 6]; 4]);
        // The upper a, its wings, b and five dark parts, of which the left upper is one.
        assert_eq!(patches.iter().filter(|p| p.glow.is_some()).count(), 3);
        assert_eq!(patches.len(), 7);
        let [lo, hi] = patches[0].in_tile([-1.0, 2.0], [6, 4]);
        assert_eq!((lo, hi), (DVec2::new(-6.0, 8.0), DVec2::new(-4.0, 10.0)));
    }
}
