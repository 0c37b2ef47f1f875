// A shadow ray hit nothing: the light is visible.
#version 460
#extension GL_EXT_ray_tracing : require

#include "payload.glsl"

layout(location = 1) rayPayloadInEXT ShadowPayload shadow;

void main() { shadow.visible = true; }
