// The probability with which choose_light takes a light, in proportion to its weight among all `weights`.

fn light_probability(index: u32, light: DiskLight, p: vec3f, to: Receiver, weights: f32) -> f32 {
    return light_weight(light, p, to) / fmax(weights, TINY);
}
