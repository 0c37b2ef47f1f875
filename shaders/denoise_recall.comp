// What the picture before knew of the light on what is seen now: for pictures that follow one another while the eye or the
// level moves. Where a picture has many samples of its own it needs none of that.
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/denoise.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Guides { vec4 guides[]; };
// Light as it was traced.
layout(std430, set = 0, binding = 1) readonly buffer Parted { vec4 parted[]; };
// Light, and the variance that the filter believes.
layout(std430, set = 0, binding = 2) buffer Lights { vec4 lights[]; };
// Of the picture before.
layout(std430, set = 0, binding = 3) readonly buffer GuidesThen { vec4 guides_then[]; };
// Light, and how many samples it is worth.
layout(std430, set = 0, binding = 4) readonly buffer Then { vec4 kept_then[]; };
// The same for the picture after.
layout(std430, set = 0, binding = 5) buffer Kept { vec4 kept[]; };

layout(push_constant) uniform Params {
    // The camera of the picture before, and its size; forward.w: whether there was one.
    vec4 origin;
    vec4 forward;
    vec4 right;
    vec4 up;
    uint width;
    uint height;
    uint width_then;
    uint height_then;
} params;

// What is remembered is worth so many samples at most, less as a picture gets its own, and nothing once it has one more.
const float MOST_REMEMBERED = 8.0;
// Pixels to each side that tell what light there can be now.
const int REACH = 2;
// Standard deviations of these pixels' light that remembered light may differ by.
const float MOST_DEVIATIONS = 1.5;

// Remembered light of what the pixel sees, and the samples that it is worth.
vec4 recall(vec4 normal, vec4 position) {
    vec3 direction = position.xyz - params.origin.xyz;
    float depth = dot(direction, params.forward.xyz);
    if (!(params.forward.w > 0.0 && depth > 0.0)) { return vec4(0.0); }
    float x = dot(direction, params.right.xyz) / (dot(params.right.xyz, params.right.xyz) * depth);
    float y = dot(direction, params.up.xyz) / (dot(params.up.xyz, params.up.xyz) * depth);
    if (!(abs(x) <= 1.0 && abs(y) <= 1.0)) { return vec4(0.0); }
    float left = (0.5 + 0.5 * x) * float(params.width_then) - 0.5;
    float top = (0.5 - 0.5 * y) * float(params.height_then) - 0.5;
    float beside = left - floor(left);
    float below = top - floor(top);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int dy = 0; dy <= 1; dy++) {
        for (int dx = 0; dx <= 1; dx++) {
            int i = int(floor(left)) + dx;
            int j = int(floor(top)) + dy;
            if (i < 0 || j < 0 || i >= int(params.width_then) || j >= int(params.height_then)) { continue; }
            uint other = uint(j) * params.width_then + uint(i);
            float near_x = dx == 0 ? 1.0 - beside : beside;
            float near_y = dy == 0 ? 1.0 - below : below;
            float weight = near_x * near_y
                * alike(normal, position, guides_then[2u * other], guides_then[2u * other + 1u]);
            weights += weight;
            sum += weight * kept_then[other];
        }
    }
    // A place of which only a sliver was seen tells nothing.
    return weights > 0.05 ? sum / weights : vec4(0.0);
}

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    vec4 normal = guides[2u * pixel];
    vec4 position = guides[2u * pixel + 1u];
    vec4 now = lights[pixel];
    float samples = max(position.w, 1.0);
    vec4 then = recall(normal, position);
    float worth = min(then.w, MOST_REMEMBERED) * clamp(1.0 - (samples - 1.0) / MOST_REMEMBERED, 0.0, 1.0);
    if (worth > 0.0) {
        // Light that is no longer there is drawn to what the pixels about see now.
        float weights = 0.0;
        vec3 sum = vec3(0.0);
        vec3 squares = vec3(0.0);
        for (int dy = -REACH; dy <= REACH; dy++) {
            for (int dx = -REACH; dx <= REACH; dx++) {
                int x = int(at.x) + dx;
                int y = int(at.y) + dy;
                if (x < 0 || y < 0 || x >= int(params.width) || y >= int(params.height)) { continue; }
                uint other = uint(y) * params.width + uint(x);
                float weight = 1.0;
                if (other != pixel) {
                    weight = alike(normal, position, guides[2u * other], guides[2u * other + 1u]);
                }
                vec3 light = parted[other].rgb;
                weights += weight;
                sum += weight * light;
                squares += weight * light * light;
            }
        }
        vec3 mean = sum / weights;
        vec3 most = MOST_DEVIATIONS * sqrt(max(squares / weights - mean * mean, vec3(0.0)));
        vec3 held = clamp(then.rgb, mean - most, mean + most);
        float share = worth / (worth + samples);
        now = vec4(mix(now.rgb, held, share), now.w * (1.0 - share));
        lights[pixel] = now;
    }
    kept[pixel] = vec4(now.rgb, worth + samples);
}
