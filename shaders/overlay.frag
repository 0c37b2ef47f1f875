// Texel times tint. All are display codes, and are blended as such.
#version 450

layout(set = 0, binding = 0) uniform texture2D picture;
layout(set = 0, binding = 1) uniform sampler filtering;

layout(location = 0) in vec2 texture_at;
layout(location = 1) in vec4 tint;

layout(location = 0) out vec4 color;

void main() {
    color = tint * texture(sampler2D(picture, filtering), texture_at);
}
