// A scene in storage buffers.

@group(0) @binding(0) var<storage, read> surfaces: array<Surface>;
@group(0) @binding(1) var<storage, read> materials: array<Material>;
@group(0) @binding(2) var<storage, read> lights: array<DiskLight>;

fn surface_at(key: u32) -> Surface {
    return surfaces[key >> 2u];
}

fn face_at(key: u32, s: Surface) -> u32 {
    return face_of(s, key & 3u);
}

fn material_at(index: u32) -> Material {
    return materials[index];
}

fn light_at(index: u32) -> DiskLight {
    return lights[index];
}
