//! Levels: parsing and every query that walks file data.
#![no_main]

use bsp::miptex::Animation;
use bsp::{Bsp, Limits, Warnings, entity};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let limits = Limits::default();
    let mut warnings = Warnings::new();
    let Ok(level) = Bsp::parse(data, &limits, &mut warnings) else {
        return;
    };
    let _ = entity::parse(&level.entity_text, &limits, &mut warnings);
    let animation = Animation::new(&level.textures, &mut warnings);
    let samples = level.own_light_samples();
    for (index, face) in level.drawable_faces(0) {
        let points = level.face_points(face).expect("a good face has points");
        assert!(points.flatten().all(|c| c.is_finite()));
        assert!(level.face_plane(face).is_some());
        if let Some(texture) = level.face_texture(face) {
            animation.frame_at(texture, 1.3, true);
        }
        if let bsp::bsp::FaceLight::Lightmap(map) = level.face_light(index, &limits) {
            samples.value(&level, map.offset + map.len() - 1);
        }
    }
    for model in 0..level.models.len().min(8) {
        level.point_leaf(model, [1.0, 2.0, 3.0]);
        for hull in 0..4 {
            level.hull_contents(model, hull, [1.0, 2.0, 3.0]);
            level.trace(model, hull, [0.0; 3], [10.0, 20.0, -256.0]);
        }
    }
    for leaf in 0..level.leafs.len().min(64) {
        level.pvs(leaf).sees(1);
        if let Some(leaf) = level.leafs.get(leaf) {
            level.leaf_faces(leaf).count();
        }
    }
    level.bspx.brush_list();
    level.bspx.face_normals();
    level.bspx.vertex_normals();
});
