//! What must hold for every compiled map.

use mapc::{Contents, Map};

use crate::reader::{Bsp, Random};

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Every model's surface is closed: each edge is run through as often one way as the other.
pub fn closed(bsp: &Bsp) {
    for (m, (first, count, _, _)) in bsp.models().into_iter().enumerate() {
        let edges = bsp.directed_edges(first, count);
        let v = bsp.vertices();
        for ((a, b), n) in &edges {
            let back = edges.get(&(*b, *a)).copied().unwrap_or(0);
            assert_eq!(
                *n, back,
                "model {m}: the edge {:?} to {:?} is open",
                v[*a], v[*b]
            );
        }
    }
}

/// Vertices lie on the face's plane and run clockwise seen from its front; no face is degenerate,
/// too large for classic engines, or not convex.
pub fn winding(bsp: &Bsp) {
    let (vertices, planes) = (bsp.vertices(), bsp.planes());
    let names = bsp.texture_names();
    for f in bsp.faces() {
        let (mut normal, mut dist) = planes[f.plane];
        if f.side {
            normal = normal.map(|v| -v);
            dist = -dist;
        }
        let p: Vec<_> = f.vertices.iter().map(|v| vertices[*v]).collect();
        let n = p.len();
        let mut area = [0.0; 3];
        for i in 0..n {
            assert!(
                (dot(p[i], normal) - dist).abs() < 0.05,
                "{:?} is off its plane",
                p[i]
            );
            let (u, v) = (
                sub(p[(i + 1) % n], p[i]),
                sub(p[(i + 2) % n], p[(i + 1) % n]),
            );
            let turn = dot(cross(u, v), normal) / (dot(u, u) * dot(v, v)).sqrt();
            assert!(
                turn < 1e-2,
                "not convex: sine {turn} at {:?}",
                p[(i + 1) % n]
            );
            let c = cross(sub(p[i], p[0]), sub(p[(i + 1) % n], p[0]));
            area = [area[0] + c[0], area[1] + c[1], area[2] + c[2]];
        }
        // Clockwise: the right-hand normal of the polygon points to the back.
        assert!(
            dot(area, normal) < -1e-3,
            "area {area:?} against normal {normal:?}"
        );
        let (rows, texture, flags) = bsp.texinfo(f.texinfo);
        let name = &names[texture];
        assert_eq!(
            flags & 1 == 1,
            name.starts_with('*') || name.starts_with("sky"),
            "{name}"
        );
        for r in rows {
            let s: Vec<f64> = p
                .iter()
                .map(|p| (dot(*p, [r[0], r[1], r[2]]) + r[3]) as f32)
                .map(f64::from)
                .collect();
            let lo = s.iter().copied().fold(f64::INFINITY, f64::min);
            let hi = s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let extent = (hi / 16.0).ceil() * 16.0 - (lo / 16.0).floor() * 16.0;
            assert!(
                flags & 1 == 1 || extent <= 256.0,
                "extent {extent} of {name}"
            );
        }
    }
}

/// The strongest brush that contains a point says what the leaf there holds.
pub fn contents(map: &Map, bsp: &Bsp, mins: [f64; 3], maxs: [f64; 3], points: usize) {
    let is_world = |e: &&mapc::Entity| {
        matches!(
            e.get("classname"),
            Some("worldspawn" | "func_detail" | "func_group")
        )
    };
    let world: Vec<_> = map
        .entities
        .iter()
        .filter(is_world)
        .flat_map(|e| &e.brushes)
        .collect();
    let head = bsp.models()[0].2;
    let leafs = bsp.leafs();
    let mut random = Random(1);
    for _ in 0..points {
        let p = random.point(mins, maxs);
        let inside = world
            .iter()
            .filter(|b| b.contains(p))
            .map(|b| Contents::of_texture(&b.faces[0].texture))
            .max()
            .unwrap_or(Contents::Empty);
        let leaf = &leafs[bsp.leaf_at(head[0], p)];
        assert_eq!(leaf.contents, inside.code(), "at {p:?}");
        if inside == Contents::Solid || inside == Contents::Sky {
            // What a point cannot enter, a box cannot either.
            for h in [1, 2] {
                assert_eq!(bsp.clip_contents(head[h], p), -2, "hull {h} at {p:?}");
            }
        }
    }
}

/// Each leaf sees itself, sight is mutual, and random unblocked lines of sight are in the PVS.
pub fn visibility(bsp: &Bsp, mins: [f64; 3], maxs: [f64; 3], lines: usize) {
    let (_, _, head, visleafs) = bsp.models()[0];
    let leafs = bsp.leafs();
    let rows: Vec<Vec<bool>> = (1..=visleafs)
        .map(|l| bsp.pvs(leafs[l].visofs, visleafs))
        .collect();
    for (i, row) in rows.iter().enumerate() {
        assert!(row[i], "leaf {} does not see itself", i + 1);
        for (j, other) in rows.iter().enumerate() {
            assert_eq!(row[j], other[i], "leafs {} and {}", i + 1, j + 1);
        }
    }
    let mut random = Random(2);
    let opaque = |l: usize| matches!(leafs[l].contents, -2 | -6);
    let mut tested = 0;
    for _ in 0..lines {
        let (a, b) = (random.point(mins, maxs), random.point(mins, maxs));
        let (la, lb) = (bsp.leaf_at(head[0], a), bsp.leaf_at(head[0], b));
        if opaque(la) || opaque(lb) {
            continue;
        }
        let steps = 400;
        let free = (1..steps).all(|i| {
            let t = f64::from(i) / f64::from(steps);
            let p = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
            !opaque(bsp.leaf_at(head[0], p))
        });
        if free {
            tested += 1;
            assert!(
                rows[la - 1][lb - 1],
                "{a:?} sees {b:?}, leafs {la} and {lb}"
            );
        }
    }
    assert!(
        tested > lines / 100,
        "only {tested} lines of sight were free"
    );
}

/// Every face is marked in some leaf, and only in leafs it can be seen from.
pub fn marks(bsp: &Bsp) {
    let mut marked = vec![false; bsp.faces().len()];
    for leaf in bsp.leafs() {
        assert!(!matches!(leaf.contents, -2 | -6) || leaf.marks.is_empty());
        for m in leaf.marks {
            marked[m] = true;
        }
    }
    assert!(marked.iter().all(|m| *m));
}
