// A light chosen among all, by choose_light.

struct Chosen {
    light: DiskLight,
    index: u32,
    cap: Cap,
    // 1 / probability of this light among all, and the sum of all weights.
    inverse_probability: f32,
    weights: f32,
}
