// Fog, which is all over the level: how far light comes in it, and the light that lamps send through it
// along a ray. Needs bindings.glsl, rng.glsl, light.glsl, resampling.glsl, medium.glsl.

// Phase function, even in all directions, and its density.
const float PHASE = 1.0 / (4.0 * PI);
// Places along a ray are chosen towards a point at this distance from the ray at least: nearer than
// light can be.
const float NEAREST_TARGET = 0.5;

// Dimensions of the random numbers that fog uses, beyond those of vertices and interfaces.
const uint DIMENSION_FREE_PATH = 0x20000u;
const uint DIMENSION_AIRLIGHT = 0x30000u;
const uint DIMENSIONS_PER_AIRLIGHT = 3u;

// Share of light that fog leaves over a distance.
float fog_clear(float d) { return HAS_FOG ? exp(-params.scene.at[0].fog_extinction * d) : 1.0; }

// 1 - exp(-x), with its digits where x is small.
float one_minus_exp(float x) {
    return x < 0.01 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}

// -log(1 - x), likewise.
float minus_log_rest(float x) {
    return x < 0.01 ? x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + 0.25 * x))) : -log(1.0 - x);
}

// Distance at which fog stops a ray, by the law of Beer and Lambert: below `end` if it is stopped.
float sample_free_path(float end, float u) {
    return min(end, minus_log_rest(u * one_minus_exp(params.scene.at[0].fog_extinction * end))
                        / params.scene.at[0].fog_extinction);
}

// Density of sample_free_path, per unit.
float pdf_free_path(float end, float d) {
    const float extinction = params.scene.at[0].fog_extinction;
    return extinction * exp(-extinction * d) / one_minus_exp(extinction * end);
}

// Where a light is: places on a ray are chosen as evenly as they are seen from there.
struct Target {
    float along;   // distance along the ray of the place nearest to it
    float height;  // its distance from the ray
    float angle;   // that the ray fills as seen from it; 0 if the light is nowhere, as a sun is
};

const Target NOWHERE = Target(0.0, 0.0, 0.0);

Target target_at(vec3 point, float least, vec3 from, vec3 direction, float end) {
    Target t;
    const vec3 to_point = point - from;
    t.along = dot(to_point, direction);
    t.height = max(length(to_point - t.along * direction), least);
    // The angle between the ways to both ends; as a difference of two it would lose its digits.
    t.angle = atan(t.height * end, t.height * t.height + t.along * (t.along - end));
    return t;
}

// Where a light is, by its number among all; of an emitter the point that u chooses on it.
Target target_of(Entry entry, vec2 u, vec3 from, vec3 direction, float end) {
    const uint chosen = entry.number;
    if (is_sphere_that_moves(entry)) {
        const Light sphere = params.scene.at[0].moving_spheres.at[chosen & ~MOVING_SPHERE];
        return target_at(sphere.position, max(sphere.radius, NEAREST_TARGET), from, direction, end);
    }
    const bool of_instance = HAS_FRAMES && entry.instance != NO_INSTANCE;
    if (of_instance || chosen < params.scene.at[0].emitter_count) {
        Triangle t;
        vec2 b;
        sample_emitter_point(params.scene.at[0].emitters.at[chosen], entry.instance, u, t, b);
        const vec3 point = t.p0 * (1.0 - b.x - b.y) + t.p1 * b.x + t.p2 * b.y;
        return target_at(point, NEAREST_TARGET, from, direction, end);
    }
    if (HAS_SUNS && chosen >= params.scene.at[0].first_sun) return NOWHERE;
    const Light light = params.scene.at[0].lights.at[chosen - params.scene.at[0].emitter_count];
    if (HAS_COMPILER_LIGHTS && light.falloff == FALLOFF_SUN) return NOWHERE;
    return target_at(light.position, max(light.radius, NEAREST_TARGET), from, direction, end);
}

// Equiangular sampling (Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in
// Participating Media", EGSR 2012): a distance along the ray, as dense as one over the squared distance
// to the target.
float sample_equiangular(Target t, float end, float u) {
    const float s = sin(u * t.angle), c = cos(u * t.angle);
    const float squared = t.height * t.height + t.along * t.along;
    return clamp(squared * s / (t.height * c + t.along * s), 0.0, end);
}

float pdf_equiangular(Target t, float d) {
    const float off = d - t.along;
    return t.height / (t.angle * (t.height * t.height + off * off));
}

// A light that shines into the fog along a ray, and where: candidates as at surfaces, of which one is kept.
// Of half of them, the place is chosen as fog stops light, then a light as seen from there; of the others a
// light as seen from the middle of what fog stops, then the place equiangularly towards it. The density
// is that of both ways together. `from` is where the stretch of
// the ray begins, `end` its length; `gain` lacks what absorbs besides the fog, on the way.
ChosenLight choose_airlight(vec3 from, vec3 direction, float end, vec3 throughput, uint pixel, uint index,
                            uint dimension) {
    const float extinction = params.scene.at[0].fog_extinction;
    const vec3 scattered = throughput * params.scene.at[0].fog_albedo * (PHASE * extinction);
    const vec3 middle = from + sample_free_path(end, 0.5) * direction;
    const uint middle_cell = cell_at(middle);
    Reservoir reservoir = empty_reservoir(pixel, index, dimension + 2u);
    for (uint i = 0u; i < CANDIDATES; ++i) {
        const vec4 u = random4(pixel, index * CANDIDATES + i, dimension, params.seed);
        const vec2 v = random4(pixel, index * CANDIDATES + i, dimension + 1u, params.seed).xy;
        // By turns, which neighbours on the device take together; chance decides for one without a partner.
        const bool alone = CANDIDATES % 2u == 1u && i + 1u == CANDIDATES;
        const bool towards = alone ? v.x < 0.5 : i % 2u == 0u;
        float d = sample_free_path(end, v.y);
        vec3 at = middle;
        uint cell = middle_cell;
        if (!towards) {
            at = from + d * direction;
            cell = cell_at(at);
        }
        Entry entry = choose_entry(cell, at, u.xy);
        if (entry.number == NO_EMITTER) continue;
        const Target target = target_of(entry, u.zw, from, direction, end);
        if (towards) {
            if (target.angle > 0.0) d = sample_equiangular(target, end, v.y);
            at = from + d * direction;
            cell = cell_at(at);
        }
        const float in_middle = probability_of(entry, middle_cell, middle);
        const float probability = probability_of(entry, cell, at);
        if (!(probability > 0.0)) continue;
        entry.probability = probability;
        const LightSample light = sample_entry(entry, cell, at, u.zw);
        if (!(max_component(abs(light.emission)) > 0.0)) continue;
        const float pdf_free = pdf_free_path(end, d);
        const float pdf_towards = target.angle > 0.0 ? pdf_equiangular(target, d) : pdf_free;
        const float pdf = 0.5 * (probability * pdf_free
            + in_middle * pdf_towards);
        const float other = ESTIMATOR == ESTIMATOR_MIS && light.hittable ? PHASE : 0.0;
        // The light's own density has the probability of its choice here, in place of that of both ways.
        const float weight = mis_weight(light.pdf, other) / light.pdf * (probability / pdf);
        const vec3 gain = scattered * light.emission * (weight * exp(-extinction * d));
        offer(reservoir, ChosenLight(light.wi, light.t_max, gain, light.sun, light.number, d));
    }
    return kept_of(reservoir);
}
