// How surfaces scatter light. Needs bindings.glsl, math.glsl.

// Share of unpolarised light that a smooth interface of relative index eta >= 1 reflects, met from the
// side of the lower index: Fresnel's equations.
float fresnel_dielectric(float cos_i, float eta) {
    const float c = clamp(cos_i, 0.0, 1.0);
    const float t = sqrt(max(0.0, 1.0 - (1.0 - c * c) / (eta * eta)));
    const float perpendicular = c + eta * t, parallel = eta * c + t;
    // Grazing, with nothing to refract: an index of 1 reflects nothing.
    if (!(perpendicular > 0.0)) return eta > 1.0 ? 1.0 : 0.0;
    const float s = (c - eta * t) / perpendicular;
    const float p = (eta * c - t) / parallel;
    return 0.5 * (s * s + p * p);
}
