//! What a scene must hold for rays to be traced in it.

use crate::Error;
use crate::bvh::MAX_TRIANGLES;
use scene::baked::{BakedLight, BakedTriangle};
use scene::cells::{self, CELL, CellNode, LightCells};
use scene::emitter::tree::LEAF;
use scene::emitter::{Emitters, LightTree, NO_EMITTER, Numbering, Shape};
use scene::sky::SkyKind;
use scene::{Material, Scene, TextureId};

/// Checks every index once, so that nothing after this can be out of range.
pub(crate) fn check(scene: &Scene) -> Result<(), Error> {
    let ensure = |ok: bool, what| {
        if ok {
            Ok(())
        } else {
            Err(Error::InvalidScene(what))
        }
    };
    let texture_exists = |id: TextureId| (id.0 as usize) < scene.textures.len();
    ensure(
        scene.textures.iter().all(|t| {
            !t.rgba.is_empty() && t.rgba.len() as u64 == u64::from(t.width) * u64::from(t.height)
        }),
        "a texture's size does not match its texels",
    )?;
    ensure(
        scene.materials.iter().all(|m| {
            let roughness = m.finish.gloss.and_then(|g| g.roughness_map);
            let others = [m.emission, m.finish.normals, roughness];
            texture_exists(m.base) && others.into_iter().flatten().all(texture_exists)
        }),
        "a material's texture does not exist",
    )?;
    let lights = scene.lights.len() as u64;
    ensure(
        (scene.light_sums.iter().flat_map(|s| &s.styles))
            .all(|s| u64::from(s.first) + u64::from(s.count) <= lights),
        "a sum of light has lights that do not exist",
    )?;
    ensure(
        scene.materials.iter().all(|m| {
            m.frames.iter().all(|id| {
                let size = |m: &Material| {
                    let base = &scene.textures[m.base.0 as usize];
                    [base.width, base.height]
                };
                (scene.materials.get(id.0 as usize)).is_some_and(|shown| {
                    size(shown) == size(m)
                        && shown.is_see_through() == m.is_see_through()
                        && shown.emission_weight == m.emission_weight
                })
            })
        }),
        "what a material shows in turn does not exist or differs",
    )?;
    let sky_textures = match scene.sky.kind {
        SkyKind::None | SkyKind::Flat(_) => vec![],
        SkyKind::Scrolling { back, front } => vec![back, front],
        SkyKind::Box(first) => (0..6)
            .map(|i| TextureId(first.0.saturating_add(i)))
            .collect(),
    };
    ensure(
        sky_textures.into_iter().all(texture_exists),
        "a texture of the sky does not exist",
    )?;
    ensure(
        scene.meshes.iter().all(|mesh| {
            mesh.triangles.iter().all(|t| {
                (t.material.0 as usize) < scene.materials.len()
                    && t.vertices
                        .iter()
                        .all(|&v| (v as usize) < mesh.positions.len())
            })
        }),
        "a triangle's vertex or material does not exist",
    )?;
    ensure(
        scene.meshes.iter().all(|m| {
            let whole = m.poses.iter().all(|p| p.len() == m.positions.len());
            let skins_exist = (m.skins.iter()).all(|id| (id.0 as usize) < scene.materials.len());
            whole && skins_exist && m.poses.first().is_none_or(|p| *p == m.positions)
        }),
        "a mesh's poses do not fit it, or a skin does not exist",
    )?;
    ensure(
        scene.meshes.iter().all(|m| {
            let of_poses = m.normals.is_empty() || m.normals.len() == m.poses.len().max(1);
            of_poses && m.normals.iter().all(|n| n.len() == m.triangles.len())
        }),
        "a mesh's normals do not fit it",
    )?;
    (scene.instances.iter())
        .try_for_each(|i| scene.check_instance(i))
        .map_err(Error::InvalidScene)?;
    ensure(
        scene.triangle_count() <= MAX_TRIANGLES,
        "it has more than 2^27 triangles",
    )?;
    ensure(
        (scene.media.nodes.iter().flat_map(|n| n.children))
            .all(|child| child & CELL == 0 || ((child & !CELL) as usize) <= scene.materials.len()),
        "a medium's material does not exist",
    )?;
    let emitters = &scene.emitters;
    ensure(
        emitters.sources.iter().all(|t| {
            (scene.instances.get(t.instance as usize))
                .is_some_and(|i| (t.triangle as usize) < scene.meshes[i.mesh].triangles.len())
        }),
        "an emitter's triangle does not exist",
    )?;
    ensure(
        emitters_are_valid(emitters) && scene.moving.lists.iter().all(emitters_are_valid),
        "an emitter's texels or its number do not exist",
    )?;
    ensure(
        !scene.features.frames || emitters.sources.iter().all(|s| s.instance == 0),
        "frames are shown of it, and an emitter does not lie on the world",
    )?;
    let on_their_mesh = |(e, &(mesh, _)): (&Emitters, &(usize, _))| {
        let triangles = scene.meshes.get(mesh).map_or(0, |m| m.triangles.len());
        e.alias.len() == e.list.len() && e.sources.iter().all(|s| (s.triangle as usize) < triangles)
    };
    let moving = &scene.moving;
    ensure(
        (moving.lists.iter().zip(&moving.looks)).all(on_their_mesh),
        "what emits on a mesh does not fit it",
    )?;
    let entries = emitters.list.len() + scene.lights.len() + scene.sky.suns.len();
    ensure(
        emitters.alias.len() == entries
            && emitters
                .alias
                .iter()
                .all(|&(_, other)| (other as usize) < entries),
        "the emitters' alias table does not fit the emitters",
    )?;
    ensure(
        scene
            .sky
            .suns
            .iter()
            .all(|s| s.one_minus_cos > 0.0 && s.one_minus_cos <= 1.0),
        "a sun is not between a point and half of the sky",
    )?;
    ensure(
        scene.baked.as_ref().is_none_or(|b| baked_fits(scene, b)),
        "the baked light does not fit the meshes",
    )?;
    ensure(
        cells_fit(scene),
        "the cells' lists of lights do not fit the scene",
    )
}

/// Whether every emitter has its triangles and texels, and every triangle its emitters.
fn emitters_are_valid(emitters: &Emitters) -> bool {
    let Emitters {
        list,
        sources,
        numbers,
        maps,
        ..
    } = emitters;
    let maps_are_whole = maps.iter().all(|m| {
        let (w, h) = (m.width as usize, m.height as usize);
        let labels_exist = (m.labels.iter()).all(|&l| l as usize <= m.rectangles.len());
        m.labels.len() == w * h && m.sums.len() == (w + 1) * (h + 1) && labels_exist
    });
    let fits = |[x0, y0, x1, y1]: [u32; 4], map: usize| {
        x0 <= x1
            && y0 <= y1
            && maps
                .get(map)
                .is_some_and(|m| x1 <= m.width && y1 <= m.height)
    };
    let listed = list.iter().all(|e| {
        let last = (e.first_source as usize).saturating_add(e.sources as usize);
        let shape = match e.shape {
            Shape::Texels { map, rectangle, .. } => fits(rectangle, map as usize),
            Shape::Part { divisions, .. } => divisions > 0 && e.sources == 1,
        };
        last <= sources.len() && shape
    });
    let numbered = sources.iter().all(|s| match s.numbering {
        Numbering::Parts { divisions, first } => {
            divisions > 0 && first as usize + divisions.pow(2) as usize <= list.len()
        }
        Numbering::Texels {
            map, tiles, table, ..
        } => {
            let rectangles = maps.get(map as usize).map_or(0, |m| m.rectangles.len());
            let places = tiles[0] as usize * tiles[1] as usize * rectangles;
            places > 0 && table as usize + places <= numbers.len()
        }
    });
    let exist = |&n: &u32| n == NO_EMITTER || (n as usize) < list.len();
    tree_is_valid(&emitters.tree, emitters.alias.len())
        && maps_are_whole
        && listed
        && numbered
        && numbers.iter().all(exist)
}

/// Whether every way down the tree ends in a light, where its trail leads.
fn tree_is_valid(tree: &LightTree, lights: usize) -> bool {
    let nodes = &tree.nodes;
    let children_follow = nodes.iter().enumerate().all(|(i, n)| {
        let child = (n.child & !LEAF) as usize;
        match n.child & LEAF {
            0 => child > i + 1 && child < nodes.len(),
            _ => child < lights,
        }
    });
    children_follow && (nodes.is_empty() || tree.trails.len() == lights)
}

/// Whether every triangle has a grid of samples that exist.
fn baked_fits(scene: &Scene, baked: &BakedLight) -> bool {
    let lies_in = |t: &BakedTriangle| {
        let end = u64::from(t.first) + u64::from(t.width) * u64::from(t.height);
        t.width > 0 && t.height > 0 && end <= baked.samples.len() as u64
    };
    baked.meshes.len() == scene.meshes.len()
        && (baked.meshes.iter().zip(&scene.meshes))
            .all(|(grids, mesh)| grids.len() == mesh.triangles.len() && grids.iter().all(lies_in))
}

/// Whether every way through the cells ends in a list of emitters that exist.
fn cells_fit(scene: &Scene) -> bool {
    let LightCells {
        nodes,
        cells,
        entries,
    } = &scene.cells;
    let leads_on = |(i, node): (usize, &CellNode)| {
        node.children.iter().all(|&child| match child & CELL {
            0 => (i..nodes.len()).contains(&(child as usize)) && child as usize != i,
            _ => ((child & !CELL) as usize) < cells.len(),
        })
    };
    let fits = |cell: &cells::Cell| {
        let list = (cell.begin as usize)
            .checked_add(cell.count as usize)
            .and_then(|end| entries.get(cell.begin as usize..end));
        list.is_some_and(|list| {
            list.iter()
                .all(|e| (e.emitter as usize) < scene.emitters.alias.len() && e.other < cell.count)
        })
    };
    nodes.iter().enumerate().all(leads_on) && cells.iter().all(fits)
}
