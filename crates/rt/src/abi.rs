//! What host and shaders agree on: structs, constants, binding numbers.
//!
//! This file is the only source. `shaders/abi.glsl` is generated from it and committed; a test
//! fails when it is stale, another compares every member's offset in the compiled SPIR-V with the
//! host's. Structs use scalar block layout, which is `repr(C)` for these types.

#![allow(non_camel_case_types, reason = "GLSL's own names for its types")]

use bytemuck::{Pod, Zeroable};

/// GLSL `uint`.
pub type uint = u32;
/// GLSL `float`.
pub type float = f32;
/// GLSL `vec2`.
pub type vec2 = [f32; 2];
/// GLSL `vec3`.
pub type vec3 = [f32; 3];
/// GLSL `vec4`.
pub type vec4 = [f32; 4];
/// GLSL `uvec2`.
pub type uvec2 = [u32; 2];

/// A struct's layout, for the tests.
pub struct Layout {
    /// Name, the same on both sides.
    pub name: &'static str,
    /// Members with their byte offsets on the host.
    pub members: &'static [(&'static str, usize)],
}

/// Declares structs, arrays in buffers and constants for both sides.
macro_rules! abi {
    (
        constants { $( $(#[doc = $cdoc:literal])* $cname:ident : $cty:ident = $cvalue:literal; )* }
        references { $( $(#[doc = $rdoc:literal])* $rname:ident => $access:ident $relem:ident, align $align:literal; )* }
        structs { $(
            $(#[doc = $sdoc:literal])*
            $sname:ident { $( $(#[doc = $fdoc:literal])* $fname:ident : $fty:ident, )* }
        )* }
    ) => {
        $( $(#[doc = $cdoc])* pub const $cname: $cty = $cvalue; )*
        $( $(#[doc = $rdoc])* pub type $rname = u64; )*
        $(
            $(#[doc = $sdoc])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
            pub struct $sname { $( $(#[doc = $fdoc])* pub $fname: $fty, )* }
        )*

        /// Host layouts of all structs.
        pub const LAYOUTS: &[Layout] = &[ $( Layout {
            name: stringify!($sname),
            members: &[ $( (stringify!($fname), std::mem::offset_of!($sname, $fname)), )* ],
        }, )* ];

        /// The text of `shaders/abi.glsl`.
        #[must_use]
        pub fn glsl() -> String {
            let mut text = String::from(GLSL_HEAD);
            $(
                $( text += concat!("//", $cdoc, "\n"); )*
                text += &constant(stringify!($cname), stringify!($cty), f64::from($cvalue as u32));
            )*
            text.push('\n');
            // References may point to structs that hold references: name them all first.
            $( text += concat!("layout(buffer_reference) buffer ", stringify!($rname), ";\n"); )*
            $(
                text.push('\n');
                $( text += concat!("//", $sdoc, "\n"); )*
                text += concat!("struct ", stringify!($sname), " {\n");
                $(
                    $( text += concat!("    //", $fdoc, "\n"); )*
                    text += concat!("    ", stringify!($fty), " ", stringify!($fname), ";\n");
                )*
                text += "};\n";
            )*
            $(
                text.push('\n');
                $( text += concat!("//", $rdoc, "\n"); )*
                text += concat!(
                    "layout(buffer_reference, scalar, buffer_reference_align = ", $align, ") ",
                    stringify!($access), " buffer ", stringify!($rname), " {\n    ",
                    stringify!($relem), " at[];\n};\n"
                );
            )*
            text
        }
    };
}

const GLSL_HEAD: &str = "\
// Generated from crates/rt/src/abi.rs by `cargo xtask abi`; do not edit.

#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require

";

fn constant(name: &str, ty: &str, value: f64) -> String {
    let suffix = if ty == "uint" { "u" } else { "" };
    format!("const {ty} {name} = {value}{suffix};\n")
}

abi! {
    constants {
        /// Descriptor binding of the top-level acceleration structure.
        BINDING_TLAS: uint = 0;
        /// Descriptor binding of the array of all textures.
        BINDING_TEXTURES: uint = 1;
        /// Estimator: direction = normal + point on unit sphere, light by hitting it.
        ESTIMATOR_NAIVE: uint = 0;
        /// Estimator: uniform hemisphere, light by hitting it.
        ESTIMATOR_UNIFORM: uint = 1;
        /// Estimator: light sampling alone.
        ESTIMATOR_NEE: uint = 2;
        /// Estimator: light sampling and hits, weighted.
        ESTIMATOR_MIS: uint = 3;
        /// Selection: by the alias table over estimated powers.
        SELECTION_POWER: uint = 0;
        /// Selection: every entry of the table alike.
        SELECTION_UNIFORM: uint = 1;
        /// Selection: by the list of the cell a point lies in.
        SELECTION_LEAF: uint = 2;
        /// Lights that are weighed by a guess, per candidate of other selections.
        GUESSES_PER_CANDIDATE: uint = 4;
        /// Shine of a light: to the front of a plane.
        SHINE_FRONT: uint = 0;
        /// To both sides of a plane.
        SHINE_BOTH_SIDES: uint = 1;
        /// Everywhere alike.
        SHINE_ALL_ROUND: uint = 2;
        /// In a cone.
        SHINE_CONE: uint = 3;
        /// From far away.
        SHINE_DISTANT: uint = 4;
        /// Selection: by the tree over all lights.
        SELECTION_TREE: uint = 3;
        /// Flag of a tree node's child: a light, not a node.
        LEAF: uint = 0x8000_0000;
        /// Trail of a light that is not in the tree.
        NO_TRAIL: uint = 0xffff_ffff;
        /// Flag of a cell node's child: a cell, not a node.
        CELL: uint = 0x8000_0000;
        /// Number of the emitter or source where there is none.
        NO_EMITTER: uint = 0xffff_ffff;
        /// Map of an emitter that is a part of a triangle.
        NO_MAP: uint = 0xffff_ffff;
        /// Escapes that are kept; the rest is only counted.
        ESCAPES_KEPT: uint = 100;
        /// Material flag: emits to both sides.
        MATERIAL_TWO_SIDED: uint = 2;
        /// Material flag: liquid warp; texture coordinates are world units.
        MATERIAL_WARPED: uint = 4;
        /// Material flag: shows the sky and ends the path.
        MATERIAL_SKY: uint = 8;
        /// Material flag: has an emission texture.
        MATERIAL_EMISSIVE: uint = 16;
        /// Material flag: light passes straight through, in part; see its finish.
        MATERIAL_TRANSLUCENT: uint = 32;
        /// Material flag: gloss over the painted part; see its finish.
        MATERIAL_GLOSSY: uint = 64;
        /// Material flag: has a picture of its normals.
        MATERIAL_BUMPED: uint = 128;
        /// Number of a texture that is not there.
        NO_TEXTURE: uint = 0xffff_ffff;
        /// Rows and columns of the gloss table.
        GLOSS_TABLE_SIDE: uint = 40;
        /// Number of a material that stands for free space.
        NO_MEDIUM: uint = 0xffff_ffff;
        /// Falloff of a compiler light: `max(0, 1 - scale d)`.
        FALLOFF_LINEAR: uint = 0;
        /// Falloff: `K / (scale d)`, with K = 128.
        FALLOFF_INVERSE: uint = 1;
        /// Falloff: `(K / (scale d))^2`.
        FALLOFF_INVERSE_SQUARE: uint = 2;
        /// Falloff: `(K / (scale d + K))^2`.
        FALLOFF_SHIFTED: uint = 3;
        /// Falloff: none.
        FALLOFF_CONSTANT: uint = 4;
        /// Falloff: none, from the sky against the light's direction.
        FALLOFF_SUN: uint = 5;
        /// The same at any distance, from either side, as the least that there is.
        FALLOFF_LEAST: uint = 6;
        /// Sky kinds: none, the same everywhere, two scrolling layers, six sides.
        SKY_NONE: uint = 0;
        /// See `SKY_NONE`.
        SKY_FLAT: uint = 1;
        /// See `SKY_NONE`.
        SKY_SCROLLING: uint = 2;
        /// See `SKY_NONE`.
        SKY_BOX: uint = 3;
        /// Film plane: sum of radiance rgb, number of samples.
        PLANE_BEAUTY: uint = 0;
        /// Film plane: sum of squared deviations from the mean rgb (Welford), face id + 1.
        PLANE_DEVIATION: uint = 1;
        /// Film plane: compensation of the radiance sum rgb (Kahan), sum of depth.
        PLANE_COMPENSATION: uint = 2;
        /// Number of film planes that are always there.
        PLANES_BASIC: uint = 3;
        /// Film plane: sum of emission seen directly, sum of motion to the right.
        PLANE_EMISSION: uint = 3;
        /// Film plane: sum of light reflected once, sum of motion down.
        PLANE_DIRECT: uint = 4;
        /// Film plane: sum of light reflected more than once.
        PLANE_INDIRECT: uint = 5;
        /// Film plane: sum of first-hit albedo.
        PLANE_ALBEDO: uint = 6;
        /// Film plane: sum of first-hit normals.
        PLANE_NORMAL: uint = 7;
        /// Film plane: sum of first-hit positions.
        PLANE_POSITION: uint = 8;
        /// Number of film planes with all layers. Sums of light by light style follow, from the second
        /// one on.
        PLANES_ALL: uint = 9;
        /// Hit payload: no triangle was hit.
        MISS: uint = 0xffff_ffff;
        /// Custom index of an instance: bits of its number.
        INSTANCE_INDEX: uint = 0x001f_ffff;
        /// Custom index of an instance, flag: only the camera sees it.
        INSTANCE_APART: uint = 0x0020_0000;
        /// Custom index of an instance, flag: its corners are those of a pose.
        INSTANCE_POSED: uint = 0x0040_0000;
        /// Custom index of an instance, flag: its transform is not the identity.
        INSTANCE_PLACED: uint = 0x0080_0000;
        /// Mask of what rays from the camera meet.
        MASK_CAMERA: uint = 1;
        /// Mask of what rays from surfaces meet.
        MASK_OTHERS: uint = 2;
        /// Mask of what rays from surfaces meet that only the camera sees.
        MASK_APART: uint = 4;
        /// Mask of what all rays meet.
        MASK_ALL: uint = 7;
        /// Skin of an instance that shows its mesh's own materials.
        NO_SKIN: uint = 0xffff_ffff;
        /// Flag of a past: the instance moved.
        PAST_MOVED: uint = 1;
        /// Flag of a past: its corners are those of a pose.
        PAST_POSED: uint = 2;
        /// Flag of a past: its corners are those of loose triangles, world space.
        PAST_LOOSE: uint = 4;
        /// Instance of a moving light that is a sphere, and of lights that do not move.
        NO_INSTANCE: uint = 0xffff_ffff;
        /// Hit payload, flag beside the custom index: the triangle was seen from the front.
        HIT_FRONT: uint = 0x8000_0000;
        /// Kind of a logged ray: end of the pixel's list.
        RAY_NONE: uint = 0;
        /// Kind of a logged ray: camera or bounce ray.
        RAY_PATH: uint = 1;
        /// Kind of a logged ray: shadow ray.
        RAY_SHADOW: uint = 2;
    }
    references {
        /// Triangles of all meshes, or those that emit in world space.
        TriangleRef => readonly Triangle, align "16";
        /// Instances, by custom index.
        InstanceRef => readonly Instance, align "16";
        /// Figures, by custom index.
        FigureRef => readonly Figure, align "16";
        /// Where instances were, by custom index.
        PastRef => readonly Past, align "16";
        /// Corners of triangles in poses, local space.
        CornerRef => readonly vec3, align "4";
        /// Lights that move.
        MovingLightRef => readonly MovingLight, align "16";
        /// Materials, by material id.
        MaterialRef => readonly Material, align "16";
        /// Finishes, by material id.
        FinishRef => readonly Finish, align "16";
        /// Emitters: those of the scene, then those of each mesh that moves.
        EmitterRef => readonly Emitter, align "16";
        /// Triangles that emit.
        SourceRef => readonly Source, align "16";
        /// Emission textures.
        EmissionMapRef => readonly EmissionMap, align "4";
        /// What one reflection by microfacets gives back, as factor and summand of the
        /// reflectance straight on; by roughness, then by root of the cosine.
        GlossTableRef => readonly vec2, align "8";
        /// Alias table over emitters, then point lights, then suns.
        AliasRef => readonly AliasEntry, align "8";
        /// Nodes of the tree over all lights, the root first.
        TreeNodeRef => readonly TreeNode, align "16";
        /// What all lights look like from afar, in the order of the alias table.
        LightBoundsRef => readonly LightBounds, align "16";
        /// Splits of space into cells, the root first.
        CellNodeRef => readonly CellNode, align "16";
        /// Cells.
        CellRef => readonly Cell, align "8";
        /// Lists of the cells, one after the other.
        CellEntryRef => readonly CellEntry, align "16";
        /// Numbers of emitters or sources, sums and labels of texels.
        NumberRef => readonly uint, align "4";
        /// Grids of baked light, by triangle of all meshes.
        BakedTriangleRef => readonly BakedTriangle, align "4";
        /// Samples of baked light.
        BakedSampleRef => readonly vec3, align "4";
        /// Point lights.
        LightRef => readonly Light, align "16";
        /// Light styles of the point lights.
        StyleOfLightRef => readonly StyleOfLight, align "8";
        /// Sums of compiler lights.
        StyleSumRef => readonly StyleSum, align "8";
        /// Suns.
        SunRef => readonly Sun, align "16";
        /// The scene (one element).
        SceneRef => readonly SceneData, align "8";
        /// Film planes of width * height elements each, one after the other.
        FilmRef => restrict vec4, align "16";
        /// Where things are counted (one element).
        TalliesRef => readonly Tallies, align "8";
        /// Counters (one element).
        CountersRef => restrict Counters, align "8";
        /// Rays that hit nothing, ESCAPES_KEPT elements.
        EscapesRef => restrict Escape, align "16";
        /// Samples to add to each pixel.
        ScheduleRef => readonly uint, align "4";
        /// Logged rays: width * height rays of every pixel's first ray, then of the second, ...
        RayRef => restrict LoggedRay, align "16";
    }
    structs {
        /// One triangle with all that shading needs.
        Triangle {
            /// Corner, local space (world space for those that emit).
            p0: vec3,
            /// Material index.
            material: uint,
            /// Corner.
            p1: vec3,
            /// Number of the level's face.
            face: uint,
            /// Corner.
            p2: vec3,
            /// Unit normal to the front, same space as the corners.
            normal: vec3,
            /// Texture coordinates of p0, texels.
            uv0: vec2,
            /// Texture coordinates of p1, texels.
            uv1: vec2,
            /// Texture coordinates of p2, texels.
            uv2: vec2,
        }
        /// A placed mesh.
        Instance {
            /// Local to world, rows of a 3 x 4 matrix.
            row0: vec4,
            /// Second row.
            row1: vec4,
            /// Third row.
            row2: vec4,
            /// Index of the mesh's first opaque triangle.
            opaque_base: uint,
            /// Index of the mesh's first alpha-tested triangle.
            alpha_base: uint,
            /// Added to a triangle's index, where its number among the sources stands.
            source_offset: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uint,
        }
        /// What an instance has besides its place.
        Figure {
            /// Material that stands for those of its mesh, or NO_SKIN.
            skin: uint,
            /// Added to a triangle's index, a third of where its corners stand.
            posed: uint,
            /// Probability with which light sampling chooses it, of instances that move.
            probability: float,
            /// 1 if its facets are shaded as round.
            smooth_shaded: uint,
            /// Added to a triangle's index, a third of where its normals stand in the one pose.
            normals_from: uint,
            /// The same in the other pose.
            normals_to: uint,
            /// How far it is from the one to the other.
            fraction: float,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uint,
        }
        /// Where an instance was in the picture before.
        Past {
            /// Local to world, rows of a 3 x 4 matrix.
            row0: vec4,
            /// Second row.
            row1: vec4,
            /// Third row.
            row2: vec4,
            /// Added to a triangle's index, a third of where its corners stood.
            posed: uint,
            /// PAST_ flags.
            flags: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uvec2,
        }
        /// What emits and moves: a sphere, or an instance.
        MovingLight {
            /// Custom index of the instance; NO_INSTANCE of a sphere.
            instance: uint,
            /// Number of its mesh's first emitter, or of the sphere.
            first: uint,
            /// Emitters of its mesh.
            count: uint,
            /// Where the alias table over these begins.
            alias: uint,
            /// Probability with which light sampling chooses it.
            probability: float,
            /// Alias table over all that moves: probability to keep this entry.
            keep: float,
            /// The entry to take otherwise.
            other: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uint,
        }
        /// What a surface looks like.
        Material {
            /// Index of the base texture.
            base: uint,
            /// Index of the emission texture, valid if MATERIAL_EMISSIVE.
            emission: uint,
            /// Radiance of a white emission texel.
            emission_scale: float,
            /// Mean luminance of the emitted radiance; 0 if nothing is chosen as a light.
            emission_weight: float,
            /// MATERIAL_ flags.
            flags: uint,
            /// Texture width in texels.
            width: uint,
            /// Texture height in texels.
            height: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uint,
        }
        /// Texels of a face, or a part of a triangle, that can be chosen as a light.
        Emitter {
            /// First of the sources it lies on.
            first_source: uint,
            /// How many.
            sources: uint,
            /// Its map, or NO_MAP for a part of a triangle.
            map: uint,
            /// Probability with which the alias table chooses it.
            probability: float,
            /// Texels x0 | y0 << 16, x1 | y1 << 16; of a part, divisions and 1 for an upper half.
            rectangle: uvec2,
            /// Texture coordinates of its tile; of a part, column and row.
            origin: vec2,
        }
        /// How the emitters of a triangle are numbered.
        Source {
            /// Its map, or NO_MAP for parts.
            map: uint,
            /// Where its numbers begin; of parts, the first emitter.
            first: uint,
            /// First tile.
            first_tile: vec2,
            /// Tiles along each axis; of parts, divisions.
            tiles: uvec2,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uvec2,
        }
        /// The emitting texels of a texture.
        EmissionMap {
            /// Where its sums begin among the texel tables.
            sums: uint,
            /// Where its labels begin.
            labels: uint,
            /// Rectangles.
            rectangles: uint,
            /// Texels across.
            width: uint,
            /// Texels down.
            height: uint,
        }
        /// What a surface is besides an opaque Lambertian reflector.
        Finish {
            /// What of the light that passes the interface is left.
            tint: vec3,
            /// Coverage with paint.
            alpha: float,
            /// Absorption behind the front, per world unit.
            absorption: vec3,
            /// Index of refraction of the interface.
            ior: float,
            /// Roughness of the gloss.
            roughness: float,
            /// Share of metal.
            metallic: float,
            /// Reflectance of the rest straight on, over 0.08.
            specular: float,
            /// Texture whose red scales the roughness, or NO_TEXTURE.
            roughness_map: uint,
            /// Texture of normals, or NO_TEXTURE.
            normals: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: vec3,
        }
        /// One entry of the alias table.
        AliasEntry {
            /// Probability to keep this entry.
            keep: float,
            /// The entry to take otherwise.
            other: uint,
        }
        /// A group of lights.
        TreeNode {
            /// Middle of its bounds, world space.
            centre: vec3,
            /// Squared distance from there to a corner.
            radius2: float,
            /// Axis of the cone of directions that its lights face.
            axis: vec3,
            /// Cosine of the cone's half angle; -1 if some light shines to all sides.
            cos_cone: float,
            /// Sum of the weights.
            weight: float,
            /// The second child (the first one is the next node), or a light with the flag LEAF.
            child: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uvec2,
        }
        /// A light as seen from afar.
        LightBounds {
            /// Middle, world space.
            centre: vec3,
            /// Distance from there that no point of it exceeds; sine of a distant light's angular radius.
            radius: float,
            /// Normal, direction of the cone, or direction to a distant light.
            axis: vec3,
            /// Luminance of the irradiance it gives straight on, at distance 1.
            weight: float,
            /// Cosine of half the inner cone.
            cos_inner: float,
            /// Cosine of half the outer cone.
            cos_outer: float,
            /// SHINE_.
            shine: uint,
            /// Probability with which the alias table chooses it.
            probability: float,
        }
        /// A split of space by a plane.
        CellNode {
            /// Unit normal.
            normal: vec3,
            /// Distance of the plane from the origin.
            distance: float,
            /// Where points in front of the plane go: a node, or a cell with the flag CELL.
            front: uint,
            /// Where the other points go.
            back: uint,
            /// Unused, keeps the size a multiple of 16 bytes.
            padding: uvec2,
        }
        /// A cell's part of the lists.
        Cell {
            /// First entry.
            begin: uint,
            /// Number of entries.
            count: uint,
        }
        /// A light in a cell's list, which rises by emitter.
        CellEntry {
            /// Number of the emitter.
            emitter: uint,
            /// Probability with which the list chooses it.
            probability: float,
            /// Alias table of the list: probability to keep this entry.
            keep: float,
            /// The entry to take otherwise, counted within the list.
            other: uint,
        }
        /// Where a triangle's samples of baked light are.
        BakedTriangle {
            /// Index of the first sample.
            first: uint,
            /// Luxels across.
            width: uint,
            /// Luxels down.
            height: uint,
            /// Luxel coordinates of p0.
            uv0: vec2,
            /// Luxel coordinates of p1.
            uv1: vec2,
            /// Luxel coordinates of p2.
            uv2: vec2,
        }
        /// A point light: an invisible sphere, or a compiler light.
        Light {
            /// Centre, world space.
            position: vec3,
            /// Radius.
            radius: float,
            /// Radiant intensity; irradiance of a compiler light.
            intensity: vec3,
            /// Probability with which the alias table chooses it.
            probability: float,
            /// Direction of the cone, or of a sun's light.
            direction: vec3,
            /// Cosine of half the inner cone.
            cos_inner: float,
            /// Cosine of half the outer cone; below -1 if there is no cone.
            cos_outer: float,
            /// FALLOFF_ of a compiler light.
            falloff: uint,
            /// Its factor of the distance.
            falloff_scale: float,
            /// Its share of the cosine.
            angle_scale: float,
        }
        /// Which light style a point light shines in.
        StyleOfLight {
            /// Number of its film plane from 1; 0 if it has none.
            plane: uint,
            /// Brightness of the style; 1 if it has no plane.
            brightness: float,
        }
        /// The compiler lights of a style, where not all add up.
        StyleSum {
            /// Least irradiance of all surfaces.
            least: vec3,
            /// Brightness that is in it and in the lights.
            brightness: float,
            /// First point light: those that add, then those of FALLOFF_LEAST, then negative ones.
            first: uint,
            /// Point lights.
            count: uint,
        }
        /// A sun: a disc in the sky.
        Sun {
            /// Unit direction to its middle.
            direction: vec3,
            /// 1 - cos of its angular radius.
            one_minus_cos: float,
            /// Radiance.
            radiance: vec3,
            /// Probability with which the alias table chooses it.
            probability: float,
        }
        /// Everything a shader reads of the scene.
        SceneData {
            /// Triangles of all meshes.
            triangles: TriangleRef,
            /// Instances.
            instances: InstanceRef,
            /// What they have besides their place.
            figures: FigureRef,
            /// Where they were, if `has_before`.
            pasts: PastRef,
            /// Corners of triangles in poses.
            posed_corners: CornerRef,
            /// Where the corners of loose triangles were, if they moved.
            loose_corners: CornerRef,
            /// Normals of triangles' corners in poses, octahedral coordinates.
            normals: NumberRef,
            /// What emits and moves.
            moving_lights: MovingLightRef,
            /// Spheres among it.
            moving_spheres: LightRef,
            /// Triangles of the sources, as numbers among all.
            source_indices: NumberRef,
            /// Materials.
            materials: MaterialRef,
            /// Finishes.
            finishes: FinishRef,
            /// Gloss table.
            gloss_table: GlossTableRef,
            /// Emitters.
            emitters: EmitterRef,
            /// Triangles they lie on.
            sources: SourceRef,
            /// The same triangles, world space.
            source_triangles: TriangleRef,
            /// Emission textures.
            maps: EmissionMapRef,
            /// Sums and labels of their texels.
            texel_tables: NumberRef,
            /// Emitter numbers by place.
            emitter_numbers: NumberRef,
            /// Source numbers by triangle of each instance.
            source_numbers: NumberRef,
            /// Alias table.
            alias: AliasRef,
            /// Point lights.
            lights: LightRef,
            /// Tree over all lights.
            tree: TreeNodeRef,
            /// The way down to each light, second children as bits from the lowest.
            trails: NumberRef,
            /// All lights as seen from afar.
            light_bounds: LightBoundsRef,
            /// Suns.
            suns: SunRef,
            /// Light styles of the point lights.
            light_styles: StyleOfLightRef,
            /// Sums of compiler lights, then one for each material whose `least` stands for that of the first.
            style_sums: StyleSumRef,
            /// Grids of baked light.
            baked: BakedTriangleRef,
            /// Samples of baked light.
            baked_samples: BakedSampleRef,
            /// Splits of space into cells.
            cell_nodes: CellNodeRef,
            /// Cells.
            cells: CellRef,
            /// Lists of the cells.
            cell_entries: CellEntryRef,
            /// Number of emitters: entries of the alias table below it are emitters.
            emitter_count: uint,
            /// Entries of the alias table.
            entry_count: uint,
            /// Number of suns.
            sun_count: uint,
            /// Emitter number of the first sun.
            first_sun: uint,
            /// Factor of the sky's picture in directions that look up.
            sky_upper: vec3,
            /// Factor in those that look down.
            sky_lower: vec3,
            /// Radiance of fog before its upper half.
            veil_upper: vec3,
            /// Radiance of fog before its lower half.
            veil_lower: vec3,
            /// Radiance of a flat sky.
            sky_radiance: vec3,
            /// Texture of the back layer, or the first of a skybox's six.
            sky_back: uint,
            /// Texture of the front layer.
            sky_front: uint,
            /// Probability with which the table over all emitters chooses, whatever a cell lists.
            cell_fallback: float,
            /// Share of the light that fog scatters, of what it takes.
            fog_albedo: vec3,
            /// Share of light that fog takes, per world unit.
            fog_extinction: float,
            /// Probability with which something that moves is chosen instead of the scene's own lights.
            moving_share: float,
            /// Number of what emits and moves.
            moving_count: uint,
            /// Triangles with grids of baked light.
            baked_count: uint,
            /// Number of sums of compiler lights.
            sum_count: uint,
            /// Gamma of the lightmaps that they stand for.
            light_gamma: float,
            /// 1 if there was a picture before.
            has_before: uint,
            /// Its eye, world space.
            before_origin: vec3,
            /// Its unit view direction.
            before_forward: vec3,
            /// To the right edge of its image plane.
            before_right: vec3,
            /// To the upper edge.
            before_up: vec3,
        }
        /// Where things are counted.
        Tallies {
            /// The counters.
            counters: CountersRef,
            /// Where rays that hit nothing are kept.
            escapes: EscapesRef,
        }
        /// Numbers counted by the shaders, as low and high words.
        Counters {
            /// Rays traced.
            rays: uvec2,
            /// Samples that were not finite.
            nonfinite: uvec2,
            /// Camera and bounce rays that hit nothing.
            escaped: uvec2,
        }
        /// A camera or bounce ray that hit nothing.
        Escape {
            /// Origin, world space.
            origin: vec3,
            /// The pixel's number.
            pixel: uint,
            /// Unit direction.
            direction: vec3,
            /// The pixel's sample it belongs to.
            sample_index: uint,
        }
        /// One ray as it was traced.
        LoggedRay {
            /// Origin, world space.
            origin: vec3,
            /// Where it ends.
            t_max: float,
            /// Unit direction.
            direction: vec3,
            /// RAY_NONE, RAY_PATH or RAY_SHADOW.
            kind: uint,
        }
        /// Push constants of the path tracer.
        PathTraceParams {
            /// The scene.
            scene: SceneRef,
            /// The film.
            film: FilmRef,
            /// Where things are counted.
            tallies: TalliesRef,
            /// Where rays are logged, if they are.
            ray_log: RayRef,
            /// Samples to add by pixel, read if `sample_count` is 0.
            schedule: ScheduleRef,
            /// Eye, world space.
            origin: vec3,
            /// Level time, seconds.
            time: float,
            /// Unit view direction.
            forward: vec3,
            /// Longest ray the level needs.
            t_max: float,
            /// To the right edge of the image plane.
            right: vec3,
            /// Path vertices, 0 for unlimited.
            depth: uint,
            /// To the upper edge of the image plane.
            up: vec3,
            /// Samples to add to every pixel; 0 to read each pixel's from `schedule`.
            sample_count: uint,
            /// Seed.
            seed: uvec2,
            /// Rays logged per pixel at most.
            ray_log_length: uint,
            /// Material whose absorption fills the space at the eye, or NO_MEDIUM.
            medium: uint,
            /// Radius of the lens.
            lens_radius: float,
            /// Distance of the plane of focus along the view direction.
            focus: float,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_what_the_shaders_read() {
        // Elements of arrays that are read at a 16-byte alignment.
        assert_eq!(size_of::<Triangle>(), 80);
        assert_eq!(size_of::<Instance>(), 64);
        assert_eq!(size_of::<Figure>(), 32);
        assert_eq!(size_of::<Past>(), 64);
        assert_eq!(size_of::<MovingLight>(), 32);
        assert_eq!(size_of::<Material>(), 32);
        assert_eq!(size_of::<Finish>(), 64);
        assert_eq!(size_of::<Light>(), 64);
        assert_eq!(size_of::<Emitter>(), 32);
        assert_eq!(size_of::<Source>(), 32);
        assert_eq!(size_of::<Sun>(), 32);
        assert_eq!(size_of::<CellNode>(), 32);
        assert_eq!(size_of::<TreeNode>(), 48);
        assert_eq!(size_of::<LightBounds>(), 48);
        assert_eq!(size_of::<CellEntry>(), 16);
        assert_eq!(size_of::<LoggedRay>(), 32);
        assert_eq!(size_of::<Escape>(), 32);
        assert!(
            size_of::<PathTraceParams>() <= 128,
            "push constants every device has"
        );
    }
}
