//! Palette-indexed textures and their mip levels.

use crate::CompileError;

/// A palette-indexed texture. Its name decides what it is, as in Quake: `sky...`, `*water`,
/// `{fence`, `+0animated`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    /// At most 15 bytes.
    pub name: String,
    /// Texels across, a multiple of 16.
    pub width: usize,
    /// Texels down, a multiple of 16.
    pub height: usize,
    /// `width * height` palette indices, rows from the top.
    pub pixels: Vec<u8>,
}

impl Texture {
    /// A texture of one palette index.
    #[must_use]
    pub fn solid(name: &str, width: usize, height: usize, index: u8) -> Self {
        Self::from_fn(name, width, height, |_, _| index)
    }

    /// A texture from a function of the texel's column and row.
    #[must_use]
    pub fn from_fn(
        name: &str,
        width: usize,
        height: usize,
        mut f: impl FnMut(usize, usize) -> u8,
    ) -> Self {
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                pixels.push(f(x, y));
            }
        }
        Self {
            name: name.to_owned(),
            width,
            height,
            pixels,
        }
    }

    pub(crate) fn check(&self) -> Result<(), CompileError> {
        let bad = |what: &str| CompileError::Texture {
            name: self.name.clone(),
            problem: what.to_owned(),
        };
        if self.name.is_empty() || self.name.len() > 15 {
            return Err(bad("the name must have 1 to 15 bytes"));
        }
        let size_ok = |n: usize| (16..=4096).contains(&n) && n.is_multiple_of(16);
        if !size_ok(self.width) || !size_ok(self.height) {
            return Err(bad("width and height must be multiples of 16 up to 4096"));
        }
        if self.pixels.len() != self.width * self.height {
            return Err(bad("the number of pixels is not width times height"));
        }
        Ok(())
    }

    /// The miptex record: 40-byte header and four mip levels. Smaller levels take the top left
    /// texel of each block: averages of palette indices mean nothing without the palette, and
    /// renderers build their own mip levels from the first.
    pub(crate) fn to_miptex(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(40 + self.pixels.len() * 85 / 64);
        let mut name = [0u8; 16];
        name[..self.name.len()].copy_from_slice(self.name.as_bytes());
        out.extend_from_slice(&name);
        out.extend_from_slice(&(self.width as u32).to_le_bytes());
        out.extend_from_slice(&(self.height as u32).to_le_bytes());
        let mut at = 40;
        for level in 0..4 {
            out.extend_from_slice(&(at as u32).to_le_bytes());
            at += (self.width >> level) * (self.height >> level);
        }
        for level in 0..4 {
            let step = 1usize << level;
            for y in (0..self.height).step_by(step) {
                for x in (0..self.width).step_by(step) {
                    out.push(self.pixels[y * self.width + x]);
                }
            }
        }
        out
    }
}

/// What fills a leaf, weakest first: where brushes overlap the strongest wins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Contents {
    /// Air.
    Empty,
    /// `*` textures other than slime and lava.
    Water,
    /// `*slime...`
    Slime,
    /// `*lava...`
    Lava,
    /// `sky...`
    Sky,
    /// Everything else.
    Solid,
}

impl Contents {
    /// The contents a brush with this texture has, as qbsp decides it.
    #[must_use]
    pub fn of_texture(name: &str) -> Self {
        let name = name.to_ascii_lowercase();
        if name.starts_with("*lava") {
            Self::Lava
        } else if name.starts_with("*slime") {
            Self::Slime
        } else if name.starts_with('*') {
            Self::Water
        } else if name.starts_with("sky") {
            Self::Sky
        } else {
            Self::Solid
        }
    }

    /// The number stored in leafs and clipnodes.
    #[must_use]
    pub fn code(self) -> i32 {
        match self {
            Self::Empty => -1,
            Self::Solid => -2,
            Self::Water => -3,
            Self::Slime => -4,
            Self::Lava => -5,
            Self::Sky => -6,
        }
    }

    /// Nothing is seen from inside, and nothing passes through.
    pub(crate) fn is_opaque(self) -> bool {
        matches!(self, Self::Solid | Self::Sky)
    }
}
