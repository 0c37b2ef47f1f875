// Choosing a light and a point on it. Needs bindings.glsl, sampling.glsl, surface.glsl, sky.glsl.

struct LightSample {
    vec3 wi;           // unit direction to the light
    float t_max;       // length of the shadow ray, short of the light itself
    vec3 emission;     // Le towards the shaded point; 0 if there is nothing to gain
    float pdf;         // solid angle, choice of the light included
    bool hittable;     // whether a ray in this direction would find the light too
};

// Solid-angle density with which sample_light chooses a point of a triangle with this emission weight
// and area.
float pdf_light(float emission_weight, float area, float squared_distance, float cos_light) {
    float pdf_area = emission_weight * params.scene.at[0].inv_total_weight;
    if (SELECTION == SELECTION_UNIFORM) {
        pdf_area = emission_weight > 0.0 ? 1.0 / (float(params.scene.at[0].entry_count) * area) : 0.0;
    }
    return pdf_area * squared_distance / max(abs(cos_light), 1e-12);
}

LightSample sample_emissive_triangle(uint index, vec3 from, vec2 u) {
    const Triangle t = params.scene.at[0].emitters.at[index];
    const Material material = params.scene.at[0].materials.at[t.material];
    const vec2 b = sample_triangle(u);
    // Differences to the shaded point first: the direction keeps its digits at a distance.
    const vec3 to_light = (t.p0 - from) * (1.0 - b.x - b.y) + (t.p1 - from) * b.x + (t.p2 - from) * b.y;
    const float squared = dot(to_light, to_light);
    LightSample s;
    s.emission = vec3(0.0);
    s.hittable = true;
    if (!(squared > 0.0)) return s;
    const float distance = sqrt(squared);
    s.wi = to_light / distance;
    const float cos_light = -dot(t.normal, s.wi);
    const float area = SELECTION == SELECTION_UNIFORM
        ? 0.5 * length(cross(t.p1 - t.p0, t.p2 - t.p0)) : 0.0;
    s.pdf = pdf_light(material.emission_weight, area, squared, cos_light);
    // The light's own surface must not shadow it: stop short by its error bound.
    const float error = position_error(t.p0, t.p1, t.p2, HAS_INSTANCES);
    s.t_max = max(0.0, distance - error / max(abs(cos_light), 1e-3));
    if ((material.flags & MATERIAL_SKY) != 0u) {
        s.emission = sky_radiance(s.wi);
    } else if (cos_light > 0.0 || (material.flags & MATERIAL_TWO_SIDED) != 0u) {
        s.emission = emission_at(material, texel_uv(material, interpolate_uv(t, b)));
    }
    // A density that rounds to nothing can't be divided by.
    if (cos_light == 0.0 || !(s.pdf > 0.0)) s.emission = vec3(0.0);
    return s;
}

// A sphere, sampled in the cone it subtends. No ray hits it, so its samples stand alone.
LightSample sample_point_light(uint index, vec3 from, vec2 u) {
    const Light light = params.scene.at[0].lights.at[index];
    const vec3 to_centre = light.position - from;
    const float squared = dot(to_centre, to_centre);
    const float sin2 = light.radius * light.radius / squared;
    LightSample s;
    s.emission = vec3(0.0);
    s.hittable = false;
    if (!(sin2 < 1.0)) return s; // inside
    const float distance = sqrt(squared);
    const vec3 axis = to_centre / distance;
    const float cap = one_minus_cos(sin2);
    s.wi = sample_cone(axis, cap, u);
    const float probability = SELECTION == SELECTION_UNIFORM
        ? 1.0 / float(params.scene.at[0].entry_count) : light.probability;
    s.pdf = probability * pdf_cone(cap);
    // Distance to the near surface along wi.
    const float along = dot(to_centre, s.wi);
    const vec3 off = to_centre - along * s.wi;
    s.t_max = along - sqrt(max(0.0, light.radius * light.radius - dot(off, off)));
    float cone = 1.0;
    if (light.cos_outer >= -1.0) {
        const float c = dot(-axis, light.direction);
        const float width = light.cos_inner - light.cos_outer;
        cone = width > 0.0 ? clamp((c - light.cos_outer) / width, 0.0, 1.0)
                           : float(c >= light.cos_outer);
    }
    s.emission = light.intensity * (cone / (PI * light.radius * light.radius));
    return s;
}

// One light: x chooses the entry of the alias table, y keeps it or not, zw the point on it.
LightSample sample_light(vec3 from, vec4 u) {
    const uint count = params.scene.at[0].entry_count;
    uint entry = min(uint(u.x * float(count)), count - 1u);
    const AliasEntry alias = params.scene.at[0].alias.at[entry];
    if (SELECTION == SELECTION_POWER && u.y >= alias.keep) entry = alias.other;
    const uint triangles = params.scene.at[0].emitter_count;
    if (!HAS_POINT_LIGHTS || entry < triangles) return sample_emissive_triangle(entry, from, u.zw);
    return sample_point_light(entry - triangles, from, u.zw);
}
