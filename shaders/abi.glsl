// Generated from crates/rt/src/abi.rs by `cargo xtask abi`; do not edit.

#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require

// Descriptor binding of the top-level acceleration structure.
const uint BINDING_TLAS = 0u;
// Descriptor binding of the array of all textures.
const uint BINDING_TEXTURES = 1u;
// Estimator: direction = normal + point on unit sphere, light by hitting it.
const uint ESTIMATOR_NAIVE = 0u;
// Estimator: uniform hemisphere, light by hitting it.
const uint ESTIMATOR_UNIFORM = 1u;
// Estimator: light sampling alone.
const uint ESTIMATOR_NEE = 2u;
// Estimator: light sampling and hits, weighted.
const uint ESTIMATOR_MIS = 3u;
// Selection: by the alias table over estimated powers.
const uint SELECTION_POWER = 0u;
// Selection: every entry of the table alike.
const uint SELECTION_UNIFORM = 1u;
// Selection: by the list of the cell a point lies in.
const uint SELECTION_LEAF = 2u;
// Lights that are weighed by a guess, per candidate of other selections.
const uint GUESSES_PER_CANDIDATE = 4u;
// Shine of a light: to the front of a plane.
const uint SHINE_FRONT = 0u;
// To both sides of a plane.
const uint SHINE_BOTH_SIDES = 1u;
// Everywhere alike.
const uint SHINE_ALL_ROUND = 2u;
// In a cone.
const uint SHINE_CONE = 3u;
// From far away.
const uint SHINE_DISTANT = 4u;
// Selection: by the tree over all lights.
const uint SELECTION_TREE = 3u;
// Flag of a tree node's child: a light, not a node.
const uint LEAF = 2147483648u;
// Trail of a light that is not in the tree.
const uint NO_TRAIL = 4294967295u;
// Flag of a cell node's child: a cell, not a node.
const uint CELL = 2147483648u;
// Number of the emitter or source where there is none.
const uint NO_EMITTER = 4294967295u;
// Map of an emitter that is a part of a triangle.
const uint NO_MAP = 4294967295u;
// Escapes that are kept; the rest is only counted.
const uint ESCAPES_KEPT = 100u;
// Material flag: emits to both sides.
const uint MATERIAL_TWO_SIDED = 2u;
// Material flag: liquid warp; texture coordinates are world units.
const uint MATERIAL_WARPED = 4u;
// Material flag: shows the sky and ends the path.
const uint MATERIAL_SKY = 8u;
// Material flag: has an emission texture.
const uint MATERIAL_EMISSIVE = 16u;
// Material flag: light passes straight through, in part; see its finish.
const uint MATERIAL_TRANSLUCENT = 32u;
// Material flag: gloss over the painted part; see its finish.
const uint MATERIAL_GLOSSY = 64u;
// Material flag: has a picture of its normals.
const uint MATERIAL_BUMPED = 128u;
// Number of a texture that is not there.
const uint NO_TEXTURE = 4294967295u;
// Rows and columns of the gloss table.
const uint GLOSS_TABLE_SIDE = 40u;
// Number of a material that stands for free space.
const uint NO_MEDIUM = 4294967295u;
// Falloff of a compiler light: `max(0, 1 - scale d)`.
const uint FALLOFF_LINEAR = 0u;
// Falloff: `K / (scale d)`, with K = 128.
const uint FALLOFF_INVERSE = 1u;
// Falloff: `(K / (scale d))^2`.
const uint FALLOFF_INVERSE_SQUARE = 2u;
// Falloff: `(K / (scale d + K))^2`.
const uint FALLOFF_SHIFTED = 3u;
// Falloff: none.
const uint FALLOFF_CONSTANT = 4u;
// Falloff: none, from the sky against the light's direction.
const uint FALLOFF_SUN = 5u;
// The same at any distance, from either side, as the least that there is.
const uint FALLOFF_LEAST = 6u;
// Sky kinds: none, the same everywhere, two scrolling layers, six sides.
const uint SKY_NONE = 0u;
// See `SKY_NONE`.
const uint SKY_FLAT = 1u;
// See `SKY_NONE`.
const uint SKY_SCROLLING = 2u;
// See `SKY_NONE`.
const uint SKY_BOX = 3u;
// Film plane: sum of radiance rgb, number of samples.
const uint PLANE_BEAUTY = 0u;
// Film plane: sum of squared deviations from the mean rgb (Welford), face id + 1.
const uint PLANE_DEVIATION = 1u;
// Film plane: compensation of the radiance sum rgb (Kahan), sum of depth.
const uint PLANE_COMPENSATION = 2u;
// Number of film planes that are always there.
const uint PLANES_BASIC = 3u;
// Film plane: sum of emission seen directly, sum of motion to the right.
const uint PLANE_EMISSION = 3u;
// Film plane: sum of light reflected once, sum of motion down.
const uint PLANE_DIRECT = 4u;
// Film plane: sum of light reflected more than once.
const uint PLANE_INDIRECT = 5u;
// Film plane: sum of first-hit albedo.
const uint PLANE_ALBEDO = 6u;
// Film plane: sum of first-hit normals.
const uint PLANE_NORMAL = 7u;
// Film plane: sum of first-hit positions.
const uint PLANE_POSITION = 8u;
// Number of film planes with all layers. Sums of light by light style follow, from the second
// one on.
const uint PLANES_ALL = 9u;
// Hit payload: no triangle was hit.
const uint MISS = 4294967295u;
// Custom index of an instance: bits of its number.
const uint INSTANCE_INDEX = 2097151u;
// Custom index of an instance, flag: only the camera sees it.
const uint INSTANCE_APART = 2097152u;
// Custom index of an instance, flag: its corners are those of a pose.
const uint INSTANCE_POSED = 4194304u;
// Custom index of an instance, flag: its transform is not the identity.
const uint INSTANCE_PLACED = 8388608u;
// Mask of what rays from the camera meet.
const uint MASK_CAMERA = 1u;
// Mask of what rays from surfaces meet.
const uint MASK_OTHERS = 2u;
// Mask of what rays from surfaces meet that only the camera sees.
const uint MASK_APART = 4u;
// Mask of what all rays meet.
const uint MASK_ALL = 7u;
// Skin of an instance that shows its mesh's own materials.
const uint NO_SKIN = 4294967295u;
// Flag of a past: the instance moved.
const uint PAST_MOVED = 1u;
// Flag of a past: its corners are those of a pose.
const uint PAST_POSED = 2u;
// Flag of a past: its corners are those of loose triangles, world space.
const uint PAST_LOOSE = 4u;
// Instance of a moving light that is a sphere, and of lights that do not move.
const uint NO_INSTANCE = 4294967295u;
// Hit payload, flag beside the custom index: the triangle was seen from the front.
const uint HIT_FRONT = 2147483648u;
// Kind of a logged ray: end of the pixel's list.
const uint RAY_NONE = 0u;
// Kind of a logged ray: camera or bounce ray.
const uint RAY_PATH = 1u;
// Kind of a logged ray: shadow ray.
const uint RAY_SHADOW = 2u;

layout(buffer_reference) buffer TriangleRef;
layout(buffer_reference) buffer InstanceRef;
layout(buffer_reference) buffer FigureRef;
layout(buffer_reference) buffer PastRef;
layout(buffer_reference) buffer CornerRef;
layout(buffer_reference) buffer MovingLightRef;
layout(buffer_reference) buffer MaterialRef;
layout(buffer_reference) buffer FinishRef;
layout(buffer_reference) buffer EmitterRef;
layout(buffer_reference) buffer SourceRef;
layout(buffer_reference) buffer EmissionMapRef;
layout(buffer_reference) buffer GlossTableRef;
layout(buffer_reference) buffer AliasRef;
layout(buffer_reference) buffer TreeNodeRef;
layout(buffer_reference) buffer LightBoundsRef;
layout(buffer_reference) buffer CellNodeRef;
layout(buffer_reference) buffer CellRef;
layout(buffer_reference) buffer CellEntryRef;
layout(buffer_reference) buffer NumberRef;
layout(buffer_reference) buffer BakedTriangleRef;
layout(buffer_reference) buffer BakedSampleRef;
layout(buffer_reference) buffer LightRef;
layout(buffer_reference) buffer StyleOfLightRef;
layout(buffer_reference) buffer StyleSumRef;
layout(buffer_reference) buffer SunRef;
layout(buffer_reference) buffer SceneRef;
layout(buffer_reference) buffer FilmRef;
layout(buffer_reference) buffer TalliesRef;
layout(buffer_reference) buffer CountersRef;
layout(buffer_reference) buffer EscapesRef;
layout(buffer_reference) buffer ScheduleRef;
layout(buffer_reference) buffer RayRef;

// One triangle with all that shading needs.
struct Triangle {
    // Corner, local space (world space for those that emit).
    vec3 p0;
    // Material index.
    uint material;
    // Corner.
    vec3 p1;
    // Number of the level's face.
    uint face;
    // Corner.
    vec3 p2;
    // Unit normal to the front, same space as the corners.
    vec3 normal;
    // Texture coordinates of p0, texels.
    vec2 uv0;
    // Texture coordinates of p1, texels.
    vec2 uv1;
    // Texture coordinates of p2, texels.
    vec2 uv2;
};

// A placed mesh.
struct Instance {
    // Local to world, rows of a 3 x 4 matrix.
    vec4 row0;
    // Second row.
    vec4 row1;
    // Third row.
    vec4 row2;
    // Index of the mesh's first opaque triangle.
    uint opaque_base;
    // Index of the mesh's first alpha-tested triangle.
    uint alpha_base;
    // Added to a triangle's index, where its number among the sources stands.
    uint source_offset;
    // Unused, keeps the size a multiple of 16 bytes.
    uint padding;
};

// What an instance has besides its place.
struct Figure {
    // Material that stands for those of its mesh, or NO_SKIN.
    uint skin;
    // Added to a triangle's index, a third of where its corners stand.
    uint posed;
    // Probability with which light sampling chooses it, of instances that move.
    float probability;
    // 1 if its facets are shaded as round.
    uint smooth_shaded;
    // Added to a triangle's index, a third of where its normals stand in the one pose.
    uint normals_from;
    // The same in the other pose.
    uint normals_to;
    // How far it is from the one to the other.
    float fraction;
    // Unused, keeps the size a multiple of 16 bytes.
    uint padding;
};

// Where an instance was in the picture before.
struct Past {
    // Local to world, rows of a 3 x 4 matrix.
    vec4 row0;
    // Second row.
    vec4 row1;
    // Third row.
    vec4 row2;
    // Added to a triangle's index, a third of where its corners stood.
    uint posed;
    // PAST_ flags.
    uint flags;
    // Unused, keeps the size a multiple of 16 bytes.
    uvec2 padding;
};

// What emits and moves: a sphere, or an instance.
struct MovingLight {
    // Custom index of the instance; NO_INSTANCE of a sphere.
    uint instance;
    // Number of its mesh's first emitter, or of the sphere.
    uint first;
    // Emitters of its mesh.
    uint count;
    // Where the alias table over these begins.
    uint alias;
    // Probability with which light sampling chooses it.
    float probability;
    // Alias table over all that moves: probability to keep this entry.
    float keep;
    // The entry to take otherwise.
    uint other;
    // Unused, keeps the size a multiple of 16 bytes.
    uint padding;
};

// What a surface looks like.
struct Material {
    // Index of the base texture.
    uint base;
    // Index of the emission texture, valid if MATERIAL_EMISSIVE.
    uint emission;
    // Radiance of a white emission texel.
    float emission_scale;
    // Mean luminance of the emitted radiance; 0 if nothing is chosen as a light.
    float emission_weight;
    // MATERIAL_ flags.
    uint flags;
    // Texture width in texels.
    uint width;
    // Texture height in texels.
    uint height;
    // Unused, keeps the size a multiple of 16 bytes.
    uint padding;
};

// Texels of a face, or a part of a triangle, that can be chosen as a light.
struct Emitter {
    // First of the sources it lies on.
    uint first_source;
    // How many.
    uint sources;
    // Its map, or NO_MAP for a part of a triangle.
    uint map;
    // Probability with which the alias table chooses it.
    float probability;
    // Texels x0 | y0 << 16, x1 | y1 << 16; of a part, divisions and 1 for an upper half.
    uvec2 rectangle;
    // Texture coordinates of its tile; of a part, column and row.
    vec2 origin;
};

// How the emitters of a triangle are numbered.
struct Source {
    // Its map, or NO_MAP for parts.
    uint map;
    // Where its numbers begin; of parts, the first emitter.
    uint first;
    // First tile.
    vec2 first_tile;
    // Tiles along each axis; of parts, divisions.
    uvec2 tiles;
    // Unused, keeps the size a multiple of 16 bytes.
    uvec2 padding;
};

// The emitting texels of a texture.
struct EmissionMap {
    // Where its sums begin among the texel tables.
    uint sums;
    // Where its labels begin.
    uint labels;
    // Rectangles.
    uint rectangles;
    // Texels across.
    uint width;
    // Texels down.
    uint height;
};

// What a surface is besides an opaque Lambertian reflector.
struct Finish {
    // What of the light that passes the interface is left.
    vec3 tint;
    // Coverage with paint.
    float alpha;
    // Absorption behind the front, per world unit.
    vec3 absorption;
    // Index of refraction of the interface.
    float ior;
    // Roughness of the gloss.
    float roughness;
    // Share of metal.
    float metallic;
    // Reflectance of the rest straight on, over 0.08.
    float specular;
    // Texture whose red scales the roughness, or NO_TEXTURE.
    uint roughness_map;
    // Texture of normals, or NO_TEXTURE.
    uint normals;
    // Unused, keeps the size a multiple of 16 bytes.
    vec3 padding;
};

// One entry of the alias table.
struct AliasEntry {
    // Probability to keep this entry.
    float keep;
    // The entry to take otherwise.
    uint other;
};

// A group of lights.
struct TreeNode {
    // Middle of its bounds, world space.
    vec3 centre;
    // Squared distance from there to a corner.
    float radius2;
    // Axis of the cone of directions that its lights face.
    vec3 axis;
    // Cosine of the cone's half angle; -1 if some light shines to all sides.
    float cos_cone;
    // Sum of the weights.
    float weight;
    // The second child (the first one is the next node), or a light with the flag LEAF.
    uint child;
    // Unused, keeps the size a multiple of 16 bytes.
    uvec2 padding;
};

// A light as seen from afar.
struct LightBounds {
    // Middle, world space.
    vec3 centre;
    // Distance from there that no point of it exceeds; sine of a distant light's angular radius.
    float radius;
    // Normal, direction of the cone, or direction to a distant light.
    vec3 axis;
    // Luminance of the irradiance it gives straight on, at distance 1.
    float weight;
    // Cosine of half the inner cone.
    float cos_inner;
    // Cosine of half the outer cone.
    float cos_outer;
    // SHINE_.
    uint shine;
    // Probability with which the alias table chooses it.
    float probability;
};

// A split of space by a plane.
struct CellNode {
    // Unit normal.
    vec3 normal;
    // Distance of the plane from the origin.
    float distance;
    // Where points in front of the plane go: a node, or a cell with the flag CELL.
    uint front;
    // Where the other points go.
    uint back;
    // Unused, keeps the size a multiple of 16 bytes.
    uvec2 padding;
};

// A cell's part of the lists.
struct Cell {
    // First entry.
    uint begin;
    // Number of entries.
    uint count;
};

// A light in a cell's list, which rises by emitter.
struct CellEntry {
    // Number of the emitter.
    uint emitter;
    // Probability with which the list chooses it.
    float probability;
    // Alias table of the list: probability to keep this entry.
    float keep;
    // The entry to take otherwise, counted within the list.
    uint other;
};

// Where a triangle's samples of baked light are.
struct BakedTriangle {
    // Index of the first sample.
    uint first;
    // Luxels across.
    uint width;
    // Luxels down.
    uint height;
    // Luxel coordinates of p0.
    vec2 uv0;
    // Luxel coordinates of p1.
    vec2 uv1;
    // Luxel coordinates of p2.
    vec2 uv2;
};

// A point light: an invisible sphere, or a compiler light.
struct Light {
    // Centre, world space.
    vec3 position;
    // Radius.
    float radius;
    // Radiant intensity; irradiance of a compiler light.
    vec3 intensity;
    // Probability with which the alias table chooses it.
    float probability;
    // Direction of the cone, or of a sun's light.
    vec3 direction;
    // Cosine of half the inner cone.
    float cos_inner;
    // Cosine of half the outer cone; below -1 if there is no cone.
    float cos_outer;
    // FALLOFF_ of a compiler light.
    uint falloff;
    // Its factor of the distance.
    float falloff_scale;
    // Its share of the cosine.
    float angle_scale;
};

// Which light style a point light shines in.
struct StyleOfLight {
    // Number of its film plane from 1; 0 if it has none.
    uint plane;
    // Brightness of the style; 1 if it has no plane.
    float brightness;
};

// The compiler lights of a style, where not all add up.
struct StyleSum {
    // Least irradiance of all surfaces.
    vec3 least;
    // Brightness that is in it and in the lights.
    float brightness;
    // First point light: those that add, then those of FALLOFF_LEAST, then negative ones.
    uint first;
    // Point lights.
    uint count;
};

// A sun: a disc in the sky.
struct Sun {
    // Unit direction to its middle.
    vec3 direction;
    // 1 - cos of its angular radius.
    float one_minus_cos;
    // Radiance.
    vec3 radiance;
    // Probability with which the alias table chooses it.
    float probability;
};

// Everything a shader reads of the scene.
struct SceneData {
    // Triangles of all meshes.
    TriangleRef triangles;
    // Instances.
    InstanceRef instances;
    // What they have besides their place.
    FigureRef figures;
    // Where they were, if `has_before`.
    PastRef pasts;
    // Corners of triangles in poses.
    CornerRef posed_corners;
    // Where the corners of loose triangles were, if they moved.
    CornerRef loose_corners;
    // Normals of triangles' corners in poses, octahedral coordinates.
    NumberRef normals;
    // What emits and moves.
    MovingLightRef moving_lights;
    // Spheres among it.
    LightRef moving_spheres;
    // Triangles of the sources, as numbers among all.
    NumberRef source_indices;
    // Materials.
    MaterialRef materials;
    // Finishes.
    FinishRef finishes;
    // Gloss table.
    GlossTableRef gloss_table;
    // Emitters.
    EmitterRef emitters;
    // Triangles they lie on.
    SourceRef sources;
    // The same triangles, world space.
    TriangleRef source_triangles;
    // Emission textures.
    EmissionMapRef maps;
    // Sums and labels of their texels.
    NumberRef texel_tables;
    // Emitter numbers by place.
    NumberRef emitter_numbers;
    // Source numbers by triangle of each instance.
    NumberRef source_numbers;
    // Alias table.
    AliasRef alias;
    // Point lights.
    LightRef lights;
    // Tree over all lights.
    TreeNodeRef tree;
    // The way down to each light, second children as bits from the lowest.
    NumberRef trails;
    // All lights as seen from afar.
    LightBoundsRef light_bounds;
    // Suns.
    SunRef suns;
    // Light styles of the point lights.
    StyleOfLightRef light_styles;
    // Sums of compiler lights, then one for each material whose `least` stands for that of the first.
    StyleSumRef style_sums;
    // Grids of baked light.
    BakedTriangleRef baked;
    // Samples of baked light.
    BakedSampleRef baked_samples;
    // Splits of space into cells.
    CellNodeRef cell_nodes;
    // Cells.
    CellRef cells;
    // Lists of the cells.
    CellEntryRef cell_entries;
    // Number of emitters: entries of the alias table below it are emitters.
    uint emitter_count;
    // Entries of the alias table.
    uint entry_count;
    // Number of suns.
    uint sun_count;
    // Emitter number of the first sun.
    uint first_sun;
    // Factor of the sky's picture in directions that look up.
    vec3 sky_upper;
    // Factor in those that look down.
    vec3 sky_lower;
    // Radiance of fog before its upper half.
    vec3 veil_upper;
    // Radiance of fog before its lower half.
    vec3 veil_lower;
    // Radiance of a flat sky.
    vec3 sky_radiance;
    // Texture of the back layer, or the first of a skybox's six.
    uint sky_back;
    // Texture of the front layer.
    uint sky_front;
    // Probability with which the table over all emitters chooses, whatever a cell lists.
    float cell_fallback;
    // Share of the light that fog scatters, of what it takes.
    vec3 fog_albedo;
    // Share of light that fog takes, per world unit.
    float fog_extinction;
    // Probability with which something that moves is chosen instead of the scene's own lights.
    float moving_share;
    // Number of what emits and moves.
    uint moving_count;
    // Triangles with grids of baked light.
    uint baked_count;
    // Number of sums of compiler lights.
    uint sum_count;
    // Gamma of the lightmaps that they stand for.
    float light_gamma;
    // 1 if there was a picture before.
    uint has_before;
    // Its eye, world space.
    vec3 before_origin;
    // Its unit view direction.
    vec3 before_forward;
    // To the right edge of its image plane.
    vec3 before_right;
    // To the upper edge.
    vec3 before_up;
};

// Where things are counted.
struct Tallies {
    // The counters.
    CountersRef counters;
    // Where rays that hit nothing are kept.
    EscapesRef escapes;
};

// Numbers counted by the shaders, as low and high words.
struct Counters {
    // Rays traced.
    uvec2 rays;
    // Samples that were not finite.
    uvec2 nonfinite;
    // Camera and bounce rays that hit nothing.
    uvec2 escaped;
};

// A camera or bounce ray that hit nothing.
struct Escape {
    // Origin, world space.
    vec3 origin;
    // The pixel's number.
    uint pixel;
    // Unit direction.
    vec3 direction;
    // The pixel's sample it belongs to.
    uint sample_index;
};

// One ray as it was traced.
struct LoggedRay {
    // Origin, world space.
    vec3 origin;
    // Where it ends.
    float t_max;
    // Unit direction.
    vec3 direction;
    // RAY_NONE, RAY_PATH or RAY_SHADOW.
    uint kind;
};

// Push constants of the path tracer.
struct PathTraceParams {
    // The scene.
    SceneRef scene;
    // The film.
    FilmRef film;
    // Where things are counted.
    TalliesRef tallies;
    // Where rays are logged, if they are.
    RayRef ray_log;
    // Samples to add by pixel, read if `sample_count` is 0.
    ScheduleRef schedule;
    // Eye, world space.
    vec3 origin;
    // Level time, seconds.
    float time;
    // Unit view direction.
    vec3 forward;
    // Longest ray the level needs.
    float t_max;
    // To the right edge of the image plane.
    vec3 right;
    // Path vertices, 0 for unlimited.
    uint depth;
    // To the upper edge of the image plane.
    vec3 up;
    // Samples to add to every pixel; 0 to read each pixel's from `schedule`.
    uint sample_count;
    // Seed.
    uvec2 seed;
    // Rays logged per pixel at most.
    uint ray_log_length;
    // Material whose absorption fills the space at the eye, or NO_MEDIUM.
    uint medium;
    // Radius of the lens.
    float lens_radius;
    // Distance of the plane of focus along the view direction.
    float focus;
};

// Triangles of all meshes, or those that emit in world space.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer TriangleRef {
    Triangle at[];
};

// Instances, by custom index.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer InstanceRef {
    Instance at[];
};

// Figures, by custom index.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer FigureRef {
    Figure at[];
};

// Where instances were, by custom index.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer PastRef {
    Past at[];
};

// Corners of triangles in poses, local space.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CornerRef {
    vec3 at[];
};

// Lights that move.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer MovingLightRef {
    MovingLight at[];
};

// Materials, by material id.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer MaterialRef {
    Material at[];
};

// Finishes, by material id.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer FinishRef {
    Finish at[];
};

// Emitters: those of the scene, then those of each mesh that moves.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer EmitterRef {
    Emitter at[];
};

// Triangles that emit.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer SourceRef {
    Source at[];
};

// Emission textures.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer EmissionMapRef {
    EmissionMap at[];
};

// What one reflection by microfacets gives back, as factor and summand of the
// reflectance straight on; by roughness, then by root of the cosine.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer GlossTableRef {
    vec2 at[];
};

// Alias table over emitters, then point lights, then suns.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer AliasRef {
    AliasEntry at[];
};

// Nodes of the tree over all lights, the root first.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer TreeNodeRef {
    TreeNode at[];
};

// What all lights look like from afar, in the order of the alias table.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightBoundsRef {
    LightBounds at[];
};

// Splits of space into cells, the root first.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer CellNodeRef {
    CellNode at[];
};

// Cells.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer CellRef {
    Cell at[];
};

// Lists of the cells, one after the other.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer CellEntryRef {
    CellEntry at[];
};

// Numbers of emitters or sources, sums and labels of texels.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer NumberRef {
    uint at[];
};

// Grids of baked light, by triangle of all meshes.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BakedTriangleRef {
    BakedTriangle at[];
};

// Samples of baked light.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BakedSampleRef {
    vec3 at[];
};

// Point lights.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightRef {
    Light at[];
};

// Light styles of the point lights.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer StyleOfLightRef {
    StyleOfLight at[];
};

// Sums of compiler lights.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer StyleSumRef {
    StyleSum at[];
};

// Suns.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer SunRef {
    Sun at[];
};

// The scene (one element).
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer SceneRef {
    SceneData at[];
};

// Film planes of width * height elements each, one after the other.
layout(buffer_reference, scalar, buffer_reference_align = 16) restrict buffer FilmRef {
    vec4 at[];
};

// Where things are counted (one element).
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer TalliesRef {
    Tallies at[];
};

// Counters (one element).
layout(buffer_reference, scalar, buffer_reference_align = 8) restrict buffer CountersRef {
    Counters at[];
};

// Rays that hit nothing, ESCAPES_KEPT elements.
layout(buffer_reference, scalar, buffer_reference_align = 16) restrict buffer EscapesRef {
    Escape at[];
};

// Samples to add to each pixel.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer ScheduleRef {
    uint at[];
};

// Logged rays: width * height rays of every pixel's first ray, then of the second, ...
layout(buffer_reference, scalar, buffer_reference_align = 16) restrict buffer RayRef {
    LoggedRay at[];
};
