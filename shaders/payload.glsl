// What hit and miss shaders tell the ray generation shader. Thin: shading happens in its loop.

const uint MISS = 0xffffffffu;

// Custom index of an instance, as hit shaders see it and tell it: number and flags.
const uint INSTANCE_INDEX = 0x007fffffu;
const uint INSTANCE_PLACED = 0x00800000u; // its transform is not the identity
const uint HIT_FRONT = 0x80000000u;       // added by the hit shader: seen from the front

struct HitPayload {
    vec2 barycentrics; // of the second and third corner
    float t;
    uint instance;     // index and flags
    uint triangle;     // index among all triangles; MISS if nothing was hit
};

struct ShadowPayload {
    bool visible;
};
