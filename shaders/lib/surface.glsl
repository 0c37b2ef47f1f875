// What is at a hit: position, normals, texels. Needs bindings.glsl and payload.glsl.

const float MAX_ALBEDO = 0.99;
const float WARP_TILE = 64.0;

struct Surface {
    vec3 position;   // world space
    vec3 normal;     // unit, towards the front, for shading
    vec3 geometric;  // unit, of the triangle as it was intersected; either side
    vec3 albedo;
    vec3 emission;   // Le to the front, or to both sides
    vec3 inward;     // from the position to the triangle's centre
    float error;     // bound of the distance between `position` and the true surface
    uint flags;      // MATERIAL_ flags
    uint face;
    // Where it emits, for the choice among lights:
    uint source;       // the triangle's number among the sources; NO_EMITTER if it is none
    float moving;      // probability with which what moves is chosen; below 0 of what does not
    vec2 barycentrics; // in the triangle
    vec2 uv;           // texture coordinates, not wrapped
    float area;        // of the triangle
    float uv_area;     // of the triangle in texture coordinates
};

// Texel coordinates, not yet wrapped: liquids are warped, their coordinates are world units.
vec2 texel_uv(Material material, vec2 uv) {
    if (HAS_LIQUIDS && (material.flags & MATERIAL_WARPED) != 0u) {
        const float k = 2.0 * PI / 128.0;
        uv += 8.0 * sin(uv.yx * k + params.time);
        uv *= vec2(material.width, material.height) / WARP_TILE;
    }
    return uv;
}

// Nearest texel, wrapping.
vec4 fetch(uint texture_index, vec2 uv, uint width, uint height) {
    const vec2 size = vec2(width, height);
    const vec2 wrapped = uv - size * floor(uv / size);
    const ivec2 texel = min(ivec2(wrapped), ivec2(width, height) - 1);
    return texelFetch(textures[nonuniformEXT(texture_index)], texel, 0);
}

vec2 interpolate_uv(Triangle t, vec2 b) {
    return t.uv0 * (1.0 - b.x - b.y) + t.uv1 * b.x + t.uv2 * b.y;
}

// Radiance leaving a point with texture coordinates uv to the front.
vec3 emission_at(Material material, vec2 uv) {
    if (!HAS_EMITTERS || (material.flags & MATERIAL_EMISSIVE) == 0u) return vec3(0.0);
    const vec4 texel = fetch(material.emission, uv, material.width, material.height);
    return material.emission_scale * srgb_to_linear(texel.rgb);
}

const float HALF_ULP = 1.0 / 16777216.0;

// A point of the triangle. Edges are short beside coordinates: only the two sums round at the
// coordinates' size.
vec3 interpolate(vec3 p0, vec3 p1, vec3 p2, vec2 b) { return p0 + ((p1 - p0) * b.x + (p2 - p0) * b.y); }

// How far a point of `interpolate` may lie from the triangle's plane, with the roundings of moving it
// off and of the intersection test of the next ray. Our own roundings are about 5 half-ulps of the
// largest coordinate; what a device adds is its own affair. With 12 all is well on software Vulkan
// and an H200 loses a few rays in 1e9 and a few in 1e6 at coordinates of 65,536; with 32 it loses
// none. A placed triangle's corners are transformed here and the ray by the device.
float position_error(vec3 p0, vec3 p1, vec3 p2, bool placed) {
    const float largest = max_component(max(abs(p0), max(abs(p1), abs(p2))));
    return HALF_ULP * (placed ? 48.0 : 32.0) * largest;
}

mat4x3 to_world(uint instance_word) {
    const Instance instance = params.scene.at[0].instances.at[instance_word & INSTANCE_INDEX];
    return transpose(mat3x4(instance.row0, instance.row1, instance.row2));
}

// The cofactor matrix, with the sign of the determinant, keeps normals on their side under any
// transform, mirrors included.
vec3 placed_normal(mat4x3 place, vec3 normal) {
    const vec3 x = place[0], y = place[1], z = place[2];
    const vec3 n = mat3(cross(y, z), cross(z, x), cross(x, y)) * normal;
    return normalize(n * sign(dot(cross(x, y), z)));
}

#include "baked.glsl"
#include "figure.glsl"

Triangle triangle_in_world(uint instance_word, uint triangle_index) {
    Triangle t = triangle_of(instance_word, triangle_index);
    if (HAS_INSTANCES && (instance_word & INSTANCE_PLACED) != 0u) {
        const mat4x3 place = to_world(instance_word);
        t.p0 = place * vec4(t.p0, 1.0);
        t.p1 = place * vec4(t.p1, 1.0);
        t.p2 = place * vec4(t.p2, 1.0);
        t.normal = placed_normal(place, t.normal);
    }
    return t;
}

Surface surface_at(uint instance_word, uint triangle_index, vec2 barycentrics) {
    const Triangle t = triangle_in_world(instance_word, triangle_index);
    const bool placed = HAS_INSTANCES && (instance_word & INSTANCE_PLACED) != 0u;
    const Material material = params.scene.at[0].materials.at[t.material];
    const vec2 b = barycentrics;
    Surface s;
    s.barycentrics = b;
    s.uv = interpolate_uv(t, b);
    const vec2 uv = texel_uv(material, s.uv);
    s.position = interpolate(t.p0, t.p1, t.p2, b);
    s.normal = t.normal;
    const vec3 across = cross(t.p1 - t.p0, t.p2 - t.p0);
    const float squared = dot(across, across);
    s.geometric = squared > 0.0 ? across * inversesqrt(squared) : t.normal;
    s.area = 0.5 * sqrt(squared);
    s.inward = (t.p0 + t.p1 + t.p2) / 3.0 - s.position;
    s.error = position_error(t.p0, t.p1, t.p2, placed);
    s.flags = material.flags;
    s.face = t.face;
    const vec2 e1 = t.uv1 - t.uv0, e2 = t.uv2 - t.uv0;
    s.uv_area = 0.5 * abs(e1.x * e2.y - e1.y * e2.x);
    s.source = NO_EMITTER;
    s.moving = moving_probability(instance_word);
    if (ESTIMATOR == ESTIMATOR_MIS && material.emission_weight > 0.0 && s.moving != 0.0) {
        const uint offset =
            params.scene.at[0].instances.at[instance_word & INSTANCE_INDEX].source_offset;
        s.source = params.scene.at[0].source_numbers.at[offset + triangle_index];
    }
    const bool sky = (material.flags & MATERIAL_SKY) != 0u;
    s.albedo = sky ? vec3(0.0)
                   : min(srgb_to_linear(fetch(material.base, uv, material.width, material.height).rgb),
                         MAX_ALBEDO);
    s.emission = HAS_BAKED_LIGHT ? baked_emission(material, uv, triangle_index, b)
                                 : emission_at(material, uv);
    return s;
}

// Origin of a ray that leaves the surface: moved back along the way the viewer's ray came, which is
// free, until its distance from the triangle is the error bound. `travelled` is the length of the
// viewer's ray.
vec3 spawn_origin(Surface s, vec3 wo, float travelled) {
    const float cosine = dot(s.geometric, wo);
    const float back = min(s.error / max(abs(cosine), 0.0625), 0.5 * travelled);
    // At grazing angles the way back would be long: the normal gives the rest.
    const vec3 n = cosine >= 0.0 ? s.geometric : -s.geometric;
    const vec3 away = wo * back + n * max(0.0, s.error - back * abs(cosine));
    // Rounding may have put a point at an edge behind the next triangle: a few units in the last
    // place towards the middle bring it back.
    const float length = max(length(s.inward), 1e-20);
    return s.position + away + s.inward * min(0.25 * s.error / length, 1.0);
}
