// Points of emitters: which one a point belongs to, how one is chosen, and how densely. Needs
// bindings.glsl, sampling.glsl, surface.glsl.

// Sum of the parts of the texels above and left of a corner of a map's grid.
uint sum_to(EmissionMap map, uint x, uint y) {
    return params.scene.at[0].texel_tables.at[map.sums + y * (map.width + 1u) + x];
}

uint sum_of(EmissionMap map, uint x0, uint y0, uint x1, uint y1) {
    return sum_to(map, x1, y1) + sum_to(map, x0, y0) - sum_to(map, x0, y1) - sum_to(map, x1, y0);
}

// The rectangle of an emitter: x0, y0, x1, y1 in texels.
uvec4 rectangle_of(Emitter emitter) {
    return uvec4(emitter.rectangle.x & 0xffffu, emitter.rectangle.x >> 16u,
                 emitter.rectangle.y & 0xffffu, emitter.rectangle.y >> 16u);
}

// Which emitter a point belongs to, and the density per area with which its points are chosen.
struct EmitterPoint {
    uint number; // NO_EMITTER if there is none
    float pdf_area;
};

EmitterPoint emitter_at(Surface s) {
    const EmitterPoint none = EmitterPoint(NO_EMITTER, 0.0);
    if (s.source == NO_EMITTER) return none;
    const Source source = params.scene.at[0].sources.at[s.source];
    if (source.map == NO_MAP) {
        const float n = float(source.tiles.x);
        const vec2 b = s.barycentrics * n;
        const float row = floor(clamp(b.y, 0.0, n - 1.0));
        const float column = floor(clamp(b.x, 0.0, n - 1.0 - row));
        // In the last column of a row there is no upper half.
        const bool upper = b.x - column + b.y - row > 1.0 && column + row < n - 1.0;
        const uint part = uint(row * (2.0 * n - row) + 2.0 * column) + uint(upper);
        return EmitterPoint(source.first + part, n * n / s.area);
    }
    const EmissionMap map = params.scene.at[0].maps.at[source.map];
    const vec2 size = vec2(map.width, map.height);
    const vec2 tile = floor(s.uv / size);
    const uvec2 texel = min(uvec2(max(s.uv - tile * size, 0.0)), uvec2(map.width, map.height) - 1u);
    const uint label = params.scene.at[0].texel_tables.at[map.labels + texel.y * map.width + texel.x];
    if (label == 0u) return none;
    const uvec2 place = min(uvec2(max(tile - source.first_tile, 0.0)), source.tiles - 1u);
    const uint index = (place.y * source.tiles.x + place.x) * map.rectangles + label - 1u;
    const uint number = params.scene.at[0].emitter_numbers.at[source.first + index];
    if (number == NO_EMITTER) return none;
    const uvec4 r = rectangle_of(params.scene.at[0].emitters.at[number]);
    const float part = float(sum_of(map, texel.x, texel.y, texel.x + 1u, texel.y + 1u))
        / float(sum_of(map, r.x, r.y, r.z, r.w));
    return EmitterPoint(number, part * s.uv_area / s.area);
}

// A point of a rectangle of texels: a texel in proportion to its part, then a uniform point in it.
// First the row, then the texel in it; what is left of each number gives the place inside. `part` is
// the share of the texel chosen.
vec2 sample_texels(EmissionMap map, uvec4 r, vec2 u, out float part) {
    const uint above = sum_to(map, r.z, r.y) - sum_to(map, r.x, r.y);
    const uint total = sum_to(map, r.z, r.w) - sum_to(map, r.x, r.w) - above;
    uint target = min(uint(u.y * float(total)), total - 1u);
    uint low = r.y, high = r.w - 1u;
    while (low < high) { // the first row with more than `target` down to its end
        const uint middle = (low + high) / 2u;
        if (sum_to(map, r.z, middle + 1u) - sum_to(map, r.x, middle + 1u) - above > target) high = middle;
        else low = middle + 1u;
    }
    const uint y = low;
    const uint before_row = sum_to(map, r.z, y) - sum_to(map, r.x, y) - above;
    const uint row = sum_of(map, r.x, y, r.z, y + 1u);
    const float v = (float(target - before_row) + 0.5) / float(row);

    const uint left = sum_to(map, r.x, y + 1u) - sum_to(map, r.x, y);
    target = min(uint(u.x * float(row)), row - 1u);
    low = r.x;
    high = r.z - 1u;
    while (low < high) {
        const uint middle = (low + high) / 2u;
        if (sum_to(map, middle + 1u, y + 1u) - sum_to(map, middle + 1u, y) - left > target) high = middle;
        else low = middle + 1u;
    }
    const uint before = sum_to(map, low, y + 1u) - sum_to(map, low, y) - left;
    const uint texel = sum_of(map, low, y, low + 1u, y + 1u);
    part = float(texel) / float(total);
    return vec2(float(low) + (float(target - before) + 0.5) / float(texel), float(y) + v);
}

// A triangle that emits, world space: of the scene's own emitters, or of those of an instance that moves.
Triangle source_triangle(uint source, uint instance_word) {
    if (HAS_FRAMES && instance_word != NO_INSTANCE) {
        return triangle_in_world(instance_word, params.scene.at[0].source_indices.at[source]);
    }
    return params.scene.at[0].source_triangles.at[source];
}

// A point of an emitter: the triangle it lies on, in world space, and where. The density is per area;
// 0 if the texel chosen lies on none of its triangles.
float sample_emitter_point(Emitter emitter, uint instance_word, vec2 u, out Triangle t, out vec2 b) {
    t = source_triangle(emitter.first_source, instance_word);
    if (emitter.map == NO_MAP) {
        const float n = float(emitter.rectangle.x);
        b = sample_triangle(u);
        if (emitter.rectangle.y != 0u) b = 1.0 - b;
        b = (emitter.origin + b) / n;
        return n * n / (0.5 * length(cross(t.p1 - t.p0, t.p2 - t.p0)));
    }
    float part;
    const vec2 uv = emitter.origin
        + sample_texels(params.scene.at[0].maps.at[emitter.map], rectangle_of(emitter), u, part);
    for (uint i = 0u;;) {
        const vec2 e1 = t.uv1 - t.uv0, e2 = t.uv2 - t.uv0, p = uv - t.uv0;
        const float doubled = e1.x * e2.y - e1.y * e2.x;
        b = vec2(p.x * e2.y - p.y * e2.x, e1.x * p.y - e1.y * p.x) / doubled;
        if (b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0) {
            return part * abs(doubled) / length(cross(t.p1 - t.p0, t.p2 - t.p0));
        }
        if (++i == emitter.sources) return 0.0;
        t = source_triangle(emitter.first_source + i, instance_word);
    }
}
