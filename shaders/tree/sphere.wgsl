// A leaf that holds a sphere.
// A template: see tree/visit.wgsl.

fn $walk_leaf(hit: Hit, ray: Ray, place: vec2u, a: vec4u, b: vec4u) -> Hit {
    let item = b.x;
    let i = (item >> 1u) - 1u;
    let sphere = Sphere(bitcast<vec3f>(a.xyz), bitcast<f32>(a.w));
    return $keep;
}
