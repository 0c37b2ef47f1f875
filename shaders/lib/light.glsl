// Choosing a light and a point on it. Needs bindings.glsl, sampling.glsl, surface.glsl, emitter.glsl,
// light_tree.glsl, sky.glsl.

struct LightSample {
    vec3 wi;           // unit direction to the light
    float t_max;       // length of the shadow ray, short of the light itself
    vec3 emission;     // Le towards the shaded point; 0 if there is nothing to gain
    float pdf;         // solid angle, choice of the light included
    bool hittable;     // whether a ray in this direction would find the light too
    bool sun;          // seen where a sky face is the first thing hit, whatever its distance
    float angle_scale; // share of the cosine, of compiler lights alone
    uint number;       // of the point light; NO_EMITTER for others
};

const LightSample NO_SAMPLE =
    LightSample(vec3(0.0), 0.0, vec3(0.0), 0.0, false, false, 1.0, NO_EMITTER);

// What a compiler light makes of a cosine above 0, as a factor of it.
float cosine_factor(LightSample light, float cosine) {
    return HAS_COMPILER_LIGHTS ? mix(1.0, cosine, light.angle_scale) / cosine : 1.0;
}

// The cell a point lies in; its list says which lights matter there.
uint cell_at(vec3 point) {
    if (SELECTION != SELECTION_LEAF) return 0u;
    uint at = 0u;
    do {
        const CellNode node = params.scene.at[0].cell_nodes.at[at];
        at = dot(node.normal, point) > node.distance ? node.front : node.back;
    } while ((at & CELL) == 0u);
    return at & ~CELL;
}

// Probability with which a cell's list chooses an emitter: the list rises by emitter.
float list_probability(Cell cell, uint emitter) {
    uint begin = cell.begin, end = cell.begin + cell.count;
    while (begin < end) {
        const uint middle = (begin + end) / 2u;
        const CellEntry entry = params.scene.at[0].cell_entries.at[middle];
        if (entry.emitter == emitter) return entry.probability;
        if (entry.emitter < emitter) begin = middle + 1u;
        else end = middle;
    }
    return 0.0;
}

// Whether there is anything to choose from.
bool has_lights() {
    return params.scene.at[0].entry_count > 0u
        || HAS_FRAMES && params.scene.at[0].moving_share > 0.0;
}

// Probability with which one of the scene's own lights is chosen, and not one that moves.
float own_share() { return HAS_FRAMES ? 1.0 - params.scene.at[0].moving_share : 1.0; }

// Probability with which an emitter is chosen among the scene's own at a point in a cell.
float probability_among_own(uint cell_index, vec3 from, uint emitter, float power) {
    if (SELECTION == SELECTION_TREE) return tree_probability(from, emitter);
    if (SELECTION == SELECTION_UNIFORM) return 1.0 / float(params.scene.at[0].entry_count);
    if (SELECTION != SELECTION_LEAF) return power;
    const Cell cell = params.scene.at[0].cells.at[cell_index];
    if (cell.count == 0u) return tree_probability(from, emitter);
    return mix(list_probability(cell, emitter), power, params.scene.at[0].cell_fallback);
}

// Probability with which choose_entry chooses one of the scene's own emitters at a point in a cell;
// `power` is that of the table over all of them.
float choice_probability(uint cell_index, vec3 from, uint emitter, float power) {
    return own_share() * probability_among_own(cell_index, from, emitter, power);
}

// Share of the power that the light with this number has among the scene's own.
float power_of(uint chosen) { return params.scene.at[0].light_bounds.at[chosen].probability; }

// Solid-angle density with which a light sample at a point in a cell has a point of a surface seen
// from a distance.
float pdf_light(uint cell, vec3 from, Surface s, float squared_distance, float cos_light) {
    const EmitterPoint point = emitter_at(s);
    if (point.number == NO_EMITTER) return 0.0;
    const float power = params.scene.at[0].emitters.at[point.number].probability;
    const float probability = HAS_FRAMES && s.moving >= 0.0
        ? s.moving * power : choice_probability(cell, from, point.number, power);
    return probability * point.pdf_area * squared_distance / max(abs(cos_light), 1e-12);
}

// `chosen` is the probability of the choice where the choice told it, by the tree or of what moves; else
// below 0. The emitter is one of an instance that moves, or of NO_INSTANCE.
LightSample sample_emitter(uint number, uint instance_word, float chosen, uint cell, vec3 from, vec2 u) {
    const Emitter emitter = params.scene.at[0].emitters.at[number];
    LightSample s;
    s.emission = vec3(0.0);
    s.hittable = true;
    s.number = NO_EMITTER;
    s.sun = false;
    Triangle t;
    vec2 b;
    const float pdf_area = sample_emitter_point(emitter, instance_word, u, t, b);
    if (!(pdf_area > 0.0)) return s;
    const Material material = params.scene.at[0].materials.at[t.material];
    // Differences to the shaded point first: the direction keeps its digits at a distance.
    const vec3 to_light = (t.p0 - from) * (1.0 - b.x - b.y) + (t.p1 - from) * b.x + (t.p2 - from) * b.y;
    const float squared = dot(to_light, to_light);
    if (!(squared > 0.0)) return s;
    const float distance = sqrt(squared);
    s.wi = to_light / distance;
    const float cos_light = -dot(t.normal, s.wi);
    const float probability = chosen >= 0.0
        ? chosen : choice_probability(cell, from, number, emitter.probability);
    s.pdf = probability * pdf_area * squared / max(abs(cos_light), 1e-12);
    // The light's own surface must not shadow it: stop short by its error bound.
    const float error = position_error(t.p0, t.p1, t.p2, HAS_INSTANCES);
    s.t_max = max(0.0, distance - error / max(abs(cos_light), 1e-3));
    if ((material.flags & MATERIAL_SKY) != 0u) {
        s.emission = sky_radiance(s.wi);
    } else if (cos_light > 0.0 || (material.flags & MATERIAL_TWO_SIDED) != 0u) {
        s.emission = emission_at(material, texel_uv(material, interpolate_uv(t, b)));
    }
    // A density that rounds to nothing can't be divided by; that of a triangle which a pose collapses has
    // no end.
    if (cos_light == 0.0 || !(s.pdf > 0.0) || isinf(s.pdf)) s.emission = vec3(0.0);
    return s;
}

// Share of a light in a direction under this cosine to the axis of its cone.
float spot_factor(float cos_inner, float cos_outer, float cosine) {
    if (cos_outer < -1.0) return 1.0;
    const float width = cos_inner - cos_outer;
    return width > 0.0 ? clamp((cosine - cos_outer) / width, 0.0, 1.0) : float(cosine >= cos_outer);
}

#include "compiler_light.glsl"

// A sphere, sampled in the cone it subtends. No ray hits it, so its samples stand alone.
LightSample sample_sphere_light(Light light, float probability, vec3 from, vec2 u) {
    const vec3 to_centre = light.position - from;
    const float squared = dot(to_centre, to_centre);
    const float sin2 = light.radius * light.radius / squared;
    LightSample s = NO_SAMPLE;
    if (!(sin2 < 1.0)) return s; // inside
    const float distance = sqrt(squared);
    const vec3 axis = to_centre / distance;
    const float cap = one_minus_cos(sin2);
    s.wi = sample_cone(axis, cap, u);
    s.pdf = probability * pdf_cone(cap);
    // Distance to the near surface along wi.
    const float along = dot(to_centre, s.wi);
    const vec3 off = to_centre - along * s.wi;
    s.t_max = along - sqrt(max(0.0, light.radius * light.radius - dot(off, off)));
    const float cone = spot_factor(light.cos_inner, light.cos_outer, dot(-axis, light.direction));
    s.emission = light.intensity * (cone / (PI * light.radius * light.radius));
    return s;
}

LightSample sample_point_light(uint index, float chosen, uint cell, vec3 from, vec2 u) {
    const Light light = params.scene.at[0].lights.at[index];
    const uint emitter = params.scene.at[0].emitter_count + index;
    const float probability = chosen >= 0.0
        ? chosen : choice_probability(cell, from, emitter, light.probability);
    if (HAS_COMPILER_LIGHTS) return sample_compiler_light(light, probability, from);
    return sample_sphere_light(light, probability, from, u);
}

// Solid-angle density with which a light sample at a point in a cell has a direction to a sun.
float pdf_sun(uint index, uint cell, vec3 from) {
    const Sun sun = params.scene.at[0].suns.at[index];
    const uint emitter = params.scene.at[0].first_sun + index;
    return choice_probability(cell, from, emitter, sun.probability) * pdf_cone(sun.one_minus_cos);
}

// A uniform direction to a sun.
LightSample sample_sun(uint index, float chosen, uint cell, vec3 from, vec2 u) {
    const Sun sun = params.scene.at[0].suns.at[index];
    LightSample s;
    s.hittable = true;
    s.number = NO_EMITTER;
    s.sun = true;
    s.t_max = params.t_max;
    s.wi = sample_cone(sun.direction, sun.one_minus_cos, u);
    s.pdf = chosen >= 0.0 ? chosen * pdf_cone(sun.one_minus_cos)
                                        : pdf_sun(index, cell, from);
    s.emission = s.pdf > 0.0 ? sun.radiance : vec3(0.0);
    return s;
}

// Radiance of the suns in a direction that a path took with the density `pdf_direction` from a point
// in a cell; weighted against sampling them if they were `sampled` there, too.
vec3 suns_found(vec3 direction, bool sampled, uint cell, vec3 from, float pdf_direction) {
    if (ESTIMATOR == ESTIMATOR_NEE && sampled) return vec3(0.0);
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < params.scene.at[0].sun_count; ++i) {
        const Sun sun = params.scene.at[0].suns.at[i];
        if (!is_in_sun(sun, direction)) continue;
        const bool weighted = ESTIMATOR == ESTIMATOR_MIS && sampled;
        sum += sun.radiance * (weighted ? mis_weight(pdf_direction, pdf_sun(i, cell, from)) : 1.0);
    }
    return sum;
}

// One emitter by the table over all: x chooses the entry, y keeps it or not.
uint choose_emitter(vec2 u) {
    const uint count = params.scene.at[0].entry_count;
    const uint entry = min(uint(u.x * float(count)), count - 1u);
    const AliasEntry alias = params.scene.at[0].alias.at[entry];
    return SELECTION != SELECTION_UNIFORM && u.y >= alias.keep ? alias.other : entry;
}

// The entry of a cell's list that is kept by y, or the one to take otherwise.
CellEntry listed(Cell cell, uint entry, float y) {
    const CellEntry kept = params.scene.at[0].cell_entries.at[cell.begin + entry];
    return y < kept.keep ? kept : params.scene.at[0].cell_entries.at[cell.begin + kept.other];
}

// One emitter by a cell's list, or by the table over all.
uint choose_listed(Cell cell, vec2 u) {
    const float fallback = params.scene.at[0].cell_fallback;
    if (u.x < fallback) return choose_emitter(vec2(u.x / fallback, u.y));
    const float x = (u.x - fallback) / (1.0 - fallback);
    const uint entry = min(uint(x * float(cell.count)), cell.count - 1u);
    return listed(cell, entry, u.y).emitter;
}

// A light that was chosen.
struct Entry {
    uint number;       // among all lights, or MOVING_SPHERE and among the spheres that move; NO_EMITTER
    uint instance;     // that moves and has the emitter with this number; else NO_INSTANCE
    float probability; // of the choice where it tells it, by the tree or of what moves; else below 0
};

// Flag of an entry's number.
const uint MOVING_SPHERE = 0x80000000u;

bool is_sphere_that_moves(Entry entry) {
    return HAS_FRAMES && entry.number >= MOVING_SPHERE && entry.number != NO_EMITTER;
}

// Chooses an entry of an alias table of `count` entries by x; what is left of x is uniform again.
uint choose_slot(inout float x, uint count) {
    const float scaled = x * float(count);
    const uint slot = min(uint(scaled), count - 1u);
    x = min(scaled - float(slot), 0.99999994);
    return slot;
}

// Keeps the entry or takes the other one by y; what is left of y is uniform again.
uint keep_slot(uint slot, float keep, uint other, inout float y) {
    const bool kept = y < keep;
    y = kept ? y / keep : (y - keep) / (1.0 - keep);
    return kept ? slot : other;
}

// One of the lights that move.
Entry choose_moving(vec2 u) {
    uint slot = choose_slot(u.x, params.scene.at[0].moving_count);
    const MovingLight first = params.scene.at[0].moving_lights.at[slot];
    slot = keep_slot(slot, first.keep, first.other, u.y);
    const MovingLight light = params.scene.at[0].moving_lights.at[slot];
    if (light.instance == NO_INSTANCE) {
        return Entry(MOVING_SPHERE | light.first, NO_INSTANCE, light.probability);
    }
    // Which of its mesh's emitters: by what is left of y, and that of x keeps it or not.
    slot = choose_slot(u.y, light.count);
    const AliasEntry alias = params.scene.at[0].alias.at[light.alias + slot];
    const uint number = light.first + keep_slot(slot, alias.keep, alias.other, u.x);
    const float share = params.scene.at[0].emitters.at[number].probability;
    return Entry(number, light.instance, light.probability * share);
}

// Whether it is to be one of the lights that move, by x; what is left of x is uniform again.
bool is_to_move(inout float x) {
    if (!HAS_FRAMES) return false;
    const float share = params.scene.at[0].moving_share;
    const bool moves = x < share;
    x = moves ? x / share : min((x - share) / (1.0 - share), 0.99999994);
    return moves;
}

// One light as seen from a point in a cell; NO_EMITTER if none can light the point.
Entry choose_entry(uint cell, vec3 from, vec2 u) {
    if (is_to_move(u.x)) return choose_moving(u);
    uint chosen;
    float probability = -1.0;
    bool by_tree = SELECTION == SELECTION_TREE;
    if (SELECTION == SELECTION_LEAF) {
        const Cell here = params.scene.at[0].cells.at[cell];
        by_tree = here.count == 0u;
        if (!by_tree) chosen = choose_listed(here, u);
    } else if (!by_tree) {
        chosen = choose_emitter(u);
    }
    if (by_tree) {
        chosen = sample_tree(from, u, probability);
        probability *= own_share();
    }
    return Entry(chosen, NO_INSTANCE, probability);
}

// Probability with which choose_entry, at a point in a cell, chooses a light.
float probability_of(Entry entry, uint cell, vec3 from) {
    if (HAS_FRAMES && (entry.instance != NO_INSTANCE || is_sphere_that_moves(entry))) return entry.probability;
    return choice_probability(cell, from, entry.number, power_of(entry.number));
}

// A sample of a light as seen from a point in a cell where it was chosen with the entry's probability, if
// that is known.
LightSample sample_entry(Entry entry, uint cell, vec3 from, vec2 u) {
    if (is_sphere_that_moves(entry)) {
        const Light sphere = params.scene.at[0].moving_spheres.at[entry.number & ~MOVING_SPHERE];
        return sample_sphere_light(sphere, entry.probability, from, u);
    }
    const uint emitters = params.scene.at[0].emitter_count;
    const bool of_instance = HAS_FRAMES && entry.instance != NO_INSTANCE;
    if (!HAS_POINT_LIGHTS && !HAS_SUNS || of_instance || entry.number < emitters) {
        return sample_emitter(entry.number, entry.instance, entry.probability, cell, from, u);
    }
    if (HAS_SUNS && entry.number >= params.scene.at[0].first_sun) {
        return sample_sun(entry.number - params.scene.at[0].first_sun, entry.probability, cell, from, u);
    }
    LightSample s = sample_point_light(entry.number - emitters, entry.probability, cell, from, u);
    s.number = entry.number - emitters;
    return s;
}
