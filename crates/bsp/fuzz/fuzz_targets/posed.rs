//! Models that stand for alias models. An MD5 mesh and its animation are parted by a zero byte.
#![no_main]

use bsp::Limits;
use bsp::md3::Md3;
use bsp::md5::Md5;
use bsp::posed::PosedModel;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let limits = Limits::default();
    let read = if data.starts_with(b"IDP3") {
        Md3::parse(data, &limits).map(PosedModel::Md3)
    } else {
        let mut parts = data.splitn(2, |&b| b == 0);
        let mesh = parts.next().unwrap_or_default();
        Md5::parse(mesh, parts.next(), &limits).map(PosedModel::Md5)
    };
    let model = match read {
        Ok(model) => model,
        Err(error) => {
            assert!(error.to_string().contains("MD"));
            return;
        }
    };
    assert!(!model.surfaces().is_empty() && model.frames() > 0);
    for surface in model.surfaces() {
        let vertices = surface.uv.len();
        assert!(surface.uv.iter().flatten().all(|c| c.is_finite()));
        assert!(surface.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
    }
    for frame in [0, model.frames() - 1, model.frames()] {
        let pose = model.pose(frame);
        assert_eq!(pose.len(), model.vertices());
        assert!(pose.iter().flatten().all(|c| c.is_finite()));
    }
});
