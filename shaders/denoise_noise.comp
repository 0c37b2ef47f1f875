// How noisy each pixel is, for the filter: the variance of its neighbours' samples where there are many, the spread of its
// neighbours where there are few.
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/denoise.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Guides { vec4 guides[]; };
// Light, and the variance of its luminance by the pixel's own samples.
layout(std430, set = 0, binding = 1) readonly buffer From { vec4 parted[]; };
// The same light, and the variance that the filter believes.
layout(std430, set = 0, binding = 2) buffer To { vec4 lights[]; };

layout(push_constant) uniform Params {
    uint width;
    uint height;
    uint gap;
    uint unused;
} params;

// From so many samples on a pixel's own samples tell its noise.
const float SAMPLES_THAT_TELL = 4.0;
// Pixels to each side that noise is looked for in.
const int NOISE_REACH = 3;

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    vec4 normal = guides[2u * pixel];
    vec4 position = guides[2u * pixel + 1u];
    float weights = 0.0;
    float sum = 0.0;
    float squares = 0.0;
    float variances = 0.0;
    for (int dy = -NOISE_REACH; dy <= NOISE_REACH; dy++) {
        for (int dx = -NOISE_REACH; dx <= NOISE_REACH; dx++) {
            int x = int(at.x) + dx;
            int y = int(at.y) + dy;
            if (x < 0 || y < 0 || x >= int(params.width) || y >= int(params.height)) { continue; }
            uint other = uint(y) * params.width + uint(x);
            float weight = 1.0;
            if (other != pixel) {
                weight = alike(normal, position, guides[2u * other], guides[2u * other + 1u]);
            }
            float l = luminance(parted[other].rgb);
            weights += weight;
            sum += weight * l;
            squares += weight * l * l;
            variances += weight * parted[other].w;
        }
    }
    float mean = sum / weights;
    float spread = max(squares / weights - mean * mean, 0.0);
    float told = clamp((position.w - 1.0) / (SAMPLES_THAT_TELL - 1.0), 0.0, 1.0);
    lights[pixel] = vec4(parted[pixel].rgb, spread + told * (variances / weights - spread));
}
