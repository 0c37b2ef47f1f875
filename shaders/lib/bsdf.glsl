// How surfaces scatter light. Needs bindings.glsl, math.glsl, sampling.glsl, surface.glsl, gloss.glsl.

// Scattering at a point as seen from wo. Where the scene has no gloss, no normal maps and no smooth normals it is
// Lambert's with the face's normal, and the rest is not in the shader.
const bool HAS_SHADING_NORMALS = HAS_NORMAL_MAPS || HAS_SMOOTH_NORMALS;

struct Bsdf {
    vec3 n;      // unit, for shading
    vec3 face;   // unit normal of the face; both are on the viewer's side
    vec3 body;   // albedo of the Lambertian part
    vec3 f0;     // reflectance of the facets straight on
    vec3 gain;   // what the facets' light is scaled by, for what they reflect more than once
    vec3 round;  // unit normal of the round surface that a facet stands for; the face's elsewhere
    float width; // of GGX; 0 without gloss
    float share; // probability of choosing the facets
};

// Normal as the picture says, in the space of a triangle's texture coordinates and of `face`, the normal without the
// picture; that where those have none.
vec3 bumped_normal(Triangle t, vec3 face, vec3 texel) {
    const vec3 e1 = t.p1 - t.p0, e2 = t.p2 - t.p0;
    const vec2 d1 = t.uv1 - t.uv0, d2 = t.uv2 - t.uv0;
    const float det = d1.x * d2.y - d1.y * d2.x;
    if (det == 0.0) return face;
    vec3 along = (e1 * d2.y - e2 * d1.y) * sign(det);
    vec3 down = (e2 * d1.x - e1 * d2.x) * sign(det);
    along -= face * dot(face, along);
    down -= face * dot(face, down);
    if (!(dot(along, along) > 0.0) || !(dot(down, down) > 0.0)) return face;
    along = normalize(along);
    down = normalize(down);
    const vec3 m = (texel * 255.0 - 128.0) / 127.0;
    const vec3 n = along * m.x - down * m.y + face * max(m.z, 0.05);
    return normalize(n);
}

// A shading normal that the viewer sees: bent towards wo if it would be below its horizon.
vec3 seen_normal(vec3 n, vec3 wo) {
    const float c = dot(n, wo);
    return c < 0.02 ? normalize(n + wo * (0.02 - c)) : n;
}

Bsdf bsdf_at(Surface s, uint instance_word, uint triangle, vec3 n, vec3 wo) {
    Bsdf b = Bsdf(n, n, s.albedo, vec3(0.0), vec3(1.0), n, 0.0, 0.0);
    const bool bumped = HAS_NORMAL_MAPS && (s.flags & MATERIAL_BUMPED) != 0u;
    const bool glossy = HAS_GLOSS && (s.flags & MATERIAL_GLOSSY) != 0u;
    const vec3 smooth_front = smooth_normal(instance_word, triangle, s.barycentrics, s.normal);
    if (HAS_SMOOTH_NORMALS && any(notEqual(smooth_front, s.normal))) {
        b.round = dot(n, s.normal) < 0.0 ? -smooth_front : smooth_front;
        b.n = seen_normal(b.round, wo);
    }
    if (!bumped && !glossy) return b;
    const Triangle t = triangle_in_world(instance_word, triangle);
    const Material material = params.scene.at[0].materials.at[t.material];
    const Finish finish = params.scene.at[0].finishes.at[t.material];
    const vec2 uv = texel_uv(material, interpolate_uv(t, s.barycentrics));
    if (bumped) {
        const vec3 texel = fetch(finish.normals, uv, material.width, material.height).rgb;
        const vec3 shading = bumped_normal(t, smooth_front, texel);
        b.n = seen_normal(dot(n, t.normal) < 0.0 ? -shading : shading, wo);
    }
    if (glossy) {
        float roughness = finish.roughness;
        if (finish.roughness_map != NO_TEXTURE) {
            roughness *= fetch(finish.roughness_map, uv, material.width, material.height).r;
        }
        roughness = clamp(roughness, MIN_ROUGHNESS, 1.0);
        b.width = roughness * roughness;
        b.f0 = mix(vec3(0.08 * finish.specular), s.albedo, finish.metallic);
        const vec2 once = gloss_table(max(dot(b.n, wo), 0.0), roughness);
        b.gain = 1.0 + b.f0 * (1.0 / (once.x + once.y) - 1.0);
        const vec3 facets = b.gain * (b.f0 * once.x + once.y);
        b.body *= (1.0 - finish.metallic) * max(1.0 - facets, 0.0);
        const float body = luminance(b.body), whole = body + luminance(facets);
        b.share = body > 0.0 ? clamp(1.0 - body / whole, 0.1, 0.9) : 1.0;
    }
    return b;
}

// What is left of the light from wi that a facet hides and the round surface it stands for does not: it goes to 0 at
// the facet's horizon, smoothly, instead of ending there (Chiang, Li and Burley, "Taming the Shadow Terminator", 2019).
float terminator(Bsdf b, vec3 wi) {
    if (!HAS_SMOOTH_NORMALS) return 1.0;
    const float seen = dot(b.round, wi) * dot(b.round, b.face);
    const float here = dot(b.face, wi);
    if (!(seen > 0.0) || here >= seen) return 1.0;
    const float ratio = here / seen;
    return ratio * (1.0 + ratio * (1.0 - ratio));
}

// BSDF times the cosine, towards wi; nothing below the face's horizon, whatever the shading normal.
vec3 eval_bsdf(Bsdf b, vec3 wo, vec3 wi) {
    const float cos_i = dot(b.n, wi);
    if (!(cos_i > 0.0) || HAS_SHADING_NORMALS && !(dot(b.face, wi) > 0.0)) return vec3(0.0);
    vec3 f = b.body * (cos_i / PI);
    if (HAS_GLOSS && b.width > 0.0) {
        const float cos_o = max(dot(b.n, wo), 1e-4);
        const vec3 h = normalize(wo + wi);
        const float grazing = pow(clamp(1.0 - dot(wo, h), 0.0, 1.0), 5.0);
        const vec3 fresnel = mix(b.f0, vec3(1.0), grazing);
        const float seen = 1.0 + ggx_lambda(cos_o, b.width) + ggx_lambda(cos_i, b.width);
        f += b.gain * fresnel * (ggx_facets(b.n, h, b.width) / (4.0 * cos_o * seen));
    }
    return f * terminator(b, wi);
}

// Solid-angle density of sample_bsdf.
float pdf_bsdf(Bsdf b, vec3 wo, vec3 wi) {
    const float cos_i = dot(b.n, wi);
    const float body = pdf_cosine_hemisphere(cos_i);
    if (!HAS_GLOSS || !(b.width > 0.0)) return body;
    if (!(cos_i > 0.0)) return 0.0;
    const float cos_o = max(dot(b.n, wo), 1e-4);
    const float facets = ggx_facets(b.n, normalize(wo + wi), b.width)
        / (4.0 * cos_o * (1.0 + ggx_lambda(cos_o, b.width)));
    return mix(body, facets, b.share);
}

// A direction, its density, and BSDF times cosine over that; 0 for directions into the surface.
vec3 sample_bsdf(Bsdf b, vec3 wo, vec3 u, out vec3 weight, out float pdf) {
    if (HAS_GLOSS && u.z < b.share) {
        const vec3 wi = reflect(-wo, sample_ggx(b.n, wo, b.width, u.xy));
        pdf = pdf_bsdf(b, wo, wi);
        weight = pdf > 0.0 ? eval_bsdf(b, wo, wi) / pdf : vec3(0.0);
        return wi;
    }
    const vec3 wi = sample_cosine_hemisphere(b.n, u.xy);
    pdf = pdf_bsdf(b, wo, wi);
    // Lambert alone: cos / pi / pdf = 1.
    weight = b.body * terminator(b, wi);
    if (HAS_GLOSS && b.width > 0.0) weight = pdf > 0.0 ? eval_bsdf(b, wo, wi) / pdf : vec3(0.0);
    else if (HAS_SHADING_NORMALS && !(dot(b.face, wi) > 0.0)) weight = vec3(0.0);
    return wi;
}
