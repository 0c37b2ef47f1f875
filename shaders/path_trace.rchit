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
    // The side comes from the intersection test itself: a normal, however exact, may disagree with
    // it at grazing angles, and the path would leave on the wrong side. Front-facing triangles are
    // those whose cross product of the edges points to the ray's origin, whatever the instance.
    hit.instance = gl_InstanceCustomIndexEXT
        | (gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT ? HIT_FRONT : 0u);
    hit.triangle = triangle_index();
}
