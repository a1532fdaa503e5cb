// Glances: extra camera rays of a sample, in pixels that the host marks. They gather nothing but lights, seen directly or by way of
// mirrors and glass. The edge of a light, and of its image, is by far the noisiest thing in most pictures, and a camera ray costs
// a tenth of a path. The path itself does not gather again what its glances have seen.

// A third word for each pixel: its mark.
const MARK_WORDS: u32 = 1u;

// What the mark of a pixel says.
struct Sight {
    // Glances of each sample: across x across.
    glances: u32,
    across: u32,
    // The last vertex at which they look for a light.
    depth: u32,
    // The vertex of glass at which half of them are refracted and half reflected; 0: chance decides everywhere.
    branch: u32,
}

fn sight_of(mark: u32) -> Sight {
    let depth = mark & 0xffu;
    let many = ((mark >> MANY_SHIFT) == 1u) | !GLANCE_CHAINS;
    let across = select(CHAIN_GLANCES, GLANCES, many);
    return Sight(select(0u, across * across, depth > 0u), across, depth, (mark >> BRANCH_SHIFT) & 0xffu);
}

fn is_glance(path: ptr<function, Path>) -> bool {
    return path.glances > 0u;
}

// Whether the path gathers a light that it meets now.
fn sees_lights(path: ptr<function, Path>, sight: Sight) -> bool {
    return is_glance(path) | !path.all_specular | (path.depth > sight.depth);
}

// A glance counts for its share of the sample.
fn share_of_light(path: ptr<function, Path>, sight: Sight) -> f32 {
    return select(1.0, 1.0 / f32(sight.across * sight.across), is_glance(path));
}

// Whether the path continues from a surface that it meets now.
fn looks_on(path: ptr<function, Path>, sight: Sight) -> bool {
    return !is_glance(path) | (GLANCE_CHAINS & (path.depth < sight.depth));
}

// Glances to be sent when this path has ended.
fn glances_after(path: ptr<function, Path>, sight: Sight) -> u32 {
    return select(sight.glances, path.glances - 1u, is_glance(path));
}

// The seed of a vertex: every glance has random numbers of its own.
fn vertex_seed(path: ptr<function, Path>) -> u32 {
    return params.seed ^ select(0u, path.glances * GLANCE_STREAM, GLANCE_CHAINS);
}

// What the path does if it meets glass now. At the vertex that the mark names, half of the glances are reflected and half refracted. The
// halves are the black and the white fields of a chess board. A coin that is tossed for each sample decides which are reflected.
fn way_at_glass(path: ptr<function, Path>, pixel: Pixel, s: u32, sight: Sight) -> u32 {
    let coin = hash_pixel(pixel.key, s, params.seed ^ COIN_STREAM).x;
    let field = (path.glances ^ ((path.glances - 1u) >> (sight.across >> 1u)) ^ coin) & 1u;
    return select(BY_CHANCE, field, GLANCE_CHAINS & is_glance(path) & (path.depth == sight.branch));
}
