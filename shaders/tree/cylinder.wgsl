// A leaf that holds a cylinder.
// A template: see tree/visit.wgsl.

fn $walk_leaf(hit: Hit, ray: Ray, place: vec2u, a: vec4u, b: vec4u) -> Hit {
    let c = textureLoad(records, place + vec2u(2u, 0u));
    let d = textureLoad(records, place + vec2u(3u, 0u));
    let item = d.w;
    let i = (item >> 1u) - 1u;
    let ends = vec2f(bitcast<f32>(b.w), bitcast<f32>(d.x));
    let cylinder = Cylinder(bitcast<vec3f>(a.xyz), bitcast<f32>(a.w), bitcast<vec3f>(b.xyz), ends);
    return $keep;
}
