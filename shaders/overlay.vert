// Flat triangles over the picture: panels, text, and the picture itself as a rectangle.
#version 450

// Points from the upper left corner of the screen.
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 texture_at;
// Display codes, premultiplied by alpha.
layout(location = 2) in vec4 tint;

layout(location = 0) out vec2 out_texture_at;
layout(location = 1) out vec4 out_tint;

layout(push_constant) uniform Params {
    vec2 size;  // of the screen in points
} params;

void main() {
    out_texture_at = texture_at;
    out_tint = tint;
    gl_Position = vec4(2.0 * position / params.size - vec2(1.0), 0.0, 1.0);
}
