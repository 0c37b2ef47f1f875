// Radiance of the sky by direction. Needs bindings.glsl and surface.glsl.

const float BACK_SPEED = 8.0;
const float FRONT_SPEED = 16.0;

// Quake's flattened dome: texel coordinates of a layer that scrolls at `speed` texels per second.
vec2 sky_uv(vec3 direction, float speed) {
    const vec3 d = direction * vec3(1.0, 1.0, 3.0);
    return params.time * speed + d.xy * (378.0 * inversesqrt(dot(d, d)));
}

vec3 sky_radiance(vec3 direction) {
    if (SKY_KIND == SKY_FLAT) return params.scene.at[0].sky_radiance;
    if (SKY_KIND == SKY_SCROLLING) {
        const uint back = params.scene.at[0].sky_back, front = params.scene.at[0].sky_front;
        const ivec2 back_size = textureSize(textures[nonuniformEXT(back)], 0);
        const ivec2 front_size = textureSize(textures[nonuniformEXT(front)], 0);
        vec4 texel = fetch(front, sky_uv(direction, FRONT_SPEED), front_size.x, front_size.y);
        if (texel.a == 0.0) {
            texel = fetch(back, sky_uv(direction, BACK_SPEED), back_size.x, back_size.y);
        }
        return params.scene.at[0].sky_scale * srgb_to_linear(texel.rgb);
    }
    return vec3(0.0);
}
