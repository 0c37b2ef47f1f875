// Compiler lights where not all of them add up: all are asked at every point. Needs compiler_light.glsl, walk.glsl and
// what path_trace.rgen says before its loop.

const float IRRADIANCE_PER_VALUE = PI / 128.0; // of a lightmap value of 1
const float COMPILER_GATE = 0.001;             // values up to this are not looked for

// The light of a style that arrives at a point with the normal n: what adds up, then the most of that and of each
// least light, then what takes light away. Overwrites `hit`.
vec3 sum_of_style(StyleSum style, vec3 from, vec3 n, uint mask, Medium medium) {
    vec3 found = vec3(0.0), taken = vec3(0.0), least = style.least;
    for (uint i = style.first; i < style.first + style.count; ++i) {
        const Light light = params.scene.at[0].lights.at[i];
        const LightSample s = sample_compiler_light(light, 1.0, from);
        vec3 value = s.emission;
        if (light.falloff != FALLOFF_LEAST) {
            const float cosine = dot(n, s.wi);
            if (!(cosine > 0.0)) continue;
            value *= mix(1.0, cosine, light.angle_scale);
        }
        if (!(max_component(abs(value)) > COMPILER_GATE * IRRADIANCE_PER_VALUE)) continue;
        value *= s.sun ? sky_visibility(from, s.wi, mask, medium) : visibility(from, s.wi, s.t_max, mask, medium);
        if (light.falloff == FALLOFF_LEAST) least = max(least, value);
        else if (light.intensity.x + light.intensity.y + light.intensity.z < 0.0) taken += value;
        else found += value;
    }
    return max(max(found, least) + taken, vec3(0.0));
}

// What a lightmap with gamma shows of an irradiance that has the brightness of its style.
vec3 with_gamma(vec3 irradiance, float brightness) {
    const float gamma = params.scene.at[0].light_gamma;
    if (gamma == 1.0) return irradiance;
    const float white = 255.0 * IRRADIANCE_PER_VALUE * brightness;
    return white * pow(irradiance / white, vec3(1.0 / gamma));
}

// Adds the light of all styles at a vertex, of the surface in `hit`, which it overwrites. Light has no direction once it
// is added up, and counts as if from straight above.
void add_light_sums(inout PathSample path, Walk walk, Bsdf bsdf, vec3 wo, vec3 n, uint mask) {
    const vec3 scattered = walk.throughput * eval_bsdf(bsdf, wo, n);
    const uint count = params.scene.at[0].sum_count;
    const uint material = material_of(hit.instance, hit.triangle);
    const vec3 own = params.scene.at[0].style_sums.at[count + material].least;
    for (uint i = 0u; i < count; ++i) {
        StyleSum style = params.scene.at[0].style_sums.at[i];
        // Steady light is the first wherever a material has its own.
        if (i == 0u && max_component(own) > 0.0) style.least = own;
        const vec3 irradiance = sum_of_style(style, walk.origin, n, mask, walk.medium);
        ChosenLight light = NO_LIGHT;
        light.number = style.count > 0u ? style.first : NO_EMITTER;
        add_sampled(path, walk.vertex, light, scattered * with_gamma(irradiance, style.brightness));
    }
}
