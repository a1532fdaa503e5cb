// The values of a large scene, in one storage texture. If each lane has an index of its own, the alternatives are slower on lavapipe: a
// buffer is loaded word by word, ten times as slow, and a sampled texture with a level of detail for each lane, three times as slow.

@group(0) @binding(0) var records: texture_storage_2d<rgba32uint, read>;

fn record(i: u32) -> vec4u {
    return textureLoad(records, vec2u(i % RECORDS_A_ROW, i / RECORDS_A_ROW));
}

// The place of record 4 i. The three records after it lie beside it in the same row.
fn four_records(i: u32) -> vec2u {
    return vec2u(i % (RECORDS_A_ROW / 4u) * 4u, i / (RECORDS_A_ROW / 4u));
}

fn surface_at(key: u32) -> Surface {
    let at = four_records(SURFACE_RECORDS / 4u + (key >> 2u));
    let a = bitcast<vec4f>(textureLoad(records, at));
    let b = bitcast<vec4f>(textureLoad(records, at + vec2u(1u, 0u)));
    let c = textureLoad(records, at + vec2u(2u, 0u));
    let d = textureLoad(records, at + vec2u(3u, 0u));
    return Surface(a.xyz, a.w, b.xyz, b.w, c.xyz, c.w, bitcast<f32>(d.x), d.y, d.z, d.w);
}

fn face_at(key: u32, s: Surface) -> u32 {
    return face_of(s, key & 3u);
}

fn material_at(index: u32) -> Material {
    let a = record(MATERIAL_RECORDS + 2u * index);
    let b = bitcast<vec4f>(record(MATERIAL_RECORDS + 2u * index + 1u));
    return Material(bitcast<vec3f>(a.xyz), a.w, b.xyz, b.w);
}

fn light_at(index: u32) -> DiskLight {
    let i = LIGHT_RECORDS + 3u * index;
    let a = bitcast<vec4f>(record(i));
    let b = bitcast<vec4f>(record(i + 1u));
    let c = record(i + 2u);
    return DiskLight(a.xyz, a.w, b.xyz, b.w, bitcast<vec3f>(c.xyz), c.w);
}
