//! Agreement with the `qbsp` crate, a reader written by others, on every level that it reads.

use bsp::{Bsp, Limits, Warnings};
use qbsp::data::nodes::{BspNodeRef, BspNodeSubRef};
use qbsp::{BspData, BspParseInput, BspParseSettings};

use crate::data;

#[test]
fn levels_read_as_qbsp_reads_them() {
    let Some(dir) = data::dir("levels_read_as_qbsp_reads_them") else {
        return;
    };
    let mut compared = 0;
    for (name, file) in data::everything(&dir) {
        // qbsp knows no 2PSB.
        if !(file.starts_with(&[29, 0, 0, 0]) || file.starts_with(b"BSP2")) {
            continue;
        }
        let settings = BspParseSettings {
            use_bspx_rgb_lighting: false,
            parse_bspx_structures: false,
        };
        let input = BspParseInput {
            bsp: &file,
            lit: None,
            settings,
        };
        let theirs = BspData::parse(input).unwrap_or_else(|e| panic!("{name}: {e}"));
        let ours = Bsp::parse(&file, &Limits::default(), &mut Warnings::new())
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        compare(&name, &ours, &theirs);
        compared += 1;
    }
    assert!(compared >= 49, "only {compared} levels were compared");
}

fn compare(name: &str, ours: &Bsp, theirs: &BspData) {
    assert_eq!(ours.entity_text, theirs.entities, "{name}: entities");
    assert_eq!(
        ours.clipnodes.len(),
        theirs.clip_nodes.len(),
        "{name}: clipnodes"
    );
    assert_eq!(ours.surfedges, theirs.surface_edges, "{name}: surfedges");
    let marks: Vec<u32> = theirs.mark_surfaces.iter().map(|m| m.0).collect();
    assert_eq!(ours.marksurfaces, marks, "{name}: marksurfaces");
    let edges: Vec<[u32; 2]> = theirs.edges.iter().map(|e| [e.a.0, e.b.0]).collect();
    assert_eq!(ours.edges, edges, "{name}: edges");
    let vertices: Vec<[f32; 3]> = theirs.vertices.iter().map(|v| v.to_array()).collect();
    assert_eq!(ours.vertices, vertices, "{name}: vertices");

    assert_eq!(ours.planes.len(), theirs.planes.len(), "{name}: planes");
    for (a, b) in ours.planes.iter().zip(&theirs.planes) {
        assert_eq!(
            (a.normal, a.distance),
            (b.normal.to_array(), b.dist),
            "{name}: plane"
        );
    }
    assert_eq!(
        ours.texinfos.len(),
        theirs.tex_info.len(),
        "{name}: texinfos"
    );
    for (a, b) in ours.texinfos.iter().zip(&theirs.tex_info) {
        let p = &b.projection;
        assert_eq!(
            a.s,
            p.u_axis.extend(p.u_offset).to_array(),
            "{name}: texinfo s"
        );
        assert_eq!(
            a.t,
            p.v_axis.extend(p.v_offset).to_array(),
            "{name}: texinfo t"
        );
        assert_eq!(
            u32::try_from(a.miptex).ok(),
            b.texture_idx.0,
            "{name}: texinfo miptex"
        );
    }
    assert_eq!(ours.faces.len(), theirs.faces.len(), "{name}: faces");
    for (index, (a, b)) in ours.faces.iter().zip(&theirs.faces).enumerate() {
        let what = format!("{name}: face {index}");
        assert_eq!(a.plane, b.plane_idx.0, "{what}");
        assert_eq!(a.side, b.plane_side.0 != 0, "{what}");
        assert_eq!(a.texinfo, b.texture_info_idx.0, "{what}");
        assert_eq!(a.light_offset, b.lightmap_offset.pixels, "{what}");
        assert_eq!(a.styles, b.lightmap_styles.map(|s| s.0), "{what}");
        if let Some(points) = ours.face_points(a) {
            let points: Vec<[f32; 3]> = points.collect();
            let theirs: Vec<[f32; 3]> = b.vertices(theirs).map(|v| v.to_array()).collect();
            assert_eq!(points, theirs, "{what}");
        }
    }
    assert_eq!(ours.models.len(), theirs.models.len(), "{name}: models");
    for (a, b) in ours.models.iter().zip(&theirs.models) {
        assert_eq!(a.mins, b.bound.min.to_array(), "{name}: model");
        assert_eq!(a.maxs, b.bound.max.to_array(), "{name}: model");
        assert_eq!(
            (a.first_face, a.num_faces),
            (b.first_face, b.num_faces),
            "{name}: model"
        );
        let head = match b.hulls.root {
            BspNodeRef::Node(n) => n.cast_signed(),
            BspNodeRef::Leaf(l) => -1 - l.cast_signed(),
        };
        assert_eq!(a.head_nodes[0], head, "{name}: model");
    }
    assert_eq!(ours.nodes.len(), theirs.nodes.len(), "{name}: nodes");
    for (a, b) in ours.nodes.iter().zip(&theirs.nodes) {
        assert_eq!(a.plane, b.plane_idx, "{name}: node");
        let child = |c: &BspNodeSubRef| match **c {
            BspNodeRef::Node(n) => bsp::bsp::NodeChild::Node(n),
            BspNodeRef::Leaf(l) => bsp::bsp::NodeChild::Leaf(l),
        };
        assert_eq!(
            a.children,
            [child(&b.front), child(&b.back)],
            "{name}: node"
        );
    }
    assert_eq!(ours.leafs.len(), theirs.leaves.len(), "{name}: leafs");
    for (a, b) in ours.leafs.iter().zip(&theirs.leaves) {
        assert_eq!(
            (a.first_mark, a.num_marks),
            (b.face_idx.0, b.face_num.0),
            "{name}: leaf"
        );
    }
    assert_eq!(
        ours.textures.len(),
        theirs.textures.len(),
        "{name}: textures"
    );
    for (a, b) in ours.textures.iter().zip(&theirs.textures) {
        assert_eq!(a.is_some(), b.is_some(), "{name}: texture");
        let (Some(a), Some(b)) = (a, b) else { continue };
        assert_eq!(a.name, b.header.name.as_str(), "{name}: texture");
        assert_eq!(
            (a.width, a.height),
            (b.header.width, b.header.height),
            "{name}: {}",
            a.name
        );
        assert_eq!(
            a.pixels,
            b.data.full.clone().unwrap_or_default(),
            "{name}: {}",
            a.name
        );
    }
}
