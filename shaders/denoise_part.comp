// Parts light from what it falls on, for the filter: radiance without what shines itself, on a surface of albedo 1.
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/denoise.glsl"

// The film's planes of sums, one after the other.
layout(std430, set = 0, binding = 0) readonly buffer Film { vec4 film[]; };
// Two words a pixel, see lib/denoise.glsl.
layout(std430, set = 0, binding = 1) buffer Guides { vec4 guides[]; };
// Light, and the variance of its luminance.
layout(std430, set = 0, binding = 2) buffer Lights { vec4 lights[]; };

layout(push_constant) uniform Params {
    uint width;
    uint height;
    // Numbers of planes.
    uint beauty;
    uint deviation;
    uint emission;
    uint albedo;
    uint normal;
    uint position;
} params;

vec4 film_at(uint plane, uint pixel) { return film[plane * params.width * params.height + pixel]; }

// Units to what a pixel beside it sees.
float spacing_to(vec3 here, int x, int y) {
    if (x < 0 || y < 0 || x >= int(params.width) || y >= int(params.height)) { return 1e30; }
    uint pixel = uint(y) * params.width + uint(x);
    vec3 there = film_at(params.position, pixel).xyz / max(film_at(params.beauty, pixel).w, 1.0);
    return distance(here, there);
}

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    vec4 sum = film_at(params.beauty, pixel);
    float samples = max(sum.w, 1.0);
    vec3 albedo = max(film_at(params.albedo, pixel).rgb / samples, vec3(LEAST_ALBEDO));
    vec3 emission = film_at(params.emission, pixel).rgb / samples;
    vec3 light = max(sum.rgb / samples - emission, vec3(0.0)) / albedo;
    vec3 variance = film_at(params.deviation, pixel).rgb / (samples * max(samples - 1.0, 1.0));
    // Noise is in all channels alike: lights are mostly white.
    float deviation = luminance(sqrt(max(variance, vec3(0.0))) / albedo);
    vec3 normal = film_at(params.normal, pixel).xyz;
    float size = length(normal);
    vec3 position = film_at(params.position, pixel).xyz / samples;
    int x = int(at.x);
    int y = int(at.y);
    float spacing = min(
        min(spacing_to(position, x - 1, y), spacing_to(position, x + 1, y)),
        min(spacing_to(position, x, y - 1), spacing_to(position, x, y + 1)));
    guides[2u * pixel] = vec4(size > 0.0 ? normal / size : vec3(0.0), spacing);
    guides[2u * pixel + 1u] = vec4(position, sum.w);
    lights[pixel] = vec4(light, deviation * deviation);
}
