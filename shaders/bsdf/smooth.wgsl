// Scattering where some surface has smooth normals: x.n is the smooth one, x.geometric the surface's own. What is scattered to the wrong
// side of the surface is lost.

fn sample_bsdf(x: ptr<function, Interaction>, u: Draws) -> Scattered {
    var scattered = sample_material(x, u);
    let crosses = scattered.medium != x.medium;
    let right = (dot(x.geometric, scattered.wi) < 0.0) == crosses;
    scattered.weight = select(vec3f(0.0), scattered.weight, right);
    return scattered;
}
