//! Writes sprites (`.spr`, version 1).

use crate::model::{floats, ints};

/// A sprite to be written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sprite {
    /// How it turns: 0 parallel to the view and upright, 1 facing the eye and upright, 2 parallel to the
    /// view, 3 as the entity lies, 4 parallel and rolled.
    pub kind: u32,
    /// Frames, at least one.
    pub frames: Vec<SpriteFrame>,
    /// Whether its groups begin at a random time.
    pub random_start: bool,
}

/// A frame of a sprite.
#[derive(Debug, Clone, PartialEq)]
pub enum SpriteFrame {
    /// One picture.
    Single(SpritePicture),
    /// Pictures that follow each other, each with the second it is shown until.
    Group(Vec<(f32, SpritePicture)>),
    /// Eight pictures by the direction it is seen from.
    Angled(Box<[SpritePicture; 8]>),
}

/// A picture of a sprite, a unit for each texel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpritePicture {
    /// Left and upper edge, to the right and up from the sprite's origin.
    pub origin: [i32; 2],
    /// Width and height.
    pub size: [u32; 2],
    /// Palette indices, rows from the top; 255 is a hole.
    pub pixels: Vec<u8>,
}

impl SpriteFrame {
    fn pictures(&self) -> Vec<&SpritePicture> {
        match self {
            Self::Single(picture) => vec![picture],
            Self::Group(pictures) => pictures.iter().map(|(_, p)| p).collect(),
            Self::Angled(pictures) => pictures.iter().collect(),
        }
    }
}

impl Sprite {
    /// The bytes of the file.
    #[must_use]
    pub fn write(&self) -> Vec<u8> {
        let all = || self.frames.iter().flat_map(SpriteFrame::pictures);
        let side = |axis: usize| all().map(|p| p.size[axis]).max().unwrap_or(0).cast_signed();
        let (width, height) = (side(0), side(1));
        let mut out = Vec::new();
        out.extend(b"IDSP");
        ints(&mut out, &[1, self.kind.cast_signed()]);
        floats(&mut out, &[f64::from(width).hypot(f64::from(height)) / 2.0]);
        ints(&mut out, &[width, height, self.frames.len() as i32]);
        floats(&mut out, &[0.0]);
        ints(&mut out, &[i32::from(self.random_start)]);
        for frame in &self.frames {
            match frame {
                SpriteFrame::Single(_) => ints(&mut out, &[0]),
                SpriteFrame::Group(pictures) => {
                    ints(&mut out, &[1, pictures.len() as i32]);
                    pictures
                        .iter()
                        .for_each(|(end, _)| floats(&mut out, &[f64::from(*end)]));
                }
                SpriteFrame::Angled(_) => {
                    ints(&mut out, &[2, 8]);
                    (1..=8).for_each(|i| floats(&mut out, &[f64::from(i) * 0.1]));
                }
            }
            for picture in frame.pictures() {
                let [width, height] = picture.size.map(u32::cast_signed);
                ints(
                    &mut out,
                    &[picture.origin[0], picture.origin[1], width, height],
                );
                out.extend(&picture.pixels);
            }
        }
        out
    }
}
