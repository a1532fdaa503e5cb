// Aims in a storage buffer: src/gpu/aims.rs packs them.

// Of each pair its density, as in start_density. Of each aim five words: centre, radius, number of the surface. Of each surface the number
// of its aim. Of each pair the sum of probabilities so far.
@group(2) @binding(0) var<storage, read> aims: array<u32>;

fn aim_at(index: u32) -> Aim {
    let at = AIM_PLACES + 5u * index;
    let center = vec3f(bitcast<f32>(aims[at]), bitcast<f32>(aims[at + 1u]), bitcast<f32>(aims[at + 2u]));
    return Aim(center, bitcast<f32>(aims[at + 3u]), index);
}

// The aim of the surface with this number.
fn aim_of(surface: u32) -> Aim {
    return aim_at(aims[AIM_NUMBERS + surface]);
}

// See start_density; 0 for a pair that no light path has.
fn aim_density(light: u32, index: u32) -> f32 {
    return select(bitcast<f32>(aims[light * AIM_COUNT + index]), 0.0, index == AIM_COUNT);
}
