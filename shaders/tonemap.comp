// Film to display codes. The CPU twin is crates/viewer/src/tonemap.rs, function for function.
#version 450

layout(local_size_x = 8, local_size_y = 8) in;

// The film's beauty plane: sum of radiance, number of samples.
layout(std430, set = 0, binding = 0) readonly buffer Beauty { vec4 beauty[]; };
// One pixel per word: red in the low byte.
layout(std430, set = 0, binding = 1) buffer Display { uint display[]; };

layout(push_constant) uniform Params {
    uint width;
    uint height;
    uint curve;  // 0 AgX, 1 ACES, 2 Reinhard, 3 clip
    float gain;  // 2^EV
} params;

vec3 srgb_encode(vec3 linear) {
    vec3 x = clamp(linear, vec3(0.0), vec3(1.0));
    vec3 low = 12.92 * x;
    vec3 high = 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, vec3(lessThanEqual(x, vec3(0.0031308))));
}

const float AGX_MIN_EV = -12.47393;
const float AGX_MAX_EV = 4.026069;
const float AGX_X_PIVOT = 10.0 / 16.5;
const float AGX_Y_PIVOT = 0.5;
const float AGX_SLOPE = 2.0;
const float AGX_TOE_POWER = 3.0;
const float AGX_SHOULDER_POWER = 3.25;

float agx_curve(float x) {
    float from_pivot = x - AGX_X_PIVOT;
    bool toe = from_pivot < 0.0;
    float run = toe ? AGX_X_PIVOT : 1.0 - AGX_X_PIVOT;
    float rise = toe ? AGX_Y_PIVOT : 1.0 - AGX_Y_PIVOT;
    float power = toe ? AGX_TOE_POWER : AGX_SHOULDER_POWER;
    float scale = pow(pow(AGX_SLOPE * run, -power) * (pow(AGX_SLOPE * run / rise, power) - 1.0), -1.0 / power);
    float t = AGX_SLOPE * abs(from_pivot) / scale;
    float y = scale * t / pow(1.0 + pow(t, power), 1.0 / power);
    return clamp(AGX_Y_PIVOT + (toe ? -y : y), 0.0, 1.0);
}

vec3 agx(vec3 linear) {
    vec3 inset = vec3(
        dot(vec3(0.84247906, 0.0784336, 0.079223745), linear),
        dot(vec3(0.042328242, 0.87846864, 0.07916613), linear),
        dot(vec3(0.042375655, 0.0784336, 0.87914297), linear));
    vec3 ev = clamp(log2(max(inset, vec3(1e-10))), vec3(AGX_MIN_EV), vec3(AGX_MAX_EV));
    vec3 x = (ev - AGX_MIN_EV) / (AGX_MAX_EV - AGX_MIN_EV);
    vec3 code = vec3(agx_curve(x.x), agx_curve(x.y), agx_curve(x.z));
    return clamp(vec3(
        dot(vec3(1.196879, -0.09802088, -0.099029745), code),
        dot(vec3(-0.05289685, 1.1519031, -0.09896118), code),
        dot(vec3(-0.052971635, -0.09804345, 1.1510737), code)), vec3(0.0), vec3(1.0));
}

vec3 aces(vec3 x) {
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), vec3(0.0), vec3(1.0));
}

void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    if (at.x >= params.width || at.y >= params.height) { return; }
    uint pixel = at.y * params.width + at.x;
    vec4 sum = beauty[pixel];
    vec3 radiance = max(sum.rgb / max(sum.w, 1.0), vec3(0.0)) * params.gain;
    vec3 code;
    if (params.curve == 0u) {
        code = agx(radiance);
    } else if (params.curve == 1u) {
        code = srgb_encode(aces(radiance));
    } else if (params.curve == 2u) {
        code = srgb_encode(radiance / (1.0 + dot(radiance, vec3(0.2126, 0.7152, 0.0722))));
    } else {
        code = srgb_encode(radiance);
    }
    uvec3 bytes = uvec3(code * 255.0 + 0.5);
    display[pixel] = bytes.r | (bytes.g << 8u) | (bytes.b << 16u) | 0xff000000u;
}
