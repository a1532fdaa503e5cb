// Receivers of light in scenes without glossy materials.

// The surface for which a light is chosen: its normal.
struct Receiver {
    n: vec3f,
}

fn receiver_at(x: ptr<function, Interaction>) -> Receiver {
    return Receiver(x.n);
}

// How much of the light from a ball the receiver scatters, up to a factor: see receiver_glossy.wgsl.
fn scattered(at: Receiver, to: vec3f, inverse: f32, radius: f32) -> f32 {
    return 1.0;
}

fn sample_light(light: DiskLight, cap: Cap, at: Receiver, u: vec2f, choice: f32) -> LightSample {
    return sample_cap(light, cap, u);
}
