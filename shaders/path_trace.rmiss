// A camera or bounce ray hit nothing: black, not sky.
#version 460
#extension GL_EXT_ray_tracing : require

#include "payload.glsl"

layout(location = 0) rayPayloadInEXT HitPayload hit;

void main() { hit.triangle = MISS; }
