// The parts of the loop in path_trace.rgen: what a path is on its way, and the light it gathers. Needs all
// other files, and what path_trace.rgen says before its loop.

// A path on its way.
struct Walk {
    vec3 origin;      // where the ray began
    vec3 direction;
    float pdf;        // density of the direction
    uint cell;        // of the origin, as the choice among lights sees space
    bool has_sampled; // lights were sampled there
    uint mask;        // of what the ray meets
    uint vertex;      // that the ray leads to
    vec3 throughput;
    Medium medium;    // along the ray
    float t_min;      // where the ray goes on after the last interface it passed
    uint passages;    // since the vertex before
    bool again;       // the ray is looked along for the second time
    uint decisions;   // taken at interfaces so far
    uint stretches;   // of rays so far, in fog
    bool scattered;   // in fog, which happens once at most
};

Walk walk_from_eye(vec3 origin, vec3 direction) {
    return Walk(origin, direction, 0.0, 0u, false, mask_of_camera(), 1u, vec3(1.0), medium_at_eye(), 0.0, 0u,
                false, 0u, 0u, false);
}

// A new ray begins.
void begin_ray(inout Walk walk, vec3 origin, uint mask, bool has_sampled) {
    walk.origin = origin;
    walk.mask = mask;
    walk.has_sampled = has_sampled;
    if (HAS_TRANSLUCENT) {
        restart(walk.medium);
        walk.t_min = 0.0;
        walk.passages = 0u;
        walk.again = false;
    }
}

bool may_look_again(Walk walk) { return HAS_TRANSLUCENT && walk.passages > 0u && !walk.again; }

// Where an interface meets a wall, as water does at its edges, both may be at the same distance to the last
// place, and a ray that goes on behind the interface goes on behind the wall. Then it finds nothing, or the
// back of an opaque surface: so it looks again from before the interface, at what is opaque alone.
bool looks_again(inout Walk walk) {
    if (!may_look_again(walk)) return false;
    if (hit.triangle != MISS) {
        if ((hit.instance & HIT_FRONT) != 0u) return false;
        // What can be seen through, fences and interfaces, is seen from both sides.
        if (hit.triangle >= params.scene.at[0].instances.at[hit.instance & INSTANCE_INDEX].alpha_base) return false;
    }
    walk.again = true;
    walk.t_min = uintBitsToFloat(max(floatBitsToUint(walk.t_min), 2u) - 2u);
    return true;
}

// Russian roulette (Arvo and Kirk 1990). Paths that find light by hitting it alone end by chance only
// where nothing else ends them.
bool survives(inout Walk walk, float u) {
    const bool endless = params.depth == 0u && walk.vertex >= ROULETTE_START;
    const float throughput = max_component(walk.throughput);
    const float by_throughput = SAMPLES_LIGHTS ? ROULETTE_GAIN * throughput : endless ? throughput : 1.0;
    const float survival = min(by_throughput, endless ? ROULETTE_MAX_SURVIVAL : 1.0);
    if (u >= survival) return false;
    walk.throughput /= survival;
    return true;
}

// Light that ends a path with this many reflections goes to its layer, or all to the first one:
// what is not asked for need not be kept alive while rays are traced.
void add_radiance(inout PathSample path, uint reflections, vec3 radiance) {
    if (!(ALL_LAYERS || CLAMP != 0u) || reflections == 0u) path.emission += radiance;
    else if (!ALL_LAYERS || reflections == 1u) path.direct += radiance;
    else path.indirect += radiance;
}

// Light that was sampled goes to the plane of its light style, too.
void add_sampled(inout PathSample path, uint reflections, ChosenLight light, vec3 radiance) {
    if (STYLE_LAYERS && light.number != NO_EMITTER) {
        const StyleOfLight style = params.scene.at[0].light_styles.at[light.number];
        if (style.plane > 0u && is_finite(radiance)) {
            film_add_style(style.plane, pixel, pixels, radiance);
        }
        radiance *= style.brightness;
    }
    add_radiance(path, reflections, radiance);
}

// A light that was chosen, which is still to be looked at.
struct Connection {
    ChosenLight light; // its gain is 0 if there is none
    uint reflections;  // of its light on the way to the eye
    vec3 from;         // where it would shine
    uint mask;         // of what is in the way
    Medium medium;     // around `from`
};

Connection no_connection() {
    return Connection(NO_LIGHT, 0u, vec3(0.0), 0u, Medium(vec3(0.0), vec3(0.0)));
}

// Adds the light that was chosen on a surface and in fog, as far as it arrives, and forgets it. Overwrites
// `hit`. This is the only place of shadow rays: where two are traced in places of their own, all rays cost
// more.
void look_at(inout PathSample path, inout Connection on_surface, inout Connection in_fog) {
    for (uint i = 0u; i < (HAS_FOG ? 2u : 1u); ++i) {
        Connection c = on_surface;
        if (HAS_FOG && i == 1u) c = in_fog;
        if (!(max_component(abs(c.light.gain)) > 0.0)) continue;
        vec3 arrives;
        if ((HAS_SUNS || HAS_COMPILER_LIGHTS) && c.light.sun) {
            arrives = sky_visibility(c.from, c.light.wi, c.mask, c.medium);
        } else {
            arrives = visibility(c.from, c.light.wi, c.light.t_max, c.mask, c.medium);
        }
        if (max_component(arrives) > 0.0) add_sampled(path, c.reflections, c.light, c.light.gain * arrives);
    }
    on_surface.light.gain = in_fog.light.gain = vec3(0.0);
}

// Emission that a ray found at a distance, weighted against sampling it.
vec3 light_found(Walk walk, Surface s, vec3 n, float t, bool front, bool sky) {
    const bool shows = front || (s.flags & MATERIAL_TWO_SIDED) != 0u;
    const vec3 emission = sky ? sky_radiance(walk.direction) : shows ? s.emission : vec3(0.0);
    float weight = 1.0;
    if (ESTIMATOR == ESTIMATOR_NEE && walk.has_sampled) weight = 0.0;
    if (ESTIMATOR == ESTIMATOR_MIS && walk.has_sampled) {
        const float pdf = pdf_light(walk.cell, walk.origin, s, t * t, dot(n, -walk.direction));
        weight = mis_weight(walk.pdf, pdf);
    }
    vec3 found = emission * weight;
    if (HAS_SUNS && sky) {
        found += suns_found(walk.direction, walk.has_sampled, walk.cell, walk.origin, walk.pdf);
    }
    return found;
}

void keep_first_hit(inout PathSample path, Walk walk, Surface s, vec3 n, float t) {
    if (!ALL_LAYERS || walk.vertex > 1u) return;
    path.albedo = s.albedo;
    path.normal = n;
    path.position = s.position;
    path.depth = t * dot(walk.direction, params.forward);
    if (HAS_FRAMES) path.motion = motion_of(s, hit.instance, hit.triangle, walk.direction);
    path.id = s.face + 1u;
}

// A light that shines into fog along the ray up to distance t, for one path in `often`.
Connection connect_in_fog(Walk walk, float t, float often, uint index) {
    const vec3 from = walk.origin + walk.t_min * walk.direction;
    ChosenLight light = choose_airlight(from, walk.direction, t - walk.t_min, walk.throughput / often, pixel,
                                        index, DIMENSION_AIRLIGHT + DIMENSIONS_PER_AIRLIGHT * walk.stretches);
    Medium medium = walk.medium;
    if (HAS_TRANSLUCENT) {
        light.gain *= transmittance(medium, walk.t_min + light.along);
        restart(medium);
    }
    return Connection(light, walk.vertex, from + light.along * walk.direction, mask_from(0u), medium);
}

// What fog does on the way to distance t, of which it leaves the share `clear`.
const uint FOG_NOTHING = 0u;  // of paths that it may scatter as many come through as it leaves of the light
const uint FOG_ABSORBS = 1u;  // it takes light alone
const uint FOG_SCATTERS = 2u; // a new ray has begun
const uint FOG_ENDS = 3u;

uint meet_fog(inout Walk walk, Surface ahead, float t, float clear, uint index, inout Connection in_fog) {
    // A moment may have no fog.
    const bool none = !(params.scene.at[0].fog_extinction > 0.0);
    if (none || walk.scattered || walk.vertex == params.depth) return FOG_ABSORBS;
    const float u = random4(pixel, index, DIMENSION_FREE_PATH + walk.stretches, params.seed).x;
    const float d = walk.t_min + minus_log_rest(u) / params.scene.at[0].fog_extinction;
    // Always on the camera's ray, else as often as the path is scattered.
    const bool first = walk.vertex == 1u;
    if (SAMPLES_LIGHTS && has_lights() && (first || d < t)) {
        in_fog = connect_in_fog(walk, t, first ? 1.0 : 1.0 - clear, index);
    }
    ++walk.stretches;
    if (!(d < t)) return FOG_NOTHING;
    walk.throughput *= params.scene.at[0].fog_albedo;
    if (HAS_TRANSLUCENT) walk.throughput *= transmittance(walk.medium, d);
    const uint dimension = DIMENSIONS_PER_VERTEX * walk.vertex + DIMENSION_BSDF;
    const vec4 next = random4(pixel, index, dimension, params.seed);
    if (max_component(walk.throughput) <= 0.0 || !survives(walk, next.z)) return FOG_ENDS;
    // So near to the surface ahead that rounding could put it behind, a vertex is where rays begin there.
    const bool at_end = (t - d) * abs(dot(ahead.geometric, walk.direction)) < ahead.error;
    const vec3 place = at_end ? spawn_origin(ahead, -walk.direction, t - walk.t_min)
                              : walk.origin + d * walk.direction;
    begin_ray(walk, place, mask_from(0u), SAMPLES_LIGHTS);
    if (SAMPLES_LIGHTS) walk.cell = cell_at(walk.origin);
    walk.direction = sample_sphere(next.xy);
    walk.pdf = PHASE;
    walk.scattered = true;
    ++walk.vertex;
    return FOG_SCATTERS;
}
