// No glances: the eye can see no light, directly or in mirrors and glass; or the picture keeps no such light; or an older driver grants
// too few loop trips.

const MARK_WORDS: u32 = 0u;

struct Sight {
    glances: u32,
    across: u32,
}

fn sight_of(mark: u32) -> Sight {
    return Sight(0u, 1u);
}

fn is_glance(path: ptr<function, Path>) -> bool {
    return false;
}

fn sees_lights(path: ptr<function, Path>, sight: Sight) -> bool {
    return true;
}

fn share_of_light(path: ptr<function, Path>, sight: Sight) -> f32 {
    return 1.0;
}

fn looks_on(path: ptr<function, Path>, sight: Sight) -> bool {
    return true;
}

fn glances_after(path: ptr<function, Path>, sight: Sight) -> u32 {
    return 0u;
}

fn vertex_seed(path: ptr<function, Path>) -> u32 {
    return params.seed;
}

fn way_at_glass(path: ptr<function, Path>, pixel: Pixel, s: u32, sight: Sight) -> u32 {
    return BY_CHANCE;
}
