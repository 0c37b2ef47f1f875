//! Miptex pixels into pictures: colours, holes, fullbright masks, sky layers.

use crate::material::{Texture, luminance, srgb_to_linear};
use bsp::lmp::{FIRST_FULLBRIGHT, Palette};
use bsp::miptex::MipTex;
use glam::{DVec3, Vec3};

/// Texels of one square of the picture that stands in for a missing texture.
const CHECKER: u32 = 16;
/// Its two colours: easy to tell from any level's own, and of ordinary albedo.
const CHECKER_COLORS: [[u8; 4]; 2] = [[170, 85, 170, 255], [85, 85, 85, 255]];

/// Side of a sky layer in texels.
pub const SKY_SIDE: u32 = 128;

/// Relative luminance of an sRGB-encoded colour, 0 to 1.
pub fn luminance_of(rgb: [u8; 3]) -> f32 {
    luminance(rgb.map(|c| srgb_to_linear(c) as f32))
}

/// Mean relative luminance of a picture's texels; those with alpha 0 count as black.
pub fn mean_luminance(texture: &Texture) -> f32 {
    luminance(mean(texture).to_array())
}

/// Mean colour of a picture's texels, linear RGB; those with alpha 0 count as black.
pub fn mean(texture: &Texture) -> Vec3 {
    // Few different colours come often: decode each of the 256 values once.
    let table: Vec<f64> = (0..=255).map(srgb_to_linear).collect();
    let sum: DVec3 = (texture.rgba.iter())
        .filter(|t| t[3] != 0)
        .map(|t| DVec3::from([t[0], t[1], t[2]].map(|c| table[usize::from(c)])))
        .sum();
    (sum / texture.rgba.len().max(1) as f64).as_vec3()
}

/// A miptex with all its pixels and the colours they stand for.
pub struct Indexed<'a> {
    /// The texture.
    pub miptex: &'a MipTex,
    /// Its colours: its own, or the game's.
    palette: &'a Palette,
    /// Whether index 255 is a hole.
    fence: bool,
}

impl<'a> Indexed<'a> {
    /// `miptex` with its own palette if it has one, else with `palette`. Its pixels are there.
    pub fn new(miptex: &'a MipTex, palette: &'a Palette, fence: bool) -> Self {
        Self {
            miptex,
            palette: miptex.palette.as_deref().unwrap_or(palette),
            fence,
        }
    }

    fn is_hole(&self, index: u8) -> bool {
        self.fence && index == 255
    }

    fn picture(&self, name: String, texel: impl Fn(u8) -> [u8; 4]) -> Texture {
        let table: Vec<[u8; 4]> = (0..=255).map(texel).collect();
        Texture {
            name,
            width: self.miptex.width,
            height: self.miptex.height,
            rgba: (self.miptex.pixels.iter())
                .map(|&i| table[usize::from(i)])
                .collect(),
        }
    }

    /// The base colour. Holes get alpha 0 and the colour of a near texel that is there.
    pub fn base(&self) -> Texture {
        let mut texture = self.picture(self.miptex.name.clone(), |i| {
            let [r, g, b] = self.palette.rgb(i);
            [r, g, b, if self.is_hole(i) { 0 } else { 255 }]
        });
        if self.fence {
            dilate(&mut texture);
        }
        texture
    }

    /// The base colour, black where `is_black` says so of an index. Holes stay.
    pub fn base_without(&self, is_black: impl Fn(u8) -> bool) -> Texture {
        let name = format!("{} without what shines", self.miptex.name);
        self.picture(name, |i| {
            let [r, g, b] = self.palette.rgb(i);
            match (self.is_hole(i), is_black(i)) {
                (true, _) => [0; 4],
                (_, true) => [0, 0, 0, 255],
                _ => [r, g, b, 255],
            }
        })
    }

    /// The base colour with alpha 0 where light changes nothing.
    pub fn base_without_fullbright_alpha(&self) -> Texture {
        self.picture(format!("{} as shown", self.miptex.name), |i| {
            let [r, g, b] = self.palette.rgb(i);
            [r, g, b, if self.emits(i, 0.0) { 0 } else { 255 }]
        })
    }

    /// Which indices emit: those that ignore lighting and are at least as bright as `threshold`.
    pub fn emits(&self, index: u8, threshold: f32) -> bool {
        let name = self.miptex.name.as_bytes();
        let fullbright = match (self.miptex.palette.is_some(), name) {
            // Textures with colours of their own say it in their name.
            (true, [b'~', ..] | [b'+', _, b'~', ..]) => true,
            (true, _) => false,
            (false, _) => index >= FIRST_FULLBRIGHT,
        };
        fullbright && !self.is_hole(index) && luminance_of(self.palette.rgb(index)) >= threshold
    }

    /// The emitted colour, black where nothing emits, and how many texels do; `None` if none does.
    pub fn emission(&self, threshold: f32) -> Option<(Texture, usize)> {
        let emits: Vec<bool> = (0..=255).map(|i| self.emits(i, threshold)).collect();
        let count = (self.miptex.pixels.iter())
            .filter(|&&i| emits[usize::from(i)])
            .count();
        let texture = || {
            self.picture(format!("{} emission", self.miptex.name), |i| {
                let [r, g, b] = self.palette.rgb(i);
                if emits[usize::from(i)] {
                    [r, g, b, 255]
                } else {
                    [0, 0, 0, 255]
                }
            })
        };
        (count > 0).then(|| (texture(), count))
    }

    /// The two layers of a sky: the opaque back from the right half, the front from the left half
    /// with holes at index 0. Layers of another size are resampled to [`SKY_SIDE`].
    pub fn sky_layers(&self) -> [Texture; 2] {
        let (w, h) = (self.miptex.width, self.miptex.height);
        let half = (w / 2).max(1);
        let layer = |name: &str, offset: u32, hole: bool| Texture {
            name: format!("{} {name}", self.miptex.name),
            width: SKY_SIDE,
            height: SKY_SIDE,
            rgba: (0..SKY_SIDE * SKY_SIDE)
                .map(|i| {
                    let x = offset + i % SKY_SIDE * half / SKY_SIDE;
                    let y = i / SKY_SIDE * h / SKY_SIDE;
                    let at = y as usize * w as usize + x.min(w - 1) as usize;
                    let index = self.miptex.pixels.get(at).copied().unwrap_or(0);
                    let [r, g, b] = self.palette.rgb(index);
                    [r, g, b, if hole && index == 0 { 0 } else { 255 }]
                })
                .collect(),
        };
        [layer("back", w / 2, false), layer("front", 0, true)]
    }
}

/// Mean colour of a sky, linear RGB: both layers scroll, so what is in front of what changes, but
/// not how much of the front is there.
pub fn sky_mean(back: &Texture, front: &Texture) -> Vec3 {
    let holes = front.rgba.iter().filter(|t| t[3] == 0).count() as f32;
    let open = holes / front.rgba.len().max(1) as f32;
    mean(front) + open * mean(back)
}

/// The stand-in for a texture without pixels. It repeats, so it need not have the texture's size.
pub fn checkerboard(name: &str) -> Texture {
    let side = 2 * CHECKER;
    Texture {
        name: format!("{name} (missing)"),
        width: side,
        height: side,
        rgba: (0..side * side)
            .map(|i| (i % side / CHECKER + i / side / CHECKER) % 2)
            .map(|square| CHECKER_COLORS[square as usize])
            .collect(),
    }
}

/// Gives holes the colour of a near texel that is there, so that a filter that blends neighbours
/// finds no foreign colour. Breadth first from the rims, wrapping.
pub fn dilate(texture: &mut Texture) {
    let (w, h) = (texture.width as usize, texture.height as usize);
    let mut queue: std::collections::VecDeque<usize> = (0..texture.rgba.len())
        .filter(|&i| texture.rgba[i][3] != 0)
        .collect();
    let mut done: Vec<bool> = texture.rgba.iter().map(|t| t[3] != 0).collect();
    while let Some(i) = queue.pop_front() {
        let (x, y) = (i % w, i / w);
        let [r, g, b, _] = texture.rgba[i];
        let neighbours = [
            (x + 1) % w + y * w,
            (x + w - 1) % w + y * w,
            x + (y + 1) % h * w,
            x + (y + h - 1) % h * w,
        ];
        for n in neighbours {
            if !std::mem::replace(&mut done[n], true) {
                texture.rgba[n] = [r, g, b, 0];
                queue.push_back(n);
            }
        }
    }
}
