// No images in mirror balls are sought.

struct ImageTrail {
    unused: u32,
}

fn begin_trail(path: ptr<function, Path>, ended: bool) {}

fn is_sent(trail: ImageTrail) -> bool {
    return false;
}

fn trail_goes_on(trail: ImageTrail, x: ptr<function, Interaction>) -> bool {
    return true;
}

fn counts_light(trail: ImageTrail, light: u32) -> bool {
    return true;
}

fn follow_images(path: ptr<function, Path>, x: ptr<function, Interaction>, light_weights: f32, u: Draws, s: ptr<function, Scattered>) -> bool {
    return false;
}
