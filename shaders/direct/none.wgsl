// No light sampling by straight shadow rays: the scene has no light, or bulbs alone, or no surface that scatters into more than one direction, or the picture keeps no such light.

struct DirectLight {
    radiance: vec3f,
    weights: f32,
}

fn direct_light(asks: bool, x: ptr<function, Interaction>, to: Receiver, key: vec4u, u: Draws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    return DirectLight(vec3f(0.0), 0.0);
}

// Light met by chance counts in full.
fn chance_weight(path: ptr<function, Path>, light: DiskLight, index: u32) -> f32 {
    return 1.0;
}
