// A shadow ray met nothing opaque.
#version 460
#extension GL_EXT_ray_tracing : require

#include "payload.glsl"

layout(location = 2) rayPayloadInEXT TransmittancePayload light;

void main() { light.visible = true; }
