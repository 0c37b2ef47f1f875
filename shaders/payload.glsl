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
