// What instances have besides their place: skins and poses. Needs bindings.glsl.

// The triangle in its mesh's space, in the pose and the skin of an instance.
Triangle triangle_of(uint instance_word, uint triangle) {
    Triangle t = params.scene.at[0].triangles.at[triangle];
    const uint number = instance_word & INSTANCE_INDEX;
    if ((HAS_POSES || HAS_SKINS) && number != 0u) {
        const Figure figure = params.scene.at[0].figures.at[number];
        if (HAS_SKINS && figure.skin != NO_SKIN) t.material = figure.skin;
        if (HAS_POSES && (instance_word & INSTANCE_POSED) != 0u) {
            const uint corner = 3u * (figure.posed + triangle);
            t.p0 = params.scene.at[0].posed_corners.at[corner];
            t.p1 = params.scene.at[0].posed_corners.at[corner + 1u];
            t.p2 = params.scene.at[0].posed_corners.at[corner + 2u];
            const vec3 across = cross(t.p1 - t.p0, t.p2 - t.p0);
            const float squared = dot(across, across);
            if (squared > 0.0) t.normal = across * inversesqrt(squared);
        }
    }
    return t;
}

uint material_of(uint instance_word, uint triangle) {
    const uint number = instance_word & INSTANCE_INDEX;
    if (HAS_SKINS && number != 0u) {
        const uint skin = params.scene.at[0].figures.at[number].skin;
        if (skin != NO_SKIN) return skin;
    }
    return params.scene.at[0].triangles.at[triangle].material;
}

// Probability with which light sampling chooses an instance that moves; below 0 if it does not move.
float moving_probability(uint instance_word) {
    const uint number = instance_word & INSTANCE_INDEX;
    if (!HAS_FRAMES || number == 0u) return -1.0;
    return params.scene.at[0].figures.at[number].probability;
}

// Unit vector of octahedral coordinates.
vec3 unpack_normal(uint packed) {
    const vec2 p = unpackSnorm2x16(packed);
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
    return normalize(n);
}

// Unit normal to the front, world space, that a facet of a model is shaded with; `face`, the facet's own, if
// it is flat.
vec3 smooth_normal(uint instance_word, uint triangle, vec2 barycentrics, vec3 face) {
    const uint number = instance_word & INSTANCE_INDEX;
    if (!HAS_SMOOTH_NORMALS || number == 0u) return face;
    const Figure figure = params.scene.at[0].figures.at[number];
    if (figure.smooth_shaded == 0u) return face;
    const vec3 weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec3 n = vec3(0.0);
    for (uint corner = 0u; corner < 3u; corner++) {
        const uint from = 3u * (figure.normals_from + triangle) + corner;
        const uint to = 3u * (figure.normals_to + triangle) + corner;
        n += weights[corner]
            * mix(unpack_normal(params.scene.at[0].normals.at[from]),
                  unpack_normal(params.scene.at[0].normals.at[to]), figure.fraction);
    }
    if (dot(n, n) < 1e-12) return face;
    return (instance_word & INSTANCE_PLACED) != 0u ? placed_normal(to_world(instance_word), n) : normalize(n);
}
