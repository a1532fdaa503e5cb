// No images in mirror balls are sought.

struct ImageTrail {
    unused: u32,
}

fn begin_trail(path: ptr<function, Path>, ended: bool) {}

fn is_sent(trail: ImageTrail) -> bool {
    return false;
}

fn trail_goes_on(trail: ImageTrail, x: Interaction) -> bool {
    return true;
}

fn counts_light(trail: ImageTrail, light: u32) -> bool {
    return true;
}

fn follow_images(path: ptr<function, Path>, x: Interaction, light_weights: f32, u: Draws, s: ptr<function, Scattered>) -> bool {
    return false;
}

fn next_turn(path: ptr<function, Path>, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) {
    trace_vertex(path, pixel, sight, film);
}
