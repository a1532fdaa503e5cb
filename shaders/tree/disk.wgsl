// A leaf that holds a disk.
// A template: see tree/visit.wgsl.

fn $walk_leaf(hit: Hit, ray: Ray, place: vec2u, a: vec4u, b: vec4u) -> Hit {
    let c = textureLoad(records, place + vec2u(2u, 0u));
    let item = c.x;
    let i = (item >> 1u) - 1u;
    let disk = Disk(bitcast<vec3f>(a.xyz), bitcast<f32>(a.w), bitcast<vec3f>(b.xyz), bitcast<f32>(b.w));
    return $keep;
}
