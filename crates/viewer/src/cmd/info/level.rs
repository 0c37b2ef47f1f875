//! What a level holds.

use crate::cli::Info;
use crate::level::Source;
use anyhow::Result;
use scene::import::ImportOptions;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Counts of the file as it is, then what the import makes of it.
pub(super) fn describe(file: &str, source: Source, args: &Info) -> Result<Map<String, Value>> {
    let loaded = source.load()?;
    let options = ImportOptions {
        threshold: args.threshold as f32,
        materials: args.surfaces.rules()?,
        replacements: !args.surfaces.no_textures,
        model_replacements: !args.surfaces.original_models,
        smooth_models: !args.surfaces.flat_models,
        light_lists: false,
        ..ImportOptions::default()
    };
    let scene = loaded.import(&options)?;
    let level = &loaded.level;
    let bsp = &level.bsp;
    let mut classes: BTreeMap<&str, usize> = BTreeMap::new();
    for entity in &level.entities {
        *classes.entry(entity.classname()).or_default() += 1;
    }
    let lights: usize = (classes.iter())
        .filter(|(class, _)| class.starts_with("light"))
        .map(|(_, count)| count)
        .sum();
    let bounds = bsp
        .models
        .first()
        .map_or([[0.0; 3]; 2], |m| [m.mins, m.maxs]);
    let cameras: Vec<Value> = (scene.cameras.iter())
        .map(|c| {
            let p = c.position;
            let pose = [p.x, p.y, p.z, c.pitch_deg, c.yaw_deg, c.roll_deg];
            json!({ "name": c.name, "camera": pose.map(|v| v.to_string()).join(" ") })
        })
        .collect();
    let features: Vec<Value> = (scene.features.described().into_iter())
        .map(|(name, why)| json!({ "name": name, "why": why }))
        .collect();
    let textures: Vec<Value> = (bsp.textures.iter())
        .map(|texture| match texture {
            Some(t) => json!({ "name": t.name, "size": format!("{}x{}", t.width, t.height) }),
            None => json!({ "name": "(missing)" }),
        })
        .collect();
    let pairs: Vec<Value> = (scene.report.lamp_pairs.iter())
        .map(|pair| {
            json!({
                "entity": pair.entity,
                "classname": pair.classname,
                "position": pair.position.to_array(),
                "texture": pair.texture,
                "face": pair.face,
                "distance": pair.distance,
            })
        })
        .collect();
    let told = json!({
        "file": file,
        "kind": "BSP",
        "format": bsp.format.name(),
        "name": level.name,
        "title": scene.title,
        "origin": level.origin,
        "companions": level.companions,
        "entities": level.entities.len(),
        "faces": bsp.faces.len(),
        "triangles": scene.triangle_count(),
        "textures": bsp.textures.len(),
        "lights": lights,
        "lights_lit": scene.lights.len(),
        "lamp_pairs": pairs,
        "emissive_texels": scene.report.emissive_texels,
        "emissive_triangles": scene.emitters.list.len(),
        "leafs": bsp.leafs.len(),
        "models": bsp.models.len(),
        "bounds": bounds,
        "vertices": bsp.vertices.len(),
        "planes": bsp.planes.len(),
        "nodes": bsp.nodes.len(),
        "instances": scene.instances.len(),
        "materials": scene.materials.len(),
        "faces_drawn": scene.report.faces,
        "faces_left_out": scene.report.faces_left_out,
        "sealed": scene.report.sealed,
        "open_edges": scene.report.open_edges,
        "t_junctions_split": scene.report.t_junctions_split,
        "features": features,
        "cameras": cameras,
        "classes": classes,
        "shown": (scene.report.models.iter())
            .map(|(model, count)| json!({ "model": model, "count": count }))
            .collect::<Vec<_>>(),
        "texture_list": textures,
        "material_entries": (scene.report.ruled.iter())
            .map(|(texture, entries)| json!({ "texture": texture, "entries": entries }))
            .collect::<Vec<_>>(),
        "replaced_textures": (scene.report.replaced.iter())
            .map(|(texture, path)| json!({ "texture": texture, "picture": path }))
            .collect::<Vec<_>>(),
        "warnings": scene.report.warnings,
    });
    Ok(match told {
        Value::Object(mut map) => {
            if let Some(fog) = &scene.fog {
                let fog = json!({
                    "half_distance": fog.half_distance(),
                    "albedo": fog.albedo.to_array(),
                });
                map.insert("fog".into(), fog);
            }
            map
        }
        _ => Map::new(),
    })
}
