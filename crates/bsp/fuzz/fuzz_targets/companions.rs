//! `.lit` and `.vis` files against a level: the first half of the input is the level.
#![no_main]

use bsp::bsp::LightSamples;
use bsp::{Bsp, Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let (level, companion) = data.split_at(data.len() / 2);
    let mut warnings = Warnings::new();
    let Ok(mut level) = Bsp::parse(level, &Limits::default(), &mut warnings) else {
        return;
    };
    if let Ok(samples) = LightSamples::from_lit(companion, level.lighting.len()) {
        samples.value(&level, 0);
    }
    level.apply_vis(companion, "level.bsp", &mut warnings);
    for leaf in 0..level.leafs.len().min(64) {
        level.pvs(leaf).sees(2);
    }
});
