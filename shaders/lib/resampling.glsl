// One light out of several candidates. Needs bindings.glsl, rng.glsl, light.glsl, bsdf.glsl.

// A light to look at.
struct ChosenLight {
    vec3 wi;     // unit direction to it
    float t_max; // length of the shadow ray
    vec3 gain;   // what it adds to the path's radiance if nothing is between
    bool sun;    // seen where a sky face is the first thing hit
    uint number; // of the point light; NO_EMITTER for others
};

// Resampled importance sampling (Talbot, Cline and Egbert, "Importance Resampling for Global
// Illumination", EGSR 2005): of CANDIDATES light samples one is kept, in proportion to the luminance it
// would add, and stands for the mean of all. One shadow ray is traced instead of many. The weights
// against hitting the light are those of a single candidate: any weights do that both sides know.
// `n` is the face's normal on the viewer's side.
ChosenLight choose_light(uint cell, vec3 from, Bsdf bsdf, vec3 wo, vec3 throughput, vec3 n, uint pixel,
                         uint index, uint dimension) {
    ChosenLight kept = ChosenLight(vec3(0.0), 0.0, vec3(0.0), false, NO_EMITTER);
    float sum = 0.0, of_kept = 0.0;
    float u_keep = CANDIDATES > 1u
        ? random4(pixel, index, dimension + DIMENSION_KEEP, params.seed).x : 0.0;
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
        if (CANDIDATES == 1u) return ChosenLight(light.wi, light.t_max, gain, light.sun, light.number);
        const float target = luminance(abs(gain));
        if (!(target > 0.0)) continue;
        sum += target;
        // One number serves for all decisions: what is left of it is uniform again.
        const float share = target / sum;
        if (u_keep < share) {
            kept = ChosenLight(light.wi, light.t_max, gain, light.sun, light.number);
            of_kept = target;
            u_keep /= share;
        } else {
            u_keep = (u_keep - share) / (1.0 - share);
        }
    }
    if (of_kept > 0.0) kept.gain *= sum / (of_kept * float(CANDIDATES));
    return kept;
}
