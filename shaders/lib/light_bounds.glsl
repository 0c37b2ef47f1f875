// What a light may add at a point, guessed from where it is and how it shines. Needs bindings.glsl, light.glsl.

// Cosine of the angle to a plane, of a point at this height over it and at this distance: at most 1 with
// what slack adds for the size of what is seen.
float cosine_within(float height, float slack, float distance) { return min((height + slack) / distance, 1.0); }

// Luminance that a light may add at a point of a surface with the normal n; above 0 wherever it adds
// something. LightBounds in the scene crate has the formula.
float guess(LightBounds light, vec3 from, vec3 n) {
    if (light.shine == SHINE_DISTANT) return light.weight * clamp(dot(n, light.axis) + light.radius, 0.0, 1.0);
    const vec3 to_centre = light.centre - from;
    const float squared = max(dot(to_centre, to_centre), light.radius * light.radius);
    const float distance = sqrt(squared);
    const float height = -dot(light.axis, to_centre);
    float there = 1.0;
    if (light.shine == SHINE_CONE) {
        there = spot_factor(light.cos_inner, light.cos_outer, height * inversesqrt(dot(to_centre, to_centre)));
    } else if (light.shine != SHINE_ALL_ROUND) {
        there = light.shine == SHINE_FRONT && height <= 0.0
            ? 0.0 : cosine_within(abs(height), 0.25 * light.radius, distance);
    }
    return light.weight * max(cosine_within(dot(n, to_centre), light.radius, distance), 0.0) * there / squared;
}
