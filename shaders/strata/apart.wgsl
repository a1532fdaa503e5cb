// Places and points that are drawn apart from each other: see strata/together.wgsl. The sums of pixels without small things would be no
// better together, and it takes time.

fn first_light_point(pixel: u32, s: u32, seed: u32, apart: vec2f) -> vec2f {
    return apart;
}

fn direction_order(pixel: u32, replicate: u32, i: u32, seed: u32) -> u32 {
    return reverseBits(i);
}
