// Random numbers by counter: no state to keep, no period to wrap. Needs bindings.glsl.
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

// Dimensions of one path sample: a set of four numbers each. Those of a vertex come after the
// vertex's number times DIMENSIONS_PER_VERTEX.
const uint DIMENSIONS_PER_VERTEX = 3u;
const uint DIMENSION_CAMERA = 0u; // point in the pixel (xy), point on the lens (zw)
const uint DIMENSION_BSDF = 0u;   // of a vertex: direction (xy), Russian roulette (z)
const uint DIMENSION_KEEP = 1u;   // of a vertex: which candidate is kept (x)
const uint DIMENSION_LIGHT = 2u;  // of a vertex, numbered by candidate: which light (xy), point on it (zw)

// Scrambles the digits of a number whose bits stand reversed, so that what happens to a digit depends
// on those before it alone (Owen 1995), by a hash that carries only upwards (Laine and Karras 2011,
// with Vegdahl's constants of 2021).
uint scramble_reversed(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Pascal's triangle modulo 2 times a number: the second dimension of Sobol's sequence before its bits
// are reversed, as the first is the number itself.
uint pascal(uint x) {
    x ^= (x & 0xffff0000u) >> 16u;
    x ^= (x & 0xff00ff00u) >> 8u;
    x ^= (x & 0xf0f0f0f0u) >> 4u;
    x ^= (x & 0xccccccccu) >> 2u;
    x ^= (x & 0xaaaaaaaau) >> 1u;
    return x;
}

// Point number `index` of a two-dimensional sequence of Sobol', shuffled and scrambled by three seeds
// (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020).
uvec2 sobol2(uint index, uvec3 seeds) {
    const uint shuffled = bitfieldReverse(scramble_reversed(bitfieldReverse(index), seeds.x));
    return bitfieldReverse(uvec2(scramble_reversed(shuffled, seeds.y),
                                 scramble_reversed(pascal(shuffled), seeds.z)));
}

// Four numbers in [0, 1) with 24 bits each. Of Sobol' points, two pairs that each fill their square
// evenly over the samples of the pixel, and know nothing of each other.
vec4 random4(uint pixel, uint sample_index, uint dimension, uvec2 seed) {
    uvec4 bits;
    if (SOBOL) {
        const uvec4 a = pcg4d(uvec4(pixel, 0x5eed0001u, dimension + seed.y * 0x9e3779b9u, seed.x));
        const uvec4 b = pcg4d(a);
        bits = uvec4(sobol2(sample_index, a.xyz), sobol2(sample_index, uvec3(a.w, b.xy)));
    } else {
        bits = pcg4d(uvec4(pixel, sample_index, dimension + seed.y * 0x9e3779b9u, seed.x));
    }
    return vec4(bits >> 8u) * (1.0 / 16777216.0);
}
