//! Entity text and every getter.
#![no_main]

use bsp::styles::LightStyles;
use bsp::{Limits, Warnings, entity};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(entities) = entity::parse(data, &Limits::default(), &mut Warnings::new()) else {
        return;
    };
    LightStyles::at_start(&entities);
    for entity in &entities {
        for (key, value) in entity.iter() {
            assert!(entity::atof(value).abs() >= 0.0);
            entity.vec3(key);
            entity.floats(key, 9);
        }
        entity.angles_deg();
        entity.move_direction();
        entity.spawnflags();
        entity.brush_model();
    }
});
