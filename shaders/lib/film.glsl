// The film: running sums per pixel. Needs bindings.glsl.
//
// Each sample is added in order, with Kahan's compensation for the radiance and Welford's update
// for the variance, so the picture does not depend on how samples are split into dispatches.

struct PathSample {
    vec3 emission;   // seen directly
    vec3 direct;     // reflected once
    vec3 indirect;   // reflected more than once
    vec3 albedo;     // of the first hit, as are the rest
    vec3 normal;
    vec3 position;
    float depth;     // along the view direction
    vec2 motion;     // to where it was in the picture before, pixels to the right and down
    uint id;         // face + 1; 0 if nothing was hit
};

vec4 film_load(uint plane, uint pixel, uint pixels) { return params.film.at[plane * pixels + pixel]; }

void film_store(uint plane, uint pixel, uint pixels, vec4 value) {
    params.film.at[plane * pixels + pixel] = value;
}

// Samples the film holds of a pixel.
uint samples_taken(uint pixel, uint pixels) { return uint(film_load(PLANE_BEAUTY, pixel, pixels).w); }

// Adds light to the plane of a light style, from 1 on: nothing else writes there.
void film_add_style(uint plane, uint pixel, uint pixels, vec3 radiance) {
    const uint at = ((ALL_LAYERS ? PLANES_ALL : PLANES_BASIC) + plane - 1u) * pixels + pixel;
    params.film.at[at].rgb += radiance;
}

// Darkens what was reflected to CLAMP in its largest channel, and counts in a plane of its own what that
// takes, and how often.
void film_clamp(inout PathSample path, uint pixel, uint pixels) {
    const vec3 reflected = path.direct + path.indirect;
    const float largest = max(reflected.x, max(reflected.y, reflected.z));
    const float limit = uintBitsToFloat(CLAMP);
    if (!(largest > limit)) return;
    const float kept = limit / largest;
    path.direct *= kept;
    path.indirect *= kept;
    const uint at = (ALL_LAYERS ? PLANES_ALL : PLANES_BASIC) * pixels + pixel;
    params.film.at[at] += vec4(reflected - (path.direct + path.indirect), 1.0);
}

struct FilmState {
    vec4 beauty;        // sum rgb, count
    vec4 deviation;     // sum of squared deviations rgb, id
    vec4 compensation;  // of the sum rgb, sum of depth
    PathSample sums;    // of the other layers
};

FilmState film_begin(uint pixel, uint pixels) {
    FilmState state;
    state.beauty = film_load(PLANE_BEAUTY, pixel, pixels);
    state.deviation = film_load(PLANE_DEVIATION, pixel, pixels);
    state.compensation = film_load(PLANE_COMPENSATION, pixel, pixels);
    if (ALL_LAYERS) {
        const vec4 emission = film_load(PLANE_EMISSION, pixel, pixels);
        const vec4 direct = film_load(PLANE_DIRECT, pixel, pixels);
        state.sums.emission = emission.rgb;
        state.sums.direct = direct.rgb;
        state.sums.motion = vec2(emission.w, direct.w);
        state.sums.indirect = film_load(PLANE_INDIRECT, pixel, pixels).rgb;
        state.sums.albedo = film_load(PLANE_ALBEDO, pixel, pixels).rgb;
        state.sums.normal = film_load(PLANE_NORMAL, pixel, pixels).xyz;
        state.sums.position = film_load(PLANE_POSITION, pixel, pixels).xyz;
        state.sums.depth = state.compensation.w;
        state.sums.id = floatBitsToUint(state.deviation.w);
    }
    return state;
}

void film_sample(inout FilmState state, PathSample path, vec3 radiance) {
    const float count = state.beauty.w + 1.0;
    const vec3 mean_before = state.beauty.w > 0.0 ? state.beauty.rgb / state.beauty.w : vec3(0.0);
    // `precise` keeps the compiler from cancelling the compensation away.
    precise vec3 term = radiance - state.compensation.rgb;
    precise vec3 sum = state.beauty.rgb + term;
    precise vec3 lost = (sum - state.beauty.rgb) - term;
    if (ALL_LAYERS) {
        if (state.beauty.w == 0.0) state.sums.id = path.id;
        state.sums.emission += path.emission;
        state.sums.direct += path.direct;
        state.sums.indirect += path.indirect;
        state.sums.albedo += path.albedo;
        state.sums.normal += path.normal;
        state.sums.position += path.position;
        state.sums.depth += path.depth;
        if (HAS_FRAMES) state.sums.motion += path.motion;
    }
    state.beauty = vec4(sum, count);
    state.compensation.rgb = lost;
    // Never negative but for rounding.
    state.deviation.rgb += max((radiance - mean_before) * (radiance - sum / count), vec3(0.0));
}

void film_end(FilmState state, uint pixel, uint pixels) {
    if (ALL_LAYERS) {
        state.compensation.w = state.sums.depth;
        state.deviation.w = uintBitsToFloat(state.sums.id);
        film_store(PLANE_EMISSION, pixel, pixels, vec4(state.sums.emission, state.sums.motion.x));
        film_store(PLANE_DIRECT, pixel, pixels, vec4(state.sums.direct, state.sums.motion.y));
        film_store(PLANE_INDIRECT, pixel, pixels, vec4(state.sums.indirect, 0.0));
        film_store(PLANE_ALBEDO, pixel, pixels, vec4(state.sums.albedo, 0.0));
        film_store(PLANE_NORMAL, pixel, pixels, vec4(state.sums.normal, 0.0));
        film_store(PLANE_POSITION, pixel, pixels, vec4(state.sums.position, 0.0));
    }
    film_store(PLANE_BEAUTY, pixel, pixels, state.beauty);
    film_store(PLANE_DEVIATION, pixel, pixels, state.deviation);
    film_store(PLANE_COMPENSATION, pixel, pixels, state.compensation);
}
