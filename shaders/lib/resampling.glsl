// One light out of several candidates. Needs bindings.glsl, rng.glsl, light.glsl, bsdf.glsl.

// A light to look at.
struct ChosenLight {
    vec3 wi;     // unit direction to it
    float t_max; // length of the shadow ray
    vec3 gain;   // what it adds to the path's radiance if nothing is between
    bool sun;    // seen where a sky face is the first thing hit
    uint number; // of the point light; NO_EMITTER for others
    float along; // where it is scattered in fog: distance along the ray
};

const ChosenLight NO_LIGHT = ChosenLight(vec3(0.0), 0.0, vec3(0.0), false, NO_EMITTER, 0.0);

// Resampled importance sampling (Talbot, Cline and Egbert, "Importance Resampling for Global
// Illumination", EGSR 2005): of CANDIDATES light samples one is kept, in proportion to the luminance it
// would add, and stands for the mean of all. One shadow ray is traced instead of many.
struct Reservoir {
    ChosenLight kept;
    float sum, of_kept;
    float u; // decides what is kept
};

Reservoir empty_reservoir(uint pixel, uint index, uint dimension) {
    const float u = CANDIDATES > 1u ? random4(pixel, index, dimension, params.seed).x : 0.0;
    return Reservoir(NO_LIGHT, 0.0, 0.0, u);
}

void offer(inout Reservoir r, ChosenLight light) {
    if (CANDIDATES == 1u) {
        r.kept = light;
        return;
    }
    const float target = luminance(abs(light.gain));
    if (!(target > 0.0)) return;
    r.sum += target;
    // One number serves for all decisions: what is left of it is uniform again.
    const float share = target / r.sum;
    if (r.u < share) {
        r.kept = light;
        r.of_kept = target;
        r.u /= share;
    } else {
        r.u = (r.u - share) / (1.0 - share);
    }
}

ChosenLight kept_of(Reservoir r) {
    if (CANDIDATES > 1u && r.of_kept > 0.0) r.kept.gain *= r.sum / (r.of_kept * float(CANDIDATES));
    return r.kept;
}

// A light that shines on a surface. The weights against hitting it are those of a single candidate:
// any weights do that both sides know. `n` is the face's normal on the viewer's side.
ChosenLight choose_light(uint cell, vec3 from, Bsdf bsdf, vec3 wo, vec3 throughput, vec3 n, uint pixel,
                         uint index, uint dimension) {
    Reservoir reservoir = empty_reservoir(pixel, index, dimension + DIMENSION_KEEP);
    for (uint i = 0u; i < CANDIDATES; ++i) {
        // The candidates of all samples are one sequence: they are spread out among themselves, too.
        const vec4 u = random4(pixel, index * CANDIDATES + i, dimension + DIMENSION_LIGHT, params.seed);
        const LightSample light = sample_light(cell, from, u);
        const float cos_i = dot(n, light.wi);
        if (!(max_component(abs(light.emission)) > 0.0 && cos_i > 0.0)) continue;
        const float other = ESTIMATOR == ESTIMATOR_MIS && light.hittable
            ? pdf_bsdf(bsdf, wo, light.wi) : 0.0;
        const vec3 gain = throughput * eval_bsdf(bsdf, wo, light.wi) * light.emission
            * (cosine_factor(light, cos_i) * mis_weight(light.pdf, other) / light.pdf);
        offer(reservoir, ChosenLight(light.wi, light.t_max, gain, light.sun, light.number, 0.0));
    }
    return kept_of(reservoir);
}
