// The light that choose_light has chosen among all.

struct Chosen {
    light: DiskLight,
    index: u32,
    cap: Cap,
    // 1 / probability of this light among all, and the sum of all weights if that is needed later.
    inverse_probability: f32,
    weights: f32,
}
