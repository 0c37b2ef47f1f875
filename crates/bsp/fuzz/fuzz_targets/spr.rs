//! Sprites.
#![no_main]

use bsp::spr::{ANGLES, Spr, Times};
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut warnings = Warnings::new();
    let sprite = match Spr::parse(data, &Limits::default(), &mut warnings) {
        Ok(sprite) => sprite,
        Err(error) => {
            assert!(error.to_string().contains("SPR"));
            return;
        }
    };
    for frame in &sprite.frames {
        let pictures = frame.pictures.len();
        match &frame.times {
            Times::Single => assert_eq!(pictures, 1),
            Times::Group(cycle) => {
                assert_eq!(cycle.parts(), pictures);
                assert!(cycle.at(3.3).0 < pictures);
            }
            Times::Angled => assert_eq!(pictures, ANGLES),
        }
        for p in &frame.pictures {
            assert_eq!(p.pixels.len(), p.width as usize * p.height as usize);
        }
    }
});
