// A ray hit nothing, which is not an escape: towards a sun no sky face is there, and so no sun; a ray that
// passed an interface is looked along again.
#version 460
#extension GL_EXT_ray_tracing : require

#include "payload.glsl"

layout(location = 0) rayPayloadInEXT HitPayload hit;

void main() { hit.triangle = MISS; }
