//! Palettes, colormaps, and pictures of every kind.
#![no_main]

use bsp::lmp::{Colormap, Palette, Picture};
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = Palette::parse(data);
    let _ = Colormap::parse(data);
    // What is no other kind is read as a TGA.
    if let Ok(picture) = bsp::picture::decode("a.tga", data, &Limits::default()) {
        assert_eq!(
            picture.texels.len() as u64,
            u64::from(picture.width) * u64::from(picture.height)
        );
    }
    if let Ok(picture) = Picture::parse(data, &Limits::default(), &mut Warnings::new()) {
        assert_eq!(
            picture.pixels.len() as u64,
            u64::from(picture.width) * u64::from(picture.height)
        );
    }
});
