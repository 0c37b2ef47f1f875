// One step of the filter: light averaged with that of pixels `gap` apart, within surfaces and as far as noise explains
// the difference (Dammertz et al. 2010, Schied et al. 2017).
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/denoise.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Guides { vec4 guides[]; };
// Light, and the variance of its luminance.
layout(std430, set = 0, binding = 1) readonly buffer From { vec4 before[]; };
layout(std430, set = 0, binding = 2) buffer To { vec4 after[]; };

layout(push_constant) uniform Params {
    uint width;
    uint height;
    uint gap;
    uint unused;
} params;

// Differences of light, in standard deviations of its noise, at which a neighbour counts 1 / e: the first number, and the
// second divided by the square root of the samples, for the noise of few samples is not well known.
const float SIGMA_LIGHT = 1.5;
const float SIGMA_OF_ONE = 2.5;

// Weights of a pixel, its neighbour and the next but one, of the cubic B-spline.
float kernel(int d) {
    int far = abs(d);
    if (far == 0) { return 3.0 / 8.0; }
    if (far == 1) { return 1.0 / 4.0; }
    return 1.0 / 16.0;
}

bool is_inside(int x, int y) { return x >= 0 && y >= 0 && x < int(params.width) && y < int(params.height); }

// Variance about a pixel, by a binomial filter: that of one pixel is too noisy itself.
float variance_about(ivec2 at) {
    float weights = 0.0;
    float sum = 0.0;
    for (int dy = -1; dy <= 1; dy++) {
        for (int dx = -1; dx <= 1; dx++) {
            if (is_inside(at.x + dx, at.y + dy)) {
                float weight = float((2 - abs(dx)) * (2 - abs(dy)));
                weights += weight;
                sum += weight * before[uint(at.y + dy) * params.width + uint(at.x + dx)].w;
            }
        }
    }
    return sum / weights;
}

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    vec4 normal = guides[2u * pixel];
    vec4 position = guides[2u * pixel + 1u];
    vec4 own = before[pixel];
    float sigmas = SIGMA_LIGHT + SIGMA_OF_ONE / sqrt(max(position.w, 1.0));
    float deviation = sigmas * sqrt(variance_about(ivec2(at))) + 1e-6;
    float weights = kernel(0) * kernel(0);
    vec3 sum = weights * own.rgb;
    float variances = weights * weights * own.w;
    for (int dy = -2; dy <= 2; dy++) {
        for (int dx = -2; dx <= 2; dx++) {
            int x = int(at.x) + int(params.gap) * dx;
            int y = int(at.y) + int(params.gap) * dy;
            if (!is_inside(x, y) || (dx == 0 && dy == 0)) { continue; }
            uint other = uint(y) * params.width + uint(x);
            vec4 light = before[other];
            float differs = abs(luminance(light.rgb) - luminance(own.rgb)) / deviation;
            float weight = kernel(dx) * kernel(dy) * exp(-differs)
                * alike(normal, position, guides[2u * other], guides[2u * other + 1u]);
            weights += weight;
            sum += weight * light.rgb;
            variances += weight * weight * light.w;
        }
    }
    after[pixel] = vec4(sum / weights, variances / (weights * weights));
}
