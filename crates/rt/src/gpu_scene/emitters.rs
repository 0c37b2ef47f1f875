//! Emitters as the shaders read them.

use super::{triangle, wound};
use crate::abi;
use scene::Scene;
use scene::emitter::tree::TreeNode;
use scene::emitter::{Emitter, Emitters, LightBounds, NO_EMITTER, Numbering, Shape, Shine, Source};

/// The tables of a scene's emitters, and behind them those of what emits on each mesh that moves.
#[derive(Default)]
pub(super) struct Tables {
    pub list: Vec<abi::Emitter>,
    pub sources: Vec<abi::Source>,
    /// The triangles of the scene's own sources, world space.
    pub triangles: Vec<abi::Triangle>,
    /// Of all sources the triangle among all.
    pub triangle_numbers: Vec<u32>,
    /// Emitter numbers by place.
    pub numbers: Vec<u32>,
    /// Source numbers by triangle: of each instance, or of the world and each list.
    pub source_numbers: Vec<u32>,
    /// Where those begin.
    pub source_starts: Vec<u32>,
    pub alias: Vec<abi::AliasEntry>,
    /// Where what emits on each mesh that moves stands.
    pub lists: Vec<List>,
    pub maps: Vec<abi::EmissionMap>,
    /// Sums and labels of all maps.
    pub texels: Vec<u32>,
    /// Tree over all lights.
    pub tree: Vec<abi::TreeNode>,
    /// All lights as seen from afar.
    pub bounds: Vec<abi::LightBounds>,
}

/// What emits on a mesh that moves, among the tables.
pub(super) struct List {
    pub first_emitter: u32,
    pub emitters: u32,
    pub first_alias: u32,
}

/// Makes the tables; `triangle_bases` has by mesh the first of its triangles among all.
pub(super) fn tables(scene: &Scene, triangle_bases: &[u32]) -> Tables {
    let mut tables = Tables::default();
    let own = &scene.emitters;
    let of_instance = |instance: u32| triangle_bases[scene.instances[instance as usize].mesh];
    tables.add(own, |s| of_instance(s.instance) + s.triangle);
    tables.tree = own.tree.nodes.iter().map(tree_node).collect();
    tables.bounds = (own.bounds.iter())
        .map(|b| light_bounds(b, b.power / own.total_weight))
        .collect();
    tables.triangles = (own.sources.iter())
        .map(|s| {
            let placed = &scene.instances[s.instance as usize];
            let mesh = &scene.meshes[placed.mesh];
            // Corners in the order in which hits count them.
            let mut t = wound(mesh, &mesh.triangles[s.triangle as usize]);
            t.material = placed.material_of(&t);
            triangle(&mesh.posed(placed.pose), &t, &placed.transform)
        })
        .collect();
    let frames = scene.features.frames;
    let still = if frames { 1 } else { scene.instances.len() };
    (tables.source_numbers, tables.source_starts) = own.sources_by_triangle(
        &scene.meshes,
        &scene.instances[..still.min(scene.instances.len())],
    );
    if !frames {
        return tables;
    }
    for (emitters, &(mesh, _)) in scene.moving.lists.iter().zip(&scene.moving.looks) {
        tables.lists.push(List {
            first_emitter: tables.list.len() as u32,
            emitters: emitters.list.len() as u32,
            first_alias: tables.alias.len() as u32,
        });
        let (first, start) = (tables.sources.len(), tables.source_numbers.len());
        tables.source_starts.push(start as u32);
        let count = scene.meshes[mesh].triangles.len();
        tables.source_numbers.resize(start + count, NO_EMITTER);
        for (number, source) in (first as u32..).zip(&emitters.sources) {
            tables.source_numbers[start + source.triangle as usize] = number;
        }
        tables.add(emitters, |s| triangle_bases[mesh] + s.triangle);
    }
    tables
}

impl Tables {
    /// Adds emitters with what they are made of, behind those that are there; `triangle_number` says
    /// which triangle a source is.
    fn add(&mut self, emitters: &Emitters, triangle_number: impl Fn(&Source) -> u32) {
        let base = Base {
            emitter: self.list.len() as u32,
            source: self.sources.len() as u32,
            map: self.maps.len() as u32,
            number: self.numbers.len() as u32,
        };
        let total = emitters.total_weight;
        let per_weight = if total > 0.0 { 1.0 / total } else { 0.0 };
        for map in &emitters.maps {
            let sums = self.texels.len() as u32;
            self.texels.extend_from_slice(&map.sums);
            let labels = self.texels.len() as u32;
            self.texels.extend_from_slice(&map.labels);
            self.maps.push(abi::EmissionMap {
                sums,
                labels,
                rectangles: map.rectangles.len() as u32,
                width: map.width,
                height: map.height,
            });
        }
        let maps = &self.maps[base.map as usize..];
        let list = (emitters.list.iter()).map(|e| emitter(e, maps, &base, per_weight));
        self.list.extend(list);
        (self.sources).extend(emitters.sources.iter().map(|s| source(s, &base)));
        (self.triangle_numbers).extend(emitters.sources.iter().map(triangle_number));
        let numbered = |&n: &u32| if n == NO_EMITTER { n } else { n + base.emitter };
        self.numbers.extend(emitters.numbers.iter().map(numbered));
        let entry = |&(keep, other): &(f32, u32)| abi::AliasEntry { keep, other };
        self.alias.extend(emitters.alias.iter().map(entry));
    }
}

/// Where the tables of some emitters begin.
struct Base {
    emitter: u32,
    source: u32,
    map: u32,
    number: u32,
}

const _: () = assert!(abi::GUESSES_PER_CANDIDATE == scene::render::GUESSES_PER_CANDIDATE);

fn light_bounds(b: &LightBounds, probability: f32) -> abi::LightBounds {
    let (shine, [cos_inner, cos_outer]) = match b.shine {
        Shine::Front => (abi::SHINE_FRONT, [-2.0; 2]),
        Shine::BothSides => (abi::SHINE_BOTH_SIDES, [-2.0; 2]),
        Shine::AllRound => (abi::SHINE_ALL_ROUND, [-2.0; 2]),
        Shine::Cone {
            cos_inner,
            cos_outer,
        } => (abi::SHINE_CONE, [cos_inner, cos_outer]),
        Shine::Distant => (abi::SHINE_DISTANT, [-2.0; 2]),
    };
    abi::LightBounds {
        centre: b.centre.to_array(),
        radius: b.radius,
        axis: b.axis.to_array(),
        weight: b.weight,
        cos_inner,
        cos_outer,
        shine,
        probability,
    }
}

fn tree_node(n: &TreeNode) -> abi::TreeNode {
    let centre = 0.5 * (n.min + n.max);
    abi::TreeNode {
        centre: centre.to_array(),
        radius2: (n.max - centre).length_squared(),
        axis: n.axis.to_array(),
        cos_cone: n.cos_cone,
        weight: n.weight,
        child: n.child,
        padding: [0; 2],
    }
}

fn emitter(e: &Emitter, maps: &[abi::EmissionMap], base: &Base, per_weight: f32) -> abi::Emitter {
    let (map, rectangle, origin) = match e.shape {
        Shape::Texels {
            map,
            rectangle: [x0, y0, x1, y1],
            tile,
        } => {
            let size = [maps[map as usize].width, maps[map as usize].height];
            let origin = [0, 1].map(|axis| tile[axis] as f32 * size[axis] as f32);
            (base.map + map, [x0 | y0 << 16, x1 | y1 << 16], origin)
        }
        Shape::Part {
            divisions,
            column,
            row,
            upper,
        } => (
            abi::NO_MAP,
            [divisions, u32::from(upper)],
            [column as f32, row as f32],
        ),
    };
    abi::Emitter {
        first_source: base.source + e.first_source,
        sources: e.sources,
        map,
        probability: e.weight * per_weight,
        rectangle,
        origin,
    }
}

fn source(s: &Source, base: &Base) -> abi::Source {
    let (map, first, first_tile, tiles) = match s.numbering {
        Numbering::Texels {
            map,
            first_tile,
            tiles,
            table,
        } => {
            let first_tile = first_tile.map(|t| t as f32);
            (base.map + map, base.number + table, first_tile, tiles)
        }
        Numbering::Parts { divisions, first } => {
            (abi::NO_MAP, base.emitter + first, [0.0; 2], [divisions; 2])
        }
    };
    abi::Source {
        map,
        first,
        first_tile,
        tiles,
        padding: [0; 2],
    }
}
