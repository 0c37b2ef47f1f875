// The light that the level's own compiler stored. Needs bindings.glsl and surface.glsl.

vec3 baked_sample(BakedTriangle grid, uvec2 at) {
    return params.scene.at[0].baked_samples.at[grid.first + at.y * grid.width + at.x];
}

// Light at a point of a triangle: bilinear between the samples, constant beyond them.
vec3 baked_light(uint triangle_index, vec2 b) {
    // Loose triangles have none.
    if (HAS_FRAMES && triangle_index >= params.scene.at[0].baked_count) return vec3(1.0);
    const BakedTriangle grid = params.scene.at[0].baked.at[triangle_index];
    const vec2 last = vec2(grid.width, grid.height) - 1.0;
    const vec2 uv = grid.uv0 * (1.0 - b.x - b.y) + grid.uv1 * b.x + grid.uv2 * b.y;
    const vec2 at = clamp(uv, vec2(0.0), last);
    const uvec2 low = uvec2(at), next = min(low + 1u, uvec2(last));
    const vec2 f = at - vec2(low);
    return mix(mix(baked_sample(grid, low), baked_sample(grid, uvec2(next.x, low.y)), f.x),
               mix(baked_sample(grid, uvec2(low.x, next.y)), baked_sample(grid, next), f.x), f.y);
}

// Radiance of a surface that shows its texture in baked light; texels with alpha 0 need none.
vec3 baked_emission(Material material, vec2 uv, uint triangle_index, vec2 b) {
    if ((material.flags & MATERIAL_EMISSIVE) == 0u) return vec3(0.0);
    const vec4 texel = fetch(material.emission, uv, material.width, material.height);
    const vec3 light = texel.a == 0.0 ? vec3(1.0) : baked_light(triangle_index, b);
    return material.emission_scale * srgb_to_linear(texel.rgb) * light;
}
