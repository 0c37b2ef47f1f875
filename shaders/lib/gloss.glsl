// Microfacets distributed by GGX: gloss and metal. Needs bindings.glsl, math.glsl, sampling.glsl.
// What they mean and where they come from: crates/scene/src/gloss.rs.

const float MIN_ROUGHNESS = 0.05;

// Share of light that one reflection gives back: x f0 + y.
vec2 gloss_table(float cos_o, float roughness) {
    const float last = float(GLOSS_TABLE_SIDE - 1u);
    const vec2 at = clamp(vec2(sqrt(cos_o), roughness), 0.0, 1.0) * last;
    const uvec2 low = min(uvec2(at), GLOSS_TABLE_SIDE - 2u);
    const vec2 part = at - vec2(low);
    const uint i = low.x + GLOSS_TABLE_SIDE * low.y;
    GlossTableRef table = params.scene.at[0].gloss_table;
    return mix(mix(table.at[i], table.at[i + 1u], part.x),
               mix(table.at[i + GLOSS_TABLE_SIDE], table.at[i + GLOSS_TABLE_SIDE + 1u], part.x), part.y);
}

// Smith's function: unseen over seen area of the facets towards a direction with this cosine.
float ggx_lambda(float cos_theta, float width) {
    const float c2 = cos_theta * cos_theta;
    return 0.5 * (sqrt(1.0 + width * width * max(1.0 - c2, 0.0) / c2) - 1.0);
}

// Density of facets about h, per solid angle and projected area. The sine comes from the cross product:
// 1 - cos^2 would have no digits left in a sharp peak.
float ggx_facets(vec3 n, vec3 h, float width) {
    const vec3 across = cross(n, h);
    const float c = dot(n, h), w2 = width * width;
    const float d = dot(across, across) + c * c * w2;
    return w2 / (PI * d * d);
}

// A facet that wo sees, by the projection of a cap (Dupuy and Benyoub 2023). Density
// facets(h) max(0, wo h) / (wo n (1 + lambda(wo))), per solid angle of h.
vec3 sample_ggx(vec3 n, vec3 wo, float width, vec2 u) {
    const mat3 local = frame(n);
    const vec3 o = wo * local; // to local coordinates
    const vec3 stretched = normalize(vec3(o.xy * width, o.z));
    const float phi = 2.0 * PI * u.x;
    const float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    const float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    const vec3 h = vec3(r * cos(phi), r * sin(phi), z) + stretched;
    return local * normalize(vec3(h.xy * width, max(h.z, 1e-12)));
}
