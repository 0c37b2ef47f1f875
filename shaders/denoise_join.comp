// The filtered light on what it falls on, and what shines itself: a picture, as a film of one sample.
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/denoise.glsl"

// The film's planes of sums, one after the other.
layout(std430, set = 0, binding = 0) readonly buffer Film { vec4 film[]; };
layout(std430, set = 0, binding = 1) readonly buffer Lights { vec4 lights[]; };
// Radiance, and 1.
layout(std430, set = 0, binding = 2) buffer Picture { vec4 picture[]; };

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

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    float samples = max(film_at(params.beauty, pixel).w, 1.0);
    vec3 albedo = max(film_at(params.albedo, pixel).rgb / samples, vec3(LEAST_ALBEDO));
    vec3 emission = film_at(params.emission, pixel).rgb / samples;
    picture[pixel] = vec4(emission + lights[pixel].rgb * albedo, 1.0);
}
