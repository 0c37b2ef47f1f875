//! Alias models, with all that a renderer asks of them.
#![no_main]

use bsp::mdl::Mdl;
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut warnings = Warnings::new();
    let model = match Mdl::parse(data, &Limits::default(), &mut warnings) {
        Ok(model) => model,
        Err(error) => {
            assert!(error.to_string().contains("MDL"));
            return;
        }
    };
    let vertices = model.skin_vertices.len();
    for t in &model.triangles {
        assert!(t.vertices.iter().all(|&v| (v as usize) < vertices));
        for v in t.vertices {
            assert!(model.skin_coordinates(t, v).iter().all(|c| c.is_finite()));
        }
    }
    let size = model.header.skin_width as usize * model.header.skin_height as usize;
    for skin in &model.skins {
        assert!(!skin.pictures.is_empty());
        assert!(skin.pictures.iter().all(|p| p.len() == size));
        if let Some(cycle) = &skin.cycle {
            assert!(cycle.at(1.7).0 < skin.pictures.len());
        }
    }
    for frame in &model.frames {
        assert!(!frame.poses.is_empty());
        if let Some(cycle) = &frame.cycle {
            assert!(cycle.at(-1.7).0 < frame.poses.len());
        }
        for pose in &frame.poses {
            assert_eq!(pose.vertices.len(), vertices);
            for &v in &pose.vertices {
                assert!(model.position(v).iter().all(|c| c.is_finite()));
            }
        }
    }
});
