// The tree over all lights: a light in proportion to what it may matter at a point. Needs bindings.glsl,
// rng.glsl.

// Cosine of the angle a - b, or 1 where b is more than a; from their cosines and sines.
float cos_of_difference(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 1.0 : cos_a * cos_b + sin_a * sin_b;
}

float sin_of(float cosine) { return sqrt(max(0.0, 1.0 - cosine * cosine)); }

// How much a group may matter at a point: its weight over squared distance, times the cosine of the
// least angle between a direction its lights face and one from its bounds to the point.
float importance(TreeNode node, vec3 from) {
    const vec3 to_point = from - node.centre;
    const float squared = dot(to_point, to_point);
    const float weight = node.weight / max(max(squared, node.radius2), 1e-30);
    if (node.cos_cone <= -1.0 || squared <= node.radius2) return weight;
    const float cos_away = clamp(dot(node.axis, to_point) * inversesqrt(squared), -1.0, 1.0);
    const float sin_away = sin_of(cos_away), sin_cone = sin_of(node.cos_cone);
    const float cos_rest = cos_of_difference(cos_away, sin_away, node.cos_cone, sin_cone);
    const float sin_rest = cos_away > node.cos_cone
        ? 0.0 : sin_away * node.cos_cone - cos_away * sin_cone;
    const float sin2_bounds = node.radius2 / squared;
    return weight * max(0.0, cos_of_difference(cos_rest, sin_rest, sqrt(1.0 - sin2_bounds), sqrt(sin2_bounds)));
}

// Probability to take the second child of a group; below 0 if neither can light the point.
float share_of_second(uint at, uint child, vec3 from) {
    const float first = importance(params.scene.at[0].tree.at[at + 1u], from);
    const float second = importance(params.scene.at[0].tree.at[child], from);
    const float both = first + second;
    return both > 0.0 ? second / both : -1.0;
}

// Numbers for one way down: a number is stretched over the levels until 16 of its 24 bits are left,
// then comes the next.
struct Levels {
    float u;
    float probability; // of what this number has chosen
    float next;
    uint state;
};

float next_number(inout Levels levels) {
    const float u = levels.next;
    levels.state = pcg4d(uvec4(levels.state, floatBitsToUint(u), 0u, 0u)).x;
    levels.next = float(levels.state >> 8u) * (1.0 / 16777216.0);
    return u;
}

// A light by two numbers; NO_EMITTER if none can light the point. `probability` is that of the light.
uint sample_tree(vec3 from, vec2 u, out float probability) {
    Levels levels = Levels(u.x, 1.0, u.y, floatBitsToUint(u.x));
    probability = 1.0;
    uint at = 0u;
    for (;;) {
        const uint child = params.scene.at[0].tree.at[at].child;
        if ((child & LEAF) != 0u) return child & ~LEAF;
        const float share = share_of_second(at, child, from);
        if (share < 0.0) return NO_EMITTER;
        const bool second = levels.u < share;
        const float chosen = second ? share : 1.0 - share;
        levels.u = (second ? levels.u : levels.u - share) / chosen;
        levels.probability *= chosen;
        if (levels.probability < 1.0 / 256.0) {
            levels.u = next_number(levels);
            levels.probability = 1.0;
        }
        probability *= chosen;
        at = second ? child : at + 1u;
    }
}

// Probability with which sample_tree comes to a light.
float tree_probability(vec3 from, uint light) {
    uint trail = params.scene.at[0].trails.at[light];
    if (trail == NO_TRAIL) return 0.0;
    float probability = 1.0;
    uint at = 0u;
    for (;;) {
        const uint child = params.scene.at[0].tree.at[at].child;
        if ((child & LEAF) != 0u) return probability;
        const float share = share_of_second(at, child, from);
        if (share < 0.0) return 0.0;
        const bool second = (trail & 1u) != 0u;
        probability *= second ? share : 1.0 - share;
        at = second ? child : at + 1u;
        trail >>= 1u;
    }
}
