//! A model and sprites of each kind that have every part of their formats, by a writer that shares no
//! code with the readers.

use bsp::mdl::flags;
use mapc::{
    Model, ModelFrame, ModelPose, ModelSkin, ModelSkinVertex, Sprite, SpriteFrame, SpritePicture,
};

fn pose(name: &str, z: f64) -> ModelPose {
    ModelPose {
        name: name.to_owned(),
        positions: vec![
            [-10.0, 0.0, 0.0],
            [10.0, 0.0, 0.0],
            [0.0, 8.0, z],
            [0.0, -8.0, z],
        ],
    }
}

/// Two triangles that share an edge on the seam; a skin and a skin group, a frame and a frame group.
pub fn model() -> Model {
    let at = |on_seam, s, t| ModelSkinVertex {
        on_seam,
        at: [s, t],
    };
    Model {
        skin_size: [100, 3],
        skins: vec![
            ModelSkin::Single(vec![7; 300]),
            ModelSkin::Group(vec![(0.25, vec![1; 300]), (1.0, vec![2; 300])]),
        ],
        skin_vertices: vec![
            at(true, 10, 0),
            at(true, 40, 1),
            at(false, 20, 2),
            at(false, 70, 2),
        ],
        triangles: vec![(true, [0, 2, 1]), (false, [0, 1, 3])],
        frames: vec![
            ModelFrame::Single(pose("still", 4.0)),
            ModelFrame::Group(vec![(0.1, pose("up1", 0.0)), (0.4, pose("up2", 20.0))]),
        ],
        flags: flags::ROTATE,
        random_start: true,
    }
}

fn picture(size: [u32; 2], fill: u8) -> SpritePicture {
    SpritePicture {
        origin: [-28, 28],
        size,
        pixels: vec![fill; (size[0] * size[1]) as usize],
    }
}

/// A sprite of a kind, with a frame of each sort.
pub fn sprite(kind: u32) -> Sprite {
    Sprite {
        kind,
        frames: vec![
            SpriteFrame::Single(picture([56, 56], 9)),
            SpriteFrame::Group(vec![(0.2, picture([3, 2], 255)), (0.3, picture([2, 5], 4))]),
            SpriteFrame::Angled(Box::new(std::array::from_fn(|i| picture([1, 1], i as u8)))),
        ],
        random_start: false,
    }
}
