//! A model of each kind that stands for alias models, written by hand.

/// Two joints, the second 10 above the first; two triangles, of which the upper corners hang on the second joint. In
/// frame 0 it rests, in frame 1 the second joint turns by a quarter about x, and the first is 5 further on along x.
pub fn md5() -> (String, String) {
    let mesh = r#"MD5Version 10
commandline "made by hand"
numJoints 2
numMeshes 1
joints {
	"root"	-1 ( 0 0 0 ) ( 0 0 0 )		// the ground
	"arm"	0 ( 0 0 10 ) ( 0 0 0 )
}
mesh {
	shader "progs/box"
	numverts 4
	vert 0 ( 0 1 ) 0 1
	vert 1 ( 1 1 ) 1 1
	vert 2 ( 1 0 ) 2 1
	vert 3 ( 0 0.25 ) 3 2
	numtris 2
	tri 0 0 2 1
	tri 1 0 3 2
	numweights 5
	weight 0 0 1 ( 0 -2 0 )
	weight 1 0 1 ( 0 2 0 )
	weight 2 1 1 ( 0 2 4 )
	weight 3 0 0.25 ( 0 -2 14 )
	weight 4 1 0.75 ( 0 -2 4 )
}
"#;
    // Half of a quarter turn: sin 45 degrees. The fourth number is stored as not positive, so the turn is the other way
    // round than its sign says: x = -0.707... turns y to z.
    let anim = r#"MD5Version 10
commandline ""
numFrames 2
numJoints 2
frameRate 24
numAnimatedComponents 2
hierarchy {
	"root"	-1 1 0
	"arm"	0 8 1
}
bounds {
	( 0 0 0 ) ( 1 1 1 )
	( 0 0 0 ) ( 1 1 1 )
}
baseframe {
	( 0 0 0 ) ( 0 0 0 )
	( 0 0 10 ) ( 0 0 0 )
}
frame 0 {
	0 0
}
frame 1 {
	5 -0.70710678
}
"#;
    (mesh.to_owned(), anim.to_owned())
}

/// A surface of a triangle in two frames, the second 1/64 further up. It faces +x; its normals lean from there: in the
/// first frame to +z, and the second one's to -x, in the second frame to +y.
pub fn md3() -> Vec<u8> {
    let ints =
        |values: &[i32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let name = |text: &str| {
        let mut field = [0; 64];
        field[..text.len()].copy_from_slice(text.as_bytes());
        field
    };
    let frame_bytes = 2 * 56;
    let mut file = b"IDP3".to_vec();
    file.extend(ints(&[15]));
    file.extend(name("made by hand"));
    file.extend(ints(&[8, 2, 0, 1, 0, 108, 108, 108 + frame_bytes, 0]));
    file.extend(vec![0; frame_bytes as usize]);
    let mut surface = b"IDP3".to_vec();
    surface.extend(name("progs/box.tga"));
    let [triangles, uv, vertices, end] = [108, 120, 144, 192];
    surface.extend(ints(&[0, 2, 0, 3, 1, triangles, 0, uv, vertices, end]));
    surface.extend(ints(&[0, 2, 1]));
    for c in [0.0_f32, 1.0, 1.0, 1.0, 1.0, 0.0] {
        surface.extend(c.to_le_bytes());
    }
    for (lift, angles) in [(0_i16, [[32, 0], [64, 128], [63, 0]]), (1, [[64, 32]; 3])] {
        for ([x, y, z], angles) in [[0, -128, 0], [0, 128, 0], [0, 128, 64]]
            .into_iter()
            .zip(angles)
        {
            surface.extend([x, y, z + lift].iter().flat_map(|c: &i16| c.to_le_bytes()));
            surface.extend::<[u8; 2]>(angles);
        }
    }
    file.extend(surface);
    file
}
