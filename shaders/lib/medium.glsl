// What light passes straight through: interfaces, and what absorbs between them. Needs bindings.glsl,
// math.glsl, rng.glsl.

// What can happen to a path at an interface.
const uint PAINT = 0u;   // it meets the painted part, which scatters as any surface
const uint REFLECT = 1u; // it is mirrored
const uint PASS = 2u;    // it goes straight on

// Straight passages between two vertices at most: a path that needs more ends.
const uint MAX_PASSAGES = 256u;

// Dimensions of the random numbers that decide at interfaces, beyond those of vertices.
const uint DIMENSION_INTERFACE = 0x10000u;

// Absorption along a straight ray.
struct Medium {
    vec3 absorption; // where the ray is, per world unit
    vec3 passed;     // optical depth, less what `absorption` would give from the ray's origin on
};

Finish finish_of(uint instance_word, uint triangle) {
    return params.scene.at[0].finishes.at[material_of(instance_word, triangle)];
}

// In the space at the eye.
Medium medium_at_eye() {
    Medium m = Medium(vec3(0.0), vec3(0.0));
    if (HAS_TRANSLUCENT && params.medium != NO_MEDIUM) {
        m.absorption = params.scene.at[0].finishes.at[params.medium].absorption;
    }
    return m;
}

// A new ray begins where the last one ended.
void restart(inout Medium m) { m = Medium(max(m.absorption, 0.0), vec3(0.0)); }

// The ray passes an interface at distance t.
void pass_through(inout Medium m, vec3 absorption, bool front, float t) {
    const vec3 change = front ? absorption : -absorption;
    m.absorption += change;
    m.passed -= change * t;
}

// What is left of light that comes from distance t along the ray. Surfaces that enclose nothing could
// add up to less than no depth: that counts as none.
vec3 transmittance(Medium m, float t) { return exp(-max(m.absorption * t + m.passed, 0.0)); }

// Share of unpolarised light that a smooth interface of relative index eta >= 1 reflects, met from the
// side of the lower index: Fresnel's equations.
float fresnel_dielectric(float cos_i, float eta) {
    const float c = clamp(cos_i, 0.0, 1.0);
    const float t = sqrt(max(0.0, 1.0 - (1.0 - c * c) / (eta * eta)));
    const float perpendicular = c + eta * t, parallel = eta * c + t;
    // Grazing, with nothing to refract: an index of 1 reflects nothing.
    if (!(perpendicular > 0.0)) return eta > 1.0 ? 1.0 : 0.0;
    const float s = (c - eta * t) / perpendicular;
    const float p = (eta * c - t) / parallel;
    return 0.5 * (s * s + p * p);
}

// What an interface lets pass straight on, its tint included.
vec3 eval_passage(Finish f, float cos_i) {
    return f.tint * ((1.0 - f.alpha) * (1.0 - fresnel_dielectric(cos_i, f.ior)));
}

// Chooses what happens at an interface, with the probabilities of the shares of light.
uint sample_interface(Finish f, float cos_i, float u) {
    if (u < f.alpha) return PAINT;
    return u < mix(f.alpha, 1.0, fresnel_dielectric(cos_i, f.ior)) ? REFLECT : PASS;
}
