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
// For each pixel of the tile, four words: rays; truncated paths, and in the upper half 1 + the place in its block of the first
// sample that was not finite; how many of those replicates 0 and 1 had, in a half each; and replicates 2 and 3.
@group(1) @binding(3) var<storage, read_write> counters: array<u32>;

// What is left to do.
struct Left {
    // Of how many pixels the dispatch could not do its samples for want of loop trips, and 1 + the last of those of which
    // not one sample could be finished.
    unfinished: atomic<u32>,
    stuck: atomic<u32>,
    // For each pixel of the tile: the sample to begin with. Then for each: one past its last. Then for each, in kernels
    // that look for lights: up to which vertex glances look there; 0 where there are none.
    next: array<u32>,
}
@group(1) @binding(4) var<storage, read_write> left: Left;

struct Path {
    ray: Ray,
    // Product of the sample weights so far.
    beta: vec3f,
    // Its greatest channel at the first vertex that scattered in more than one direction; 1 before.
    shown: f32,
    // Radiance gathered so far.
    radiance: vec3f,
    // Number of the vertex that `ray` will meet; the first has 1.
    depth: u32,
    // The last scattering was specular (or there was none): light met by chance counts whole.
    specular: bool,
    // Every scattering so far was specular.
    clear: bool,
#if SEEN_LIGHTS
    // Glances still to be sent before the path itself, this one included: camera rays that gather nothing but what they see
    // of a light, directly or by way of mirrors and glass. The edge of a light, and of its image, is by far the noisiest
    // thing in most pictures, and a camera ray costs a tenth of a path.
    glances: u32,
#endif
#if GLANCES_GO_ON
    // What it does at glass: see scatter.wgsl.
    way: u32,
#endif
#if MIS
    // Density of the last scattering, per solid angle; 0: light met by chance is all counted by light sampling.
    pdf: f32,
#if SEVERAL_LIGHTS
    // What light was sent to there, and the sum of the light weights.
    receiver: Receiver,
    weights: f32,
#endif
#endif
#if WHITTED
    // Only a light counts from here on.
    ending: bool,
#endif
#if IMAGES
    // See image.wgsl.
    memory: u32,
    // Is to be sent to an image: the ray's direction holds two random numbers and the image's number; and the normal there.
    sends: bool,
    normal: vec3f,
#endif
}

// Goes on with another path where one has `ended`: along this ray, with what glances have gathered. The rest is not asked for
// before it is set.
fn restart(path: ptr<function, Path>, ended: bool, ray: Ray, glances: u32, seen: vec3f) {
    (*path).ray.o = select((*path).ray.o, ray.o, ended);
    (*path).ray.d = select((*path).ray.d, ray.d, ended);
    (*path).ray.face = select((*path).ray.face, ray.face, ended);
    (*path).ray.medium = select((*path).ray.medium, ray.medium, ended);
    (*path).beta = select((*path).beta, vec3f(1.0), ended);
    (*path).shown = select((*path).shown, 1.0, ended);
    (*path).radiance = select((*path).radiance, seen, ended);
    (*path).depth = select((*path).depth, 1u, ended);
    (*path).specular = (*path).specular || ended;
    (*path).clear = (*path).clear || ended;
#if SEEN_LIGHTS
    (*path).glances = select((*path).glances, glances, ended);
#endif
#if WHITTED
    (*path).ending = (*path).ending && !ended;
#endif
#if IMAGES
    (*path).memory = select((*path).memory, FREE, ended);
    (*path).sends = (*path).sends && !ended;
#endif
}

@compute @workgroup_size(64)
fn render(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // A workgroup is a block of 8 x 8 pixels, and its lanes fill it in squares of 4 x 4 and halves of 8 x 4: however many a
    // device takes side by side, their rays go the same way for longer than those of a row.
    let block = (params.first_group + group.x) * params.stride % params.groups;
    let blocks = (params.size.x + 7u) / 8u;
    let texel = 8u * vec2u(block % blocks, block / blocks)
        + vec2u((lane & 3u) | ((lane >> 2u) & 4u), ((lane >> 2u) & 3u) | ((lane >> 3u) & 4u));
    if any(texel >= params.size) {
        return;
    }
    let index = texel.y * params.size.x + texel.x;
    let pixel = params.tile + texel;
    let key = pixel.x | (pixel.y << 16u);

    // The replicates' sums: values of their own, for an array indexed by a lane's sample would lie in memory.
    var sum_0 = vec4f(0.0);
    var sum_1 = vec4f(0.0);
    var sum_2 = vec4f(0.0);
    var sum_3 = vec4f(0.0);
    // Of every kind of access one, in a loop of which no compiler knows how often it goes round. A software adapter makes code
    // for each lane and word of each: so three_materials compiles in 0.84 of the time on Mesa 25, and as before on 22.3.
    var first = 0u;
    var wanted = 0u;
    var mark = 0u;
#if SEEN_LIGHTS
    let words = params.rounds + 1u;
#else
    let words = params.rounds;
#endif
    for (var k = 0u; k < words; k++) {
        let word = left.next[k * params.pixels + index];
        first = select(first, word, k == 0u);
        wanted = select(wanted, word, k == 1u);
        mark = select(mark, word, k == 2u);
    }
    var count = vec4u(0u);
    for (var k = 0u; k < 2u * params.rounds; k++) {
        count = select(count, vec4u(counters[4u * index + k]), vec4u(0u, 1u, 2u, 3u) == vec4u(k));
    }
    let end = first + min(wanted - first, params.most);
    // A block's sums start at zero. Those of a pixel without samples go from one texture to the other.
    if first % BLOCK != 0u || first == end {
        sum_0 = textureLoad(running_in, texel, 0, 0);
        sum_1 = textureLoad(running_in, texel, 1, 0);
        sum_2 = textureLoad(running_in, texel, 2, 0);
        sum_3 = textureLoad(running_in, texel, 3, 0);
    }

    var s = first;
#if TREE
    // A sample that uses up the trips is begun again by the next dispatch: nothing of it is kept.
    trips_left = params.trips - min(params.trips, TRIPS_AT_START + TRIPS_AT_VERTEX);
    var before = count;
    var going = true;
#endif
#if SEEN_LIGHTS
#if GLANCES_GO_ON
    // And at which vertex one half of them goes into glass and the other is reflected; 0: that is left to chance everywhere.
    let branch = (mark >> BRANCH_SHIFT) & 0xffu;
    let sight = mark & 0xffu;
    let across = select(CHAIN_GLANCES, GLANCES, (mark >> DIRECT_SHIFT) == 1u);
#else
    let sight = mark & 0xffu;
    let across = GLANCES;
#endif
    let glances = select(0u, across * across, sight > 0u);
#else
    let across = GLANCES;
    let glances = 0u;
#endif
    var path: Path;
    restart(&path, true, camera_ray(pixel, film_position(key, s, params.seed, glances, across)), glances, vec3f(0.0));
    // The host keeps (end - first) x max_depth below the driver's limit on loop trips.
#if TREE
    while s < end && going {
#else
    while s < end {
#endif
#if IMAGES
    // Few paths are sent to images, and a software adapter goes through a conditional statement for all lanes as soon as it
    // meets it: so that is done once every few turns.
    for (var turn = 0u; turn < TURNS && s < end && !path.sends; turn++) {
#endif
        let hit = intersect(path.ray);
        count.x += 1u;

        // A light ends the path.
        let meets_light = hit.key < LIGHT_KEYS;
        var meets = !meets_light && hit.key != NONE;
#if SEEN_LIGHTS
        let glance = path.glances > 0u;
        // What the glances have seen the path itself does not see again.
#if GLANCES_GO_ON
        let blind = path.clear && path.depth <= sight && !glance;
        meets = meets && (!glance || path.depth < sight);
#else
        let blind = path.depth <= sight && !glance;
        meets = meets && !glance;
#endif
        if meets_light && !blind {
            path.radiance += path.beta * emission(path, hit) * select(1.0, 1.0 / f32(across * across), glance);
        }
#else
        let glance = false;
        if meets_light {
            path.radiance += path.beta * emission(path, hit);
        }
#endif
#if GLANCES_GO_ON
        // Random numbers of its own for each glance.
        let seed = params.seed ^ (path.glances * 0x9e3779b9u);
        // Where the mark says so half of them are reflected: the black or the white fields of a chess board, by the toss
        // of a coin for each sample.
        let coin = hash_pixel(key, s, params.seed ^ 0x7f4a7c15u).x;
        let field = (path.glances ^ ((path.glances - 1u) >> (across >> 1u)) ^ coin) & 1u;
        path.way = select(BY_CHANCE, field, glance && path.depth == branch);
#else
        let seed = params.seed;
#endif
        // Some surface there is, whatever was met.
        let met = Hit(hit.t, select(0u, hit.key, meets));
        var alive = false;
#if BRANCHES
        if meets {
#endif
        alive = scatter_at(&path, meets, met, vec4u(key, s, path.depth, seed), &count);
#if BRANCHES
        }
#endif

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
        // Add the sample of a path that has ended, and start the next at once: no lane waits for a longer path.
        let done = !alive && !glance;
        let l = path.radiance;
        let y = dot(l, vec3f(0.2126, 0.7152, 0.0722));
        // WGSL may assume that there is no NaN: look at the bits.
        let finite = (bitcast<u32>(y) & 0x7fffffffu) < 0x7f800000u;
        let replicate = s / ROUND_SAMPLES % REPLICATES;
        // The square serves the error of a single replicate alone; it must not overflow.
        let bounded = fmin(y, 1.0e15);
        let added = vec4f(l, bounded * bounded);
        let adds = done && finite;
        sum_0 = select(sum_0, sum_0 + added, adds && replicate == 0u);
        sum_1 = select(sum_1, sum_1 + added, adds && replicate == 1u);
        sum_2 = select(sum_2, sum_2 + added, adds && replicate == 2u);
        sum_3 = select(sum_3, sum_3 + added, adds && replicate == 3u);
        let lacks = done && !finite;
        count.y |= select(0u, (s % BLOCK + 1u) << 16u, lacks && count.y < 0x10000u);
        let one = 1u << (16u * (replicate % 2u));
        count.z += select(0u, one, lacks && replicate < 2u);
        count.w += select(0u, one, lacks && replicate >= 2u);
        s += select(0u, 1u, done);
#if TREE
        before = select(before, count, done);
#endif
#if SEEN_LIGHTS
        let more = select(glances, path.glances - 1u, glance);
        let seen = select(vec3f(0.0), path.radiance, glance);
#else
        let more = 0u;
        let seen = vec3f(0.0);
#endif
        restart(&path, !alive, camera_ray(pixel, film_position(key, s, params.seed, more, across)), more, seen);
#if IMAGES
    } // Turns; their lines stand as in kernels without this loop.
    if path.sends {
        send(&path);
    }
#endif
    }
    left.next[index] = s;
#if TREE
    if s < end {
        count = before;
        atomicAdd(&left.unfinished, 1u);
        atomicMax(&left.stuck, select(0u, index + 1u, s == first));
    }
    // Loops may go round no more here.
    textureStore(running_out, texel, 0, sum_0);
    textureStore(running_out, texel, 1, sum_1);
    textureStore(running_out, texel, 2, sum_2);
    textureStore(running_out, texel, 3, sum_3);
    counters[4u * index] = count.x;
    counters[4u * index + 1u] = count.y;
    counters[4u * index + 2u] = count.z;
    counters[4u * index + 3u] = count.w;
#else
    for (var k = 0u; k < 2u * params.rounds; k++) {
        let sum = select(select(sum_0, sum_1, k == 1u), select(sum_2, sum_3, k == 3u), k >= 2u);
        textureStore(running_out, texel, k, sum);
        counters[4u * index + k] = select(select(count.x, count.y, k == 1u), select(count.z, count.w, k == 3u), k >= 2u);
    }
#endif
}
