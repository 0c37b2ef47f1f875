// One light out of several candidates. Needs bindings.glsl, rng.glsl, light.glsl, light_bounds.glsl, bsdf.glsl.

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

// Lights that are taken from a cell's list, to be weighed against each other.
const uint LISTED = CANDIDATES * GUESSES_PER_CANDIDATE - 1u;

// Resampled importance sampling (Talbot, Cline and Egbert, "Importance Resampling for Global
// Illumination", EGSR 2005): of several light samples one is kept, in proportion to the luminance it
// would add, and stands for the mean of all. One shadow ray is traced instead of many.
struct Reservoir {
    ChosenLight kept;
    float sum, of_kept;
    float count; // of candidates, offered or worth nothing
    float u;     // decides what is kept
};

// Whether a candidate with this share of the sum takes the place of the one before. One number serves for all
// decisions: what is left of it is uniform again.
bool is_kept(float share, inout float u) {
    const bool kept = u < share;
    u = kept ? u / share : (u - share) / (1.0 - share);
    return kept;
}

Reservoir empty_reservoir(uint pixel, uint index, uint dimension) {
    const float u = CANDIDATES > 1u ? random4(pixel, index, dimension, params.seed).x : 0.0;
    return Reservoir(NO_LIGHT, 0.0, 0.0, float(CANDIDATES), u);
}

void offer(inout Reservoir r, ChosenLight light) {
    if (CANDIDATES == 1u) {
        r.kept = light;
        return;
    }
    const float target = luminance(abs(light.gain));
    if (!(target > 0.0)) return;
    r.sum += target;
    if (is_kept(target / r.sum, r.u)) {
        r.kept = light;
        r.of_kept = target;
    }
}

ChosenLight kept_of(Reservoir r) {
    if (CANDIDATES > 1u && r.of_kept > 0.0) r.kept.gain *= r.sum / (r.of_kept * r.count);
    return r.kept;
}

// One light for a surface with the normal n, by what it may add there, for a cell with a list. LISTED lights
// are taken from the list and one from the table over all; each has the resampling weight m guess / p, which by
// the balance heuristic of both tables is guess / (LISTED p_list + p_all) ("Generalized Resampled Importance
// Sampling", Lin et al. 2022). x chooses all of them, evenly spread: the estimate of each alone is unbiased,
// and it does not matter how they hang together; y is for the table over all, and `keep` decides. `gain` is
// what the light stands for, over the probability that weights against hitting it reckon with.
Entry choose_by_guess(Cell cell, vec3 from, vec3 n, vec2 u, float keep, out float gain) {
    const float listed_count = float(LISTED);
    Entry entry = Entry(NO_EMITTER, NO_INSTANCE, 0.0);
    float sum = 0.0, of_kept = 0.0;
    for (uint i = 0u; i <= LISTED; ++i) {
        CellEntry candidate;
        if (i < LISTED) {
            float x = (float(i) + u.x) / listed_count;
            const uint slot = choose_slot(x, cell.count);
            candidate = listed(cell, slot, x);
        } else {
            candidate.emitter = choose_emitter(u);
            candidate.probability = list_probability(cell, candidate.emitter);
        }
        const LightBounds bounds = params.scene.at[0].light_bounds.at[candidate.emitter];
        const float guessed = guess(bounds, from, n);
        if (!(guessed > 0.0)) continue;
        const float weight = guessed / (listed_count * candidate.probability + bounds.probability);
        sum += weight;
        if (!is_kept(weight / sum, keep)) continue;
        of_kept = guessed;
        entry.number = candidate.emitter;
        entry.probability = mix(candidate.probability, bounds.probability, params.scene.at[0].cell_fallback);
    }
    gain = of_kept > 0.0 ? sum / of_kept * entry.probability : 0.0;
    entry.probability *= own_share();
    return entry;
}

// A light that shines on a surface. The weights against hitting it are those of a single choice by the table:
// any weights do that both sides know. `n` is the face's normal on the viewer's side.
ChosenLight choose_light(uint cell, vec3 from, Bsdf bsdf, vec3 wo, vec3 throughput, vec3 n, uint pixel,
                         uint index, uint dimension) {
    Reservoir reservoir = empty_reservoir(pixel, index, dimension + DIMENSION_KEEP);
    Cell here = Cell(0u, 0u);
    if (SELECTION == SELECTION_LEAF && CANDIDATES > 1u) here = params.scene.at[0].cells.at[cell];
    const bool guesses = here.count > 0u;
    const uint count = guesses ? 1u : CANDIDATES;
    reservoir.count = float(count);
    for (uint i = 0u; i < count; ++i) {
        // The candidates of all samples are one sequence: they are spread out among themselves, too.
        vec4 u = random4(pixel, index * count + i, dimension + DIMENSION_LIGHT, params.seed);
        float gained = 1.0;
        Entry entry;
        if (guesses) {
            if (is_to_move(u.x)) entry = choose_moving(u.xy);
            else entry = choose_by_guess(here, from, n, u.xy, reservoir.u, gained);
        } else {
            entry = choose_entry(cell, from, u.xy);
        }
        if (entry.number == NO_EMITTER) continue;
        const LightSample light = sample_entry(entry, cell, from, u.zw);
        const float cos_i = dot(n, light.wi);
        if (!(max_component(abs(light.emission)) > 0.0 && cos_i > 0.0)) continue;
        const float other = ESTIMATOR == ESTIMATOR_MIS && light.hittable
            ? pdf_bsdf(bsdf, wo, light.wi) : 0.0;
        const vec3 gain = throughput * eval_bsdf(bsdf, wo, light.wi) * light.emission
            * (gained * cosine_factor(light, cos_i) * mis_weight(light.pdf, other) / light.pdf);
        offer(reservoir, ChosenLight(light.wi, light.t_max, gain, light.sun, light.number, 0.0));
    }
    return kept_of(reservoir);
}
