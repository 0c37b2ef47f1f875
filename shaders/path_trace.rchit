// Nearest hit of a camera or bounce ray: says what was hit, and no more.
#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_samplerless_texture_functions : require

#include "bindings.glsl"
#include "payload.glsl"
#include "lib/triangle_index.glsl"

layout(location = 0) rayPayloadInEXT HitPayload hit;
hitAttributeEXT vec2 barycentrics;

void main() {
    hit.barycentrics = barycentrics;
    hit.t = gl_HitTEXT;
    hit.instance = gl_InstanceCustomIndexEXT;
    hit.triangle = triangle_index();
}
