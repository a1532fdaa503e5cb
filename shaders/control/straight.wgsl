// Straight code, for adapters whose lanes run in step: a software adapter goes through both sides of a branch for all its lanes.
// three_materials ran 1.08 to 1.1 times as fast as with branching.wgsl, and compiled in 0.8 of the time.

fn scatter_if(meets: bool, path: ptr<function, Path>, hit: Hit, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) -> bool {
    return scatter(path, meets, hit, pixel, sight, film);
}

fn direct_light_if(asks: bool, x: ptr<function, Interaction>, to: Receiver, key: vec4u, u: Draws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    return direct_light(asks, x, to, key, u, depth, film);
}

fn gather_bulbs_if(asks: bool, path: ptr<function, Path>, x: ptr<function, Interaction>, u: Draws, film: ptr<function, PixelFilm>) {
    gather_bulbs(asks, path, x, u, film);
}
