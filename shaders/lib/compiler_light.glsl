// Light entities by the formulas of the light compilers. Needs bindings.glsl, sampling.glsl and, for
// LightSample, light.glsl.

const float COMPILER_SCALE = 128.0;   // K of the formulas
const float COMPILER_NEAREST = 0.1;   // no surface is nearer to a light

float square(float x) { return x * x; }

// Share of a light's full value at a distance.
float compiler_falloff(Light light, float distance) {
    const float scaled = light.falloff_scale * distance;
    switch (light.falloff) {
    case FALLOFF_LINEAR: return max(0.0, 1.0 - scaled);
    case FALLOFF_INVERSE: return COMPILER_SCALE / scaled;
    case FALLOFF_INVERSE_SQUARE: return square(COMPILER_SCALE / scaled);
    case FALLOFF_SHIFTED: return square(COMPILER_SCALE / (scaled + COMPILER_SCALE));
    default: return 1.0;
    }
}

// A light of no extent: `emission` is the irradiance that the surface gets, but for the share of the
// cosine, and `pdf` the probability with which it was chosen.
LightSample sample_compiler_light(Light light, float probability, vec3 from) {
    LightSample s;
    s.emission = vec3(0.0);
    s.hittable = false;
    s.angle_scale = light.angle_scale;
    s.pdf = probability;
    s.sun = light.falloff == FALLOFF_SUN;
    if (s.sun) {
        s.wi = -light.direction;
        s.t_max = params.t_max;
        s.emission = light.intensity;
        return s;
    }
    const vec3 to_light = light.position - from;
    const float distance = length(to_light);
    if (!(distance > 0.0)) return s;
    s.wi = to_light / distance;
    s.t_max = distance;
    s.emission = light.intensity * compiler_falloff(light, max(distance, COMPILER_NEAREST))
        * spot_factor(light.cos_inner, light.cos_outer, dot(-s.wi, light.direction));
    return s;
}
