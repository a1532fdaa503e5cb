// The path loop: every invocation takes one pixel through a range of samples.

struct Params {
    // Top left pixel of the tile, and its width and height.
    tile: vec2u,
    size: vec2u,
    // Its width times its height.
    pixels: u32,
    // Samples of each pixel that the dispatch may do, for the driver's limit on loop trips.
    most: u32,
    seed: u32,
    // Workgroups of the tile, the number of the dispatch's first one, and a stride without a common divisor:
    // consecutive groups go far apart, so that a driver which hands each thread a contiguous share gives all of them
    // the same picture to do.
    groups: u32,
    first_group: u32,
    stride: u32,
    // Loop trips there are.
    trips: u32,
    // 2, which no compiler knows.
    rounds: u32,
}

@group(1) @binding(0) var<uniform> params: Params;
// Running sums of the block, a layer for each replicate: R, G, B, squared luminance.
@group(1) @binding(1) var running_in: texture_2d_array<f32>;
@group(1) @binding(2) var running_out: texture_storage_2d_array<rgba32float, write>;
// For each pixel of the tile: rays; truncated paths, and in the upper half 1 + the place in its block of the first sample
// that was not finite; how many of those replicates 0 and 1 had, in a half each; and replicates 2 and 3.
@group(1) @binding(3) var<storage, read_write> counters: array<vec4u>;

// What is left to do.
struct Left {
    // Of how many pixels the dispatch could not do its samples for want of loop trips, and 1 + the last of those of which
    // not one sample could be finished.
    unfinished: atomic<u32>,
    stuck: atomic<u32>,
    // For each pixel of the tile: the sample to begin with. Then for each: one past its last. Then for each, in kernels
    // with trees: 1 if it may see a light.
    next: array<u32>,
}
@group(1) @binding(4) var<storage, read_write> left: Left;

struct Path {
    ray: Ray,
    // Product of the sample weights so far.
    beta: vec3f,
    // Radiance gathered so far.
    radiance: vec3f,
    // Number of the vertex that `ray` will meet; the first has 1.
    depth: u32,
    // The last scattering was specular (or there was none): light met by chance counts whole.
    specular: bool,
    // Every scattering so far was specular.
    clear: bool,
#if SEEN_LIGHTS
    // Camera rays still to be sent for what the sample sees of a light directly, before the path itself.
    glances: u32,
#endif
#if MIS
    // Density of the last scattering, per solid angle; 0: light met by chance is all counted by light sampling.
    pdf: f32,
#if SEVERAL_LIGHTS
    // Normal there, and the sum of the light weights.
    n: vec3f,
    weights: f32,
#endif
#endif
#if WHITTED
    // Only a light counts from here on.
    ending: bool,
#endif
}

// A path but for its ray.
fn begin(glances: u32) -> Path {
    var path: Path;
    path.beta = vec3f(1.0);
    path.radiance = vec3f(0.0);
    path.depth = 1u;
    path.specular = true;
    path.clear = true;
#if SEEN_LIGHTS
    path.glances = glances;
#endif
    return path;
}

#if SEEN_LIGHTS
// How many camera rays a sample of this pixel sends for what it sees of a light directly. The edge of a light is by far
// the noisiest thing in most pictures, and a camera ray costs a tenth of a path. Any answer is right; this one holds
// where the light's disk comes near the pixel, to first order.
#if TREE
// Where lights are many the host has looked for them.
fn glances_at(index: u32) -> u32 {
    let seen = left.next[2u * params.pixels + index];
    return select(0u, GLANCES * GLANCES, seen == 1u);
}
#else
fn glances_at(pixel: vec2u) -> u32 {
    let at = vec2f(pixel) + 0.5 - CAMERA_CENTER;
    let w = CAMERA_FORWARD + at.x * CAMERA_DX + at.y * CAMERA_DY;
    let far = length(w);
    let half_diagonal = 0.75 * length(CAMERA_DX);
    var glances = 0u;
    for (var i = 0u; i < LIGHT_KEYS / 4u; i++) {
        let light = lights[i];
        let to = light.center - CAMERA_EYE;
        let height = light.offset - dot(light.normal, CAMERA_EYE);
        let fall = dot(light.normal, w);
        // Outside a ball around the light, first, which is all there is to say where its plane is seen from the edge.
        let along = dot(to, w) / far;
        let off = length(to - w * (along / far));
        let near = along > 0.0 && off <= light.radius + half_diagonal * length(to);
        let t = height / fmin(fall, -TINY);
        let spread = 1.5 * t * half_diagonal * (1.0 - far / fmin(fall, -TINY));
        let inside = length(w * t - to) <= light.radius + spread;
        if height < 0.0 && near && (inside || fall > -3.0 * half_diagonal) {
            glances = GLANCES * GLANCES;
        }
    }
    return glances;
}
#endif
#endif

// Whether light scattered this often on its way to the eye is kept.
fn kept(scatterings: u32) -> bool {
#if ALL_LIGHT
    return true;
#else
    return (KEEP_EMITTED && scatterings == 0u) || (KEEP_DIRECT && scatterings == 1u) || (KEEP_INDIRECT && scatterings >= 2u);
#endif
}

#if MIS
// Power heuristic [Veach1995]: the share of a sample whose density is 1 / inverse, where density b would find it too.
fn power_heuristic(inverse: f32, b: f32) -> f32 {
    // The ratio first: squares of large densities overflow.
    let r = b * inverse;
    return 1.0 / (1.0 + r * r);
}
#endif

@compute @workgroup_size(64)
fn render(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = (params.first_group + group.x) * params.stride % params.groups * 64u + lane;
    if index >= params.pixels {
        return;
    }
    let texel = vec2u(index % params.size.x, index / params.size.x);
    let pixel = params.tile + texel;
    let key = pixel.x | (pixel.y << 16u);

    // The replicates' sums: values of their own, for an array indexed by a lane's sample would lie in memory.
    var sum_0 = vec4f(0.0);
    var sum_1 = vec4f(0.0);
    var sum_2 = vec4f(0.0);
    var sum_3 = vec4f(0.0);
    let first = left.next[index];
    let wanted = left.next[params.pixels + index];
    let end = first + min(wanted - first, params.most);
    // A block's sums start at zero. Those of a pixel without samples go from one texture to the other.
    if first % BLOCK != 0u || first == end {
        sum_0 = textureLoad(running_in, texel, 0, 0);
        sum_1 = textureLoad(running_in, texel, 1, 0);
        sum_2 = textureLoad(running_in, texel, 2, 0);
        sum_3 = textureLoad(running_in, texel, 3, 0);
    }
    var count = counters[index];

    var s = first;
#if TREE
    // A sample that uses up the trips is begun again by the next dispatch: nothing of it is kept.
    trips_left = params.trips - min(params.trips, TRIPS_AT_START + TRIPS_AT_VERTEX);
    var before = count;
    var going = true;
#endif
#if SEEN_LIGHTS
#if TREE
    let glances = glances_at(index);
#else
    let glances = glances_at(pixel);
#endif
#else
    let glances = 0u;
#endif
    var path = begin(glances);
    path.ray = camera_ray(pixel, film_position(key, s, params.seed, glances));
    // The host keeps (end - first) x max_depth below the driver's limit on loop trips.
#if TREE
    while s < end && going {
#else
    while s < end {
#endif
        var alive = false;
        let hit = intersect(path.ray);
        count.x += 1u;

#if SEEN_LIGHTS
        let glance = path.glances > 0u;
        // What the glances have seen the path itself does not see again.
        let blind = path.depth == 1u && glances > 0u && !glance;
        if hit.key < LIGHT_KEYS && !blind {
            path.radiance += path.beta * emission(path, hit) * select(1.0, 1.0 / f32(GLANCES * GLANCES), glance);
        }
        if !glance && hit.key >= LIGHT_KEYS && hit.key != NONE {
#else
        let glance = false;
        if hit.key < LIGHT_KEYS {
            // A light ends the path.
            path.radiance += path.beta * emission(path, hit);
        } else if hit.key != NONE {
#endif
            alive = scatter_at(&path, hit, vec4u(key, s, path.depth, params.seed), &count);
        }

#if TREE
        // What the driver limits are the trips of lanes side by side, of which each knows only its own. Once they are used
        // up no loop goes round any more, this one neither: what the vertex found is worth nothing then.
        var rounds = 0u;
        while rounds < params.rounds {
            rounds += 1u;
        }
        trips_left -= min(trips_left, select(TRIPS_AT_VERTEX, trips_left, rounds < params.rounds));
        if trips_left == 0u {
            going = false;
            count = before;
            alive = true;
        }
#endif
        var glances_left = 0u;
#if SEEN_LIGHTS
        if glance {
            path.glances -= 1u;
            glances_left = path.glances;
        }
#endif
        if !alive && !glance {
            // Add the sample, and start the next at once: no lane waits for a longer path.
            let l = path.radiance;
            let y = dot(l, vec3f(0.2126, 0.7152, 0.0722));
            // WGSL may assume that there is no NaN: look at the bits.
            let finite = (bitcast<u32>(y) & 0x7fffffffu) < 0x7f800000u;
            let replicate = s / ROUND_SAMPLES % REPLICATES;
            if finite {
                // The square serves the error of a single replicate alone; it must not overflow.
                let bounded = fmin(y, 1.0e15);
                let added = vec4f(l, bounded * bounded);
                sum_0 = select(sum_0, sum_0 + added, replicate == 0u);
                sum_1 = select(sum_1, sum_1 + added, replicate == 1u);
                sum_2 = select(sum_2, sum_2 + added, replicate == 2u);
                sum_3 = select(sum_3, sum_3 + added, replicate == 3u);
            } else {
                let at = s % BLOCK + 1u;
                count.y |= select(0u, at << 16u, count.y < 0x10000u);
                let one = 1u << (16u * (replicate % 2u));
                count.z += select(0u, one, replicate < 2u);
                count.w += select(one, 0u, replicate < 2u);
            }
            s += 1u;
            path = begin(glances);
            glances_left = glances;
#if TREE
            before = count;
#endif
        }
        if !alive {
            path.ray = camera_ray(pixel, film_position(key, s, params.seed, glances_left));
        }
    }
    left.next[index] = s;
#if TREE
    if s < end {
        count = before;
        atomicAdd(&left.unfinished, 1u);
        atomicMax(&left.stuck, select(0u, index + 1u, s == first));
    }
#endif
    textureStore(running_out, texel, 0, sum_0);
    textureStore(running_out, texel, 1, sum_1);
    textureStore(running_out, texel, 2, sum_2);
    textureStore(running_out, texel, 3, sum_3);
    counters[index] = count;
}

// What a light met by chance adds, before the path's weight.
fn emission(path: Path, hit: Hit) -> vec3f {
    let light = light_at(hit.key >> 2u);
    let front = dot(path.ray.d, light.normal) < 0.0;
    var share = select(0.0, 1.0, front && kept(path.depth - 1u));
#if LIGHT_SAMPLING
#if MIS
    if !path.specular && path.pdf > 0.0 {
        let cap = cap_of(light, path.ray.o);
        var pdf = cap_pdf(light, cap, path.ray.d);
#if LIGHT_TREE
        pdf *= light_probability(hit.key >> 2u, path.ray.o, path.n);
#else
#if SEVERAL_LIGHTS
        pdf *= light_weight(light, path.ray.o, path.n) / fmax(path.weights, TINY);
#endif
#endif
        share *= power_heuristic(1.0 / fmax(path.pdf, TINY), SHADOW_RAYS * pdf);
    } else {
        share *= select(0.0, 1.0, path.specular);
    }
#else
    share *= select(0.0, 1.0, path.specular);
#endif
#endif
#if LIGHT_SCALES
    share *= light_scale(path.ray.medium);
#endif
    return light.radiance * share;
}

// Scatters the path where it met a surface: direct light, then a new direction. False when it ends.
fn scatter_at(path: ptr<function, Path>, hit: Hit, draw_key: vec4u, count: ptr<function, vec4u>) -> bool {
    let surface = surface_at(hit.key);
    let material = material_at(surface.material);
    let d = (*path).ray.d;
    let v = vertex_at((*path).ray, hit, surface);
    let face = face_at(hit.key, surface);
    // Two-sided: the normal on the side that the ray comes from.
    var outside = dot(v.n, d) < 0.0;
#if DIELECTRIC
    if material.kind == MATERIAL_DIELECTRIC {
        // Known, where a grazing cosine may round to either sign.
        outside = (*path).ray.medium != surface.solid;
    }
#endif
    let n = select(-v.n, v.n, outside);
    let cos_i = abs(dot(v.n, d));

#if WHITTED
    if (*path).ending {
        return false;
    }
#endif
    // The vertex on the light counts too, so nothing can be gathered beyond the last one.
    if (*path).depth >= LAST_DEPTH {
#if COUNT_TRUNCATED
        (*count).y += 1u;
#endif
        return false;
    }
    var u = draw(draw_key);
    if (*path).clear {
        let round = draw_key.y / ROUND_SAMPLES;
        let i = round / REPLICATES * ROUND_SAMPLES + draw_key.y % ROUND_SAMPLES;
        u = draw_spread(u, draw_key.x, round % REPLICATES, i, draw_key.w);
    }

#if LIGHT_SAMPLING
    // Direct light, where the surface scatters into more than one direction.
    var weights = 0.0;
    if material.kind == MATERIAL_DIFFUSE || material.kind == MATERIAL_PHONG {
        var gathered = vec3f(0.0);
#if SEVERAL_SHADOW_RAYS
        for (var k = 0u; k < u32(SHADOW_RAYS); k++) {
            var points = u.points.xy;
            var choice = u.choices.x;
#if LIGHT_TREE
            var spare = u.choices.w;
#endif
            if k > 0u {
                let more = draw(draw_key + vec4u(0u, 0u, k << 20u, 0u));
                points = more.points.xy;
                choice = more.choices.x;
#if LIGHT_TREE
                spare = more.choices.w;
#endif
            }
            choice = (choice + f32(k)) * (1.0 / SHADOW_RAYS);
#else
            let points = u.points.xy;
            let choice = u.choices.x;
#if LIGHT_TREE
            let spare = u.choices.w;
#endif
#endif
#if LIGHT_TREE
            let chosen = choose_light(v.p, n, vec2f(choice, spare));
#else
            let chosen = choose_light(v.p, n, choice);
#endif
            weights = chosen.weights;
            let to = sample_cap(chosen.light, chosen.cap, points);
            let cos = dot(n, to.d);
            // 1 / density of this sample among all.
            let inverse_pdf = to.inverse_pdf * chosen.inverse_probability * (1.0 / SHADOW_RAYS);
            if cos > 0.0 && inverse_pdf > 0.0 && kept((*path).depth) {
                var f_cos = material.color * (0.31830989 * cos);
#if MIS_DIFFUSE
                if material.kind == MATERIAL_DIFFUSE {
                    f_cos *= power_heuristic(inverse_pdf, cos * 0.31830989);
                }
#endif
#if PHONG
                if material.kind == MATERIAL_PHONG {
                    let power = phong_power(to.d, mirrored(d, n), material.exponent);
                    let value = phong_value(material.color, material.specular, material.exponent, cos, power);
                    f_cos = value.f_cos;
#if MIS
                    f_cos *= power_heuristic(inverse_pdf, value.pdf);
#endif
                }
#endif
                (*count).x += 1u;
                let shadow = Ray(v.p, to.d, face, (*path).ray.medium, chosen.light.face);
                if !occluded(shadow, to.distance, chosen.index) {
                    gathered += f_cos * chosen.light.radiance * inverse_pdf;
                }
            }
#if SEVERAL_SHADOW_RAYS
        }
#endif
#if LIGHT_SCALES
        gathered *= light_scale((*path).ray.medium);
#endif
        (*path).radiance += (*path).beta * gathered;
#if WHITTED
        (*path).ending = true;
#endif
    }
#endif

    // A new direction.
    var next = d;
    var weight = vec3f(0.0);
    var medium = (*path).ray.medium;
    (*path).specular = false;
#if MIS
    (*path).pdf = 0.0;
#endif
#if DIFFUSE
    if material.kind == MATERIAL_DIFFUSE {
        next = sample_cosine(n, u.points.zw);
        weight = material.color;
#if MIS_DIFFUSE
        (*path).pdf = fmax(dot(n, next), 0.0) * 0.31830989;
#endif
    }
#endif
#if PHONG
    if material.kind == MATERIAL_PHONG {
        let r = mirrored(d, n);
        let choice = lobe_probability(material.color, material.specular);
        var power: f32;
        if u.choices.y < choice {
            let lobe = sample_lobe(r, material.exponent, u.points.zw);
            next = lobe.d;
            power = lobe.power;
        } else {
            next = sample_cosine(n, u.points.zw);
            power = phong_power(next, r, material.exponent);
        }
        let cos = dot(n, next);
        let value = phong_value(material.color, material.specular, material.exponent, cos, power);
        // Below the horizon the sample counts as zero and is not drawn again. Where there is no diffuse part the
        // powers cancel, and nothing is left to divide.
        var quotient = value.f_cos * (1.0 / fmax(value.pdf, TINY));
        if choice >= 1.0 {
            quotient = material.specular * ((material.exponent + 2.0) / (material.exponent + 1.0) * cos);
        }
        weight = select(vec3f(0.0), quotient, cos > 0.0);
#if MIS
        (*path).pdf = value.pdf;
#endif
    }
#endif
#if MIRROR
    if material.kind == MATERIAL_MIRROR {
        next = mirrored(d, n);
        weight = material.color;
        (*path).specular = true;
    }
#endif
#if DIELECTRIC
    if material.kind == MATERIAL_DIELECTRIC {
        let eta = select(1.0 / material.exponent, material.exponent, outside);
        let fresnel = refraction(cos_i, eta);
        if u.choices.y < fresnel.transmitted {
            next = refracted(d, n, cos_i, fresnel.cos_t, eta);
            weight = material.color;
            medium = select(surface.parent, surface.solid, outside);
        } else {
            next = mirrored(d, n);
            weight = vec3f(1.0);
        }
        (*path).specular = true;
    }
#endif

    let beta = (*path).beta * weight;
    (*path).ray = Ray(v.p, next, face, medium, NO_FACE);
#if MIS
#if SEVERAL_LIGHTS
    (*path).n = n;
    (*path).weights = weights;
#endif
#endif
    (*path).clear = (*path).clear && (*path).specular;
    // Russian roulette: short paths are cheap, and cutting them only adds noise.
    let brightest = fmax(fmax(beta.x, beta.y), beta.z);
    var survival = 1.0;
    if (*path).depth >= ROULETTE_DEPTH {
        survival = fmin(1.0, brightest);
    }
    (*path).beta = beta * (1.0 / fmax(survival, TINY));
    (*path).depth += 1u;
    return brightest > 0.0 && u.choices.z < survival;
}
