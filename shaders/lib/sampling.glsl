// Distributions of directions and points. Each states its measure; `pdf_` is per that measure.

// Uniform point on the unit sphere.
vec3 sample_sphere(vec2 u) {
    const float z = 1.0 - 2.0 * u.x;
    const float r = sqrt(max(0.0, 1.0 - z * z));
    const float phi = 2.0 * PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), z);
}

// Cosine-distributed direction about the unit normal n: the normal plus a point on the unit sphere.
// Solid angle; the cosine is in the density.
vec3 sample_cosine_hemisphere(vec3 n, vec2 u) {
    const vec3 d = n + sample_sphere(u);
    const float squared = dot(d, d);
    // The point opposite the normal has no direction: the normal stands in for it.
    return squared > 1e-10 ? d * inversesqrt(squared) : n;
}

float pdf_cosine_hemisphere(float cos_theta) { return max(cos_theta, 0.0) / PI; }

// Uniform direction in the hemisphere about n. Solid angle.
vec3 sample_uniform_hemisphere(vec3 n, vec2 u) {
    const vec3 d = sample_sphere(u);
    return dot(d, n) < 0.0 ? -d : d;
}

float pdf_uniform_hemisphere() { return 1.0 / (2.0 * PI); }

// Uniform point of the disc of radius 1, by a map that keeps what is near together (Shirley and Chiu
// 1997). Area.
vec2 sample_disk(vec2 u) {
    const vec2 p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) return vec2(0.0);
    const bool wide = abs(p.x) > abs(p.y);
    const float r = wide ? p.x : p.y;
    const float angle = wide ? PI / 4.0 * (p.y / p.x) : PI / 2.0 - PI / 4.0 * (p.x / p.y);
    return r * vec2(cos(angle), sin(angle));
}

// Uniform barycentric coordinates (of the second and third corner). Area.
vec2 sample_triangle(vec2 u) {
    const float s = sqrt(u.x);
    return vec2(s * (1.0 - u.y), s * u.y);
}

// Two unit vectors that make a right-handed frame with the unit vector n (Duff et al., "Building an
// Orthonormal Basis, Revisited", JCGT 6(1), 2017).
mat3 frame(vec3 n) {
    const float s = n.z >= 0.0 ? 1.0 : -1.0;
    const float a = -1.0 / (s + n.z);
    const float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// 1 - cos of the half angle under which a sphere is seen, from the squared sine of that angle; this
// form keeps its digits for small spheres.
float one_minus_cos(float sin2) { return sin2 / (1.0 + sqrt(max(0.0, 1.0 - sin2))); }

// Uniform direction in the cone about the unit axis with the given 1 - cos of its half angle.
// Solid angle.
vec3 sample_cone(vec3 axis, float one_minus_cos_max, vec2 u) {
    const float h = u.x * one_minus_cos_max;
    const float r = sqrt(max(0.0, h * (2.0 - h)));
    const float phi = 2.0 * PI * u.y;
    return frame(axis) * vec3(r * cos(phi), r * sin(phi), 1.0 - h);
}

float pdf_cone(float one_minus_cos_max) { return 1.0 / (2.0 * PI * one_minus_cos_max); }

// Balance heuristic (Veach 1997) for one sample of each of two techniques. 0 for a sample that could
// not have been drawn: both densities may be 0 at grazing angles.
float mis_weight(float pdf, float other) { return pdf > 0.0 ? pdf / (pdf + other) : 0.0; }
