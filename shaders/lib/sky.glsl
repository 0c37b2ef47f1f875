// What the sky shows by direction. Needs bindings.glsl and surface.glsl.

const float BACK_SPEED = 8.0;
const float FRONT_SPEED = 16.0;

// Texels of a tile that the engine's coordinates count, whatever the size of the texture.
const float SKY_TILE = 128.0;

// Texel of a layer that scrolls at `speed` tile texels per second, on Quake's flattened dome.
vec4 sky_texel(uint layer, vec3 direction, float speed) {
    const vec3 d = direction * vec3(1.0, 1.0, 3.0);
    const vec2 uv = params.time * speed + d.xy * (378.0 * inversesqrt(dot(d, d)));
    const ivec2 size = textureSize(textures[nonuniformEXT(layer)], 0);
    return fetch(layer, uv * vec2(size) / SKY_TILE, size.x, size.y);
}

// Texel of a skybox: the nearest, and at the edges of a side its last one.
vec4 sky_box_texel(vec3 d) {
    const vec3 far = abs(d);
    uint side;
    vec3 on; // across, up, distance of the side
    if (far.x >= far.y && far.x >= far.z) {
        side = d.x > 0.0 ? 0u : 2u;
        on = vec3(d.x > 0.0 ? -d.y : d.y, d.z, far.x);
    } else if (far.y >= far.z) {
        side = d.y > 0.0 ? 1u : 3u;
        on = vec3(d.y > 0.0 ? d.x : -d.x, d.z, far.y);
    } else {
        side = d.z > 0.0 ? 4u : 5u;
        on = vec3(-d.y, d.z > 0.0 ? -d.x : d.x, far.z);
    }
    const vec2 place = 0.5 + vec2(0.5, -0.5) * on.xy / on.z;
    const uint texture_index = params.scene.at[0].sky_back + side;
    const ivec2 size = textureSize(textures[nonuniformEXT(texture_index)], 0);
    const ivec2 texel = clamp(ivec2(place * vec2(size)), ivec2(0), size - 1);
    return texelFetch(textures[nonuniformEXT(texture_index)], texel, 0);
}

// Radiance of the picture.
vec3 sky_picture(vec3 direction) {
    const vec3 scale =
        direction.z < 0.0 ? params.scene.at[0].sky_lower : params.scene.at[0].sky_upper;
    if (SKY_KIND == SKY_FLAT) return scale * params.scene.at[0].sky_radiance;
    if (SKY_KIND == SKY_BOX) return scale * srgb_to_linear(sky_box_texel(direction).rgb);
    if (SKY_KIND == SKY_SCROLLING) {
        vec4 texel = sky_texel(params.scene.at[0].sky_front, direction, FRONT_SPEED);
        if (texel.a == 0.0) {
            texel = sky_texel(params.scene.at[0].sky_back, direction, BACK_SPEED);
        }
        return scale * srgb_to_linear(texel.rgb);
    }
    return vec3(0.0);
}

// Radiance of the picture and of fog before it.
vec3 sky_radiance(vec3 direction) {
    if (!HAS_FOG) return sky_picture(direction);
    const vec3 veil =
        direction.z < 0.0 ? params.scene.at[0].veil_lower : params.scene.at[0].veil_upper;
    return sky_picture(direction) + veil;
}

// Whether a sun's disc is seen in a direction. By the distance of two points on the unit sphere: their
// cosine has lost the digits that tell small suns apart.
bool is_in_sun(Sun sun, vec3 direction) {
    const vec3 off = direction - sun.direction;
    return dot(off, off) <= 2.0 * sun.one_minus_cos;
}
