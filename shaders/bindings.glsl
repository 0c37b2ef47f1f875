// What the ray-tracing stages are given: descriptors, push constants, specialization constants.

#include "abi.glsl"

layout(set = 0, binding = BINDING_TLAS) uniform accelerationStructureEXT tlas;
layout(set = 0, binding = BINDING_TEXTURES) uniform texture2D textures[]; // read texel by texel

layout(push_constant, scalar) uniform PushConstants { PathTraceParams params; };

// Choices made once per pipeline: what the scene lacks costs nothing.
layout(constant_id = 0) const uint ESTIMATOR = ESTIMATOR_MIS;
layout(constant_id = 1) const uint SKY_KIND = SKY_NONE;
layout(constant_id = 2) const bool HAS_EMITTERS = true;
layout(constant_id = 3) const bool HAS_POINT_LIGHTS = true;
layout(constant_id = 4) const bool HAS_LIQUIDS = true;
layout(constant_id = 5) const bool HAS_INSTANCES = true;
layout(constant_id = 6) const bool HAS_FENCES = true;
layout(constant_id = 7) const bool ALL_LAYERS = true;
layout(constant_id = 8) const bool LOG_RAYS = false;
layout(constant_id = 9) const uint SELECTION = SELECTION_POWER;
layout(constant_id = 10) const bool HAS_TRANSLUCENT = true;
layout(constant_id = 11) const bool HAS_SUNS = false;
layout(constant_id = 12) const bool HAS_GLOSS = true;
layout(constant_id = 13) const bool HAS_NORMAL_MAPS = true;
layout(constant_id = 14) const bool HAS_COMPILER_LIGHTS = false;
layout(constant_id = 15) const bool HAS_BAKED_LIGHT = false;
layout(constant_id = 16) const uint CANDIDATES = 1u;
layout(constant_id = 17) const bool SOBOL = false;
layout(constant_id = 18) const bool STYLE_LAYERS = false;
layout(constant_id = 19) const bool HAS_FOG = false;
layout(constant_id = 20) const bool HAS_POSES = true;
layout(constant_id = 21) const bool HAS_SKINS = true;
layout(constant_id = 22) const bool HAS_MASKS = true;
layout(constant_id = 23) const bool HAS_FRAMES = true;
layout(constant_id = 24) const uint CLAMP = 0u; // bits of the most that a sample may add; 0 for no clamp
layout(constant_id = 25) const bool HAS_LENS = true;
layout(constant_id = 26) const bool HAS_SMOOTH_NORMALS = true;
layout(constant_id = 27) const bool HAS_LIGHT_SUMS = false;
