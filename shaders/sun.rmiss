// A ray towards a sun hit nothing: no sky face is there, and so no sun.
#version 460
#extension GL_EXT_ray_tracing : require

#include "payload.glsl"

layout(location = 0) rayPayloadInEXT HitPayload hit;

void main() { hit.triangle = MISS; }
