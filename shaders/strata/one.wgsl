// One stratum: the whole pixel.

fn in_stratum(pixel: u32, s: u32, seed: u32, jitter: vec2f, own: bool) -> vec2f {
    return jitter;
}
