// SHADOW_RAYS shadow rays at each vertex, whose choices of lights are stratified.

fn direct_light(asks: bool, x: ptr<function, Interaction>, to: Receiver, key: vec4u, u: Draws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    var direct = DirectLight(vec3f(0.0), 0.0);
    for (var k = 0u; k < u32(SHADOW_RAYS); k++) {
        // The first sample takes the numbers of the vertex itself, which may be of low discrepancy.
        let more = draw(key + vec4u(0u, 0u, k << SHADOW_RAY_SHIFT, 0u));
        let point = select(more.light_point, u.light_point, k == 0u);
        let light = select(more.light, u.light, k == 0u);
        let lobe = select(more.lobe, u.lobe, k == 0u);
        let spare = select(more.spare, u.spare, k == 0u);
        let which = (light + f32(k)) * (1.0 / SHADOW_RAYS);
        let one = light_sample(asks, x, to, LightDraws(vec2f(which, spare), point, lobe), depth, film);
        direct = DirectLight(direct.radiance + one.radiance, one.weights);
    }
    return direct;
}
