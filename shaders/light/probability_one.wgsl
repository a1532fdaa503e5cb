// The only light is always chosen.

fn light_probability(index: u32, light: DiskLight, p: vec3f, to: Receiver, weights: f32) -> f32 {
    return 1.0;
}
