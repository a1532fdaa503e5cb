// A pixel's part of the film: its sums and counts, how they are loaded, added to, and stored.
//
// Opaque bounds: a pixel's words are loaded and stored in loops whose number of turns no compiler knows, so that there is one
// access in the code where there would be three or four. A software adapter makes code for every lane of every access:
// three_materials compiles in 0.84 of the time on Mesa 25 with these loops, and in the same time on Mesa 22.

struct Params {
    // Top left pixel of the tile, and its width and height.
    tile: vec2u,
    size: vec2u,
    // Its width times its height.
    pixels: u32,
    // Samples of each pixel that the dispatch may make, for the driver's limit on loop trips.
    max_samples: u32,
    seed: u32,
    // Workgroups of the tile, the number of the dispatch's first one, and a stride without a common divisor: consecutive
    // groups go far apart, so that a driver which hands each thread a contiguous share gives all of them the same picture.
    groups: u32,
    first_group: u32,
    stride: u32,
    // Loop trips that an invocation may take.
    trips: u32,
    // 2: the opaque bound.
    opaque_two: u32,
}

@group(1) @binding(0) var<uniform> params: Params;
// Running sums of the block, a layer for each replicate: R, G, B, squared luminance.
@group(1) @binding(1) var running_in: texture_2d_array<f32>;
@group(1) @binding(2) var running_out: texture_storage_2d_array<rgba32float, write>;
// Four words for each pixel of the tile: the counts of PixelFilm.
@group(1) @binding(3) var<storage, read_write> counters: array<u32>;

struct Work {
    // In how many pixels the dispatch ran out of loop trips, and 1 + the last pixel of which it finished no sample at all.
    unfinished: atomic<u32>,
    stuck: atomic<u32>,
    // For each pixel of the tile: the sample to begin with. Then for each: one past its last sample. Then for each, in
    // kernels that send glances: its mark.
    words: array<u32>,
}
@group(1) @binding(4) var<storage, read_write> work: Work;

struct Pixel {
    // In the picture, and in the tile.
    place: vec2u,
    texel: vec2u,
    // Number in the tile, row by row.
    index: u32,
    // What its random numbers depend on.
    key: u32,
}

// The pixel of one lane. A workgroup is a block of 8 x 8 pixels, which its lanes fill in squares of 4 x 4 and halves of 8 x 4:
// however many lanes a device runs side by side, their rays stay together longer than those of a row.
fn pixel_of(group: u32, lane: u32) -> Pixel {
    let number = (params.first_group + group) * params.stride % params.groups;
    let across = (params.size.x + GROUP_SIDE - 1u) / GROUP_SIDE;
    let texel = GROUP_SIDE * vec2u(number % across, number / across)
        + vec2u((lane & 3u) | ((lane >> 2u) & 4u), ((lane >> 2u) & 3u) | ((lane >> 3u) & 4u));
    let place = params.tile + texel;
    return Pixel(place, texel, texel.y * params.size.x + texel.x, place.x | (place.y << 16u));
}

struct PixelFilm {
    // Sums of each replicate: R, G, B, squared luminance. An array that is indexed by a lane's sample would lie in memory.
    sum_0: vec4f,
    sum_1: vec4f,
    sum_2: vec4f,
    sum_3: vec4f,
    // Rays; truncated paths, FURTHER, HIDDEN, FOUND, and in the upper half 1 + the place in its block of the first sample that was not finite; how many
    // such samples replicates 0 and 1 had, in a half each; and replicates 2 and 3.
    counts: vec4u,
    // The sample under way, the dispatch's first, and one past its last.
    s: u32,
    first: u32,
    end: u32,
    // Of glances, by the host; 0: none.
    mark: u32,
}

fn load_pixel(pixel: Pixel, film: ptr<function, PixelFilm>) {
    var wanted = 0u;
    for (var k = 0u; k < params.opaque_two + MARK_WORDS; k++) {
        let word = work.words[k * params.pixels + pixel.index];
        film.first = select(film.first, word, k == 0u);
        wanted = select(wanted, word, k == 1u);
        film.mark = select(film.mark, word, k == 2u);
    }
    for (var k = 0u; k < 2u * params.opaque_two; k++) {
        film.counts = select(film.counts, vec4u(counters[4u * pixel.index + k]), vec4u(0u, 1u, 2u, 3u) == vec4u(k));
    }
    film.s = film.first;
    film.end = film.first + min(wanted - film.first, params.max_samples);
    // A block's sums start at zero. Those of a pixel without samples go from one texture to the other.
    if film.first % BLOCK != 0u || film.first == film.end {
        film.sum_0 = textureLoad(running_in, pixel.texel, 0, 0);
        film.sum_1 = textureLoad(running_in, pixel.texel, 1, 0);
        film.sum_2 = textureLoad(running_in, pixel.texel, 2, 0);
        film.sum_3 = textureLoad(running_in, pixel.texel, 3, 0);
    }
}

// Stores the sum of replicate k, and word k of the counts.
fn store_replicate(pixel: Pixel, film: ptr<function, PixelFilm>, k: u32) {
    let sum = select(select(film.sum_0, film.sum_1, k == 1u), select(film.sum_2, film.sum_3, k == 3u), k >= 2u);
    textureStore(running_out, pixel.texel, k, sum);
    counters[4u * pixel.index + k] = select(
        select(film.counts.x, film.counts.y, k == 1u),
        select(film.counts.z, film.counts.w, k == 3u),
        k >= 2u
    );
}

fn count_ray(film: ptr<function, PixelFilm>, traced: bool) {
    film.counts.x += select(0u, 1u, traced);
}

// A path has met a surface after it had scattered from another: there, light may come that has not been found yet.
const FURTHER: u32 = 0x8000u;

fn note_further(film: ptr<function, PixelFilm>, further: bool) {
    film.counts.y |= select(0u, FURTHER, further);
}

// The same behind mirrors or glass, where no light path can arrive; and such a path has found a light by way of mirrors or glass.
const HIDDEN: u32 = 0x4000u;
const FOUND: u32 = 0x2000u;

fn note_hidden(film: ptr<function, PixelFilm>, further: bool, found: bool) {
    film.counts.y |= select(0u, HIDDEN, further) | select(0u, FOUND, found);
}

fn count_truncated(film: ptr<function, PixelFilm>, truncated: bool) {
    film.counts.y += select(0u, 1u, truncated);
}

// Adds the radiance of a sample that has `ended`, and goes to the next. A sample that is not finite is left out and counted.
fn add_sample(film: ptr<function, PixelFilm>, radiance: vec3f, ended: bool) {
    let y = dot(radiance, vec3f(0.2126, 0.7152, 0.0722));
    // WGSL may assume that there is no NaN: look at the bits.
    let finite = (bitcast<u32>(y) & 0x7fffffffu) < 0x7f800000u;
    let replicate = film.s / ROUND_SAMPLES % REPLICATES;
    // The square serves the error of a single replicate alone; it must not overflow.
    let bounded = fmin(y, 1.0e15);
    let added = vec4f(radiance, bounded * bounded);
    let adds = ended && finite;
    film.sum_0 = select(film.sum_0, film.sum_0 + added, adds && replicate == 0u);
    film.sum_1 = select(film.sum_1, film.sum_1 + added, adds && replicate == 1u);
    film.sum_2 = select(film.sum_2, film.sum_2 + added, adds && replicate == 2u);
    film.sum_3 = select(film.sum_3, film.sum_3 + added, adds && replicate == 3u);
    let lacks = ended && !finite;
    film.counts.y |= select(0u, (film.s % BLOCK + 1u) << 16u, lacks && film.counts.y < 0x10000u);
    let one = 1u << (16u * (replicate % 2u));
    film.counts.z += select(0u, one, lacks && replicate < 2u);
    film.counts.w += select(0u, one, lacks && replicate >= 2u);
    film.s += select(0u, 1u, ended);
}
