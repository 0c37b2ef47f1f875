// A camera or bounce ray hit nothing: black, not sky, and counted. The first ones are kept.
#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_samplerless_texture_functions : require

#include "bindings.glsl"
#include "payload.glsl"
#include "lib/film.glsl"

layout(location = 0) rayPayloadInEXT HitPayload hit;

void main() {
    const uint slot = atomicAdd(params.tallies.at[0].counters.at[0].escaped.x, 1u);
    if (slot == 0xffffffffu) atomicAdd(params.tallies.at[0].counters.at[0].escaped.y, 1u);
    if (slot < ESCAPES_KEPT && params.tallies.at[0].counters.at[0].escaped.y == 0u) {
        const uvec2 size = gl_LaunchSizeEXT.xy;
        Escape escape;
        escape.origin = gl_WorldRayOriginEXT;
        escape.direction = gl_WorldRayDirectionEXT;
        escape.pixel = gl_LaunchIDEXT.y * size.x + gl_LaunchIDEXT.x;
        escape.sample_index = samples_taken(escape.pixel, size.x * size.y);
        params.tallies.at[0].escapes.at[slot] = escape;
    }
    hit.triangle = MISS;
}
