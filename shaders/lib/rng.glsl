// Random numbers by counter: no state to keep, no period to wrap.
//
// pcg4d (Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020) of pixel, sample,
// dimension and seed gives four independent 32-bit numbers per call.

uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Dimensions of one path sample: a set of four numbers each.
const uint DIMENSION_CAMERA = 0u; // point in the pixel
const uint DIMENSION_BSDF = 1u;   // direction (xy), Russian roulette (z); plus 2 per vertex
const uint DIMENSION_LIGHT = 2u;  // choice of the light (xy), point on it (zw); plus 2 per vertex

// Four numbers in [0, 1) with 24 bits each.
vec4 random4(uint pixel, uint sample_index, uint dimension, uvec2 seed) {
    const uvec4 bits = pcg4d(uvec4(pixel, sample_index, dimension + seed.y * 0x9e3779b9u, seed.x));
    return vec4(bits >> 8u) * (1.0 / 16777216.0);
}
