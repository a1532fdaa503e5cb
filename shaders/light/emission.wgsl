// Lights that a path meets by chance.

// The radiance of a light that the path meets by chance, without the path's factor beta.
fn emission(path: ptr<function, Path>, hit: Hit) -> vec3f {
    let index = hit.key >> 2u;
    let light = light_at(index);
    let front = dot(path.ray.d, light.normal) < 0.0;
    let counts = front & keeps(path.depth - 1u);
    let share = share_beside_bulbs(path, hit, light, index, share_of_chance(path, hit, light, index));
    let weight = chance_weight(path, light, index) * share * light_scale(path.ray.medium);
    return light.radiance * select(0.0, weight, counts);
}
