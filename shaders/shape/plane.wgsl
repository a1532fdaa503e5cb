// Infinite planes n.p = offset.

struct Plane {
    normal: vec3f,
    offset: f32,
}

// An opaque plane whose normal points to the eye's side. No path ever leaves that side, so a ray meets the plane exactly if it heads
// towards it. If rounding has put the origin behind the plane, the hit is at distance 0. So no ray leaks through the edge of a closed
// room.
fn plane_front(hit: Hit, ray: Ray, p: Plane, face: u32, key: u32) -> Hit {
    let cos = dot(p.normal, ray.d);
    let t = (p.offset - dot(p.normal, ray.o)) * safe_inverse(cos);
    return nearer(hit, cos < 0.0 && ray.target_face != face, fmax(t, 0.0), key);
}

// Two opaque planes that face each other: n.p = low.offset below, and n.p = high above. A ray meets the one that it heads towards.
fn plane_pair(hit: Hit, ray: Ray, low: Plane, high: f32, low_key: u32, high_key: u32) -> Hit {
    let cos = dot(low.normal, ray.d);
    let down = cos < 0.0;
    let key = select(high_key, low_key, down);
    let t = (select(high, low.offset, down) - dot(low.normal, ray.o)) * safe_inverse(cos);
    return nearer(hit, cos != 0.0, fmax(t, 0.0), key);
}

// The boundary of a dielectric half-space. The normal points out of the dielectric.
fn plane_boundary(hit: Hit, ray: Ray, p: Plane, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let cos = dot(p.normal, ray.d);
    let t = (p.offset - dot(p.normal, ray.o)) * safe_inverse(cos);
    let leaves = ray.medium == solid && cos > 0.0;
    let enters = ray.medium == parent && cos < 0.0;
    return nearer(hit, (leaves || enters) && ray.target_face != face, fmax(t, 0.0), key);
}
