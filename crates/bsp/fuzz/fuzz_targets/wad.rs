//! WADs and all that is in them.
#![no_main]

use bsp::wad::Wad;
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let limits = Limits::default();
    let mut warnings = Warnings::new();
    if let Ok(wad) = Wad::parse(data, &limits, &mut warnings) {
        for entry in &wad.entries {
            let _ = wad.read_texture(data, entry, &limits);
            let _ = wad.read_picture(data, entry, &limits, &mut warnings);
        }
    }
});
