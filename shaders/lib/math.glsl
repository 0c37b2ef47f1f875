// Small helpers shared by everything.

const float PI = 3.14159265358979;

float luminance(vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }

float max_component(vec3 v) { return max(v.x, max(v.y, v.z)); }

// sRGB decoding (IEC 61966-2-1), exact: a sampler's own decoding may be off by half a code.
vec3 srgb_to_linear(vec3 c) {
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

// False for infinities and NaN. Tests the bits: a compiler may assume arithmetic to be finite.
bool is_finite(vec3 v) {
    const uvec3 exponent = floatBitsToUint(v) & 0x7f800000u;
    return all(notEqual(exponent, uvec3(0x7f800000u)));
}
