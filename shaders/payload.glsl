// What hit and miss shaders tell the ray generation shader. Thin: shading happens in its loop.

#include "abi.glsl"

struct HitPayload {
    vec2 barycentrics; // of the second and third corner
    float t;
    uint instance;     // custom index and HIT_FRONT
    uint triangle;     // index among all triangles; MISS if nothing was hit
};

struct ShadowPayload {
    bool visible;
};

// A shadow ray where light passes through surfaces. Sums and products alone: the order in which they
// are met is the device's affair.
struct TransmittancePayload {
    vec3 surfaces;  // product of what each surface lets through
    vec3 depth;     // optical depth that each adds, up to the ray's end; what they enclose
    float t_max;    // length of the ray
    bool visible;   // nothing opaque was hit
};
