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
