// Where what is seen was in the picture before. Needs surface.glsl.

// Where a point of an instance was, or of the loose triangles behind them.
vec3 position_before(uint number, uint triangle, vec2 barycentrics) {
    const Past past = params.scene.at[0].pasts.at[number];
    if ((past.flags & PAST_LOOSE) != 0u) {
        const uint corner = 3u * (past.posed + triangle);
        return interpolate(params.scene.at[0].loose_corners.at[corner],
                           params.scene.at[0].loose_corners.at[corner + 1u],
                           params.scene.at[0].loose_corners.at[corner + 2u], barycentrics);
    }
    Triangle t = params.scene.at[0].triangles.at[triangle];
    if (HAS_POSES && (past.flags & PAST_POSED) != 0u) {
        const uint corner = 3u * (past.posed + triangle);
        t.p0 = params.scene.at[0].posed_corners.at[corner];
        t.p1 = params.scene.at[0].posed_corners.at[corner + 1u];
        t.p2 = params.scene.at[0].posed_corners.at[corner + 2u];
    }
    const mat4x3 place = transpose(mat3x4(past.row0, past.row1, past.row2));
    return interpolate(place * vec4(t.p0, 1.0), place * vec4(t.p1, 1.0), place * vec4(t.p2, 1.0),
                       barycentrics);
}

// Where a pinhole shows what lies in a direction, as x and y of the image plane; z is the depth.
vec3 project(vec3 direction, vec3 forward, vec3 right, vec3 up) {
    const float depth = dot(direction, forward);
    const float x = dot(direction, right) / (dot(right, right) * depth);
    const float y = dot(direction, up) / (dot(up, up) * depth);
    return vec3(x, y, depth);
}

// Farthest from the middle of the picture before that a point is said to have been, in halves of the
// picture: what was beside the eye has no place, and would spoil means.
const float MOTION_REACH = 8.0;

// From where a point is to where the picture before had it, in pixels to the right and down. The sky is
// infinitely far: it moves with the camera's direction alone.
vec2 motion_of(Surface s, uint instance_word, uint triangle, vec3 direction) {
    if (params.scene.at[0].has_before == 0u) return vec2(0.0);
    SceneRef scene = params.scene;
    const vec3 then_forward = scene.at[0].before_forward;
    const vec3 then_right = scene.at[0].before_right, then_up = scene.at[0].before_up;
    vec3 now = direction, then = direction;
    if ((s.flags & MATERIAL_SKY) == 0u) {
        const uint number = instance_word & INSTANCE_INDEX;
        vec3 was = s.position;
        if (number != 0u && (scene.at[0].pasts.at[number].flags & PAST_MOVED) != 0u) {
            was = position_before(number, triangle, s.barycentrics);
        }
        now = s.position - params.origin;
        then = was - scene.at[0].before_origin;
    }
    const vec3 a = project(now, params.forward, params.right, params.up);
    const vec3 b = project(then, then_forward, then_right, then_up);
    if (!(a.z > 0.0 && b.z > 0.0)) return vec2(0.0);
    const vec2 held = clamp(b.xy, -MOTION_REACH, MOTION_REACH);
    return (held - a.xy) * vec2(0.5, -0.5) * vec2(gl_LaunchSizeEXT.xy);
}
