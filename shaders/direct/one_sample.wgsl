// One shadow ray at each vertex.

fn direct_light(asks: bool, x: ptr<function, Interaction>, to: Receiver, key: vec4u, u: Draws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    return light_sample(asks, x, to, LightDraws(vec2f(u.light, u.spare), u.light_point, u.lobe), depth, film);
}
