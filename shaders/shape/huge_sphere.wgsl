// Spheres far larger than the scene, given by their curvature k, as in lens design. Relative to the surface point nearest the scene,
// the quadratic is k t^2 + 2 B t + C = 0. Its coefficients stay small, and with k = 0 it is the equation of a plane.

struct HugeSphere {
    pole: vec3f,
    curvature: f32,
    normal: vec3f,
}

struct HugeRoots {
    // -B: positive if the ray heads inwards.
    b: f32,
    // Twice the height above the surface, to first order.
    c: f32,
    disc: f32,
}

fn huge_roots(ray: Ray, s: HugeSphere) -> HugeRoots {
    let v = ray.o - s.pole;
    let b = -(s.curvature * dot(v, ray.d) + dot(s.normal, ray.d));
    let c = s.curvature * dot(v, v) + 2.0 * dot(s.normal, v);
    return HugeRoots(b, c, b * b - s.curvature * c);
}

fn huge_sphere_outside(hit: Hit, ray: Ray, s: HugeSphere, face: u32, key: u32) -> Hit {
    let r = huge_roots(ray, s);
    let t = fmax(r.c, 0.0) / (r.b + safe_sqrt(r.disc));
    return nearer(hit, r.disc >= 0.0 && r.b > 0.0 && ray.face != face, t, key);
}

fn huge_sphere_inside(hit: Hit, ray: Ray, s: HugeSphere, face: u32, key: u32) -> Hit {
    let r = huge_roots(ray, s);
    let q = fmax(abs(r.b) + safe_sqrt(r.disc), TINY);
    let ahead = select(-r.c / q, q / s.curvature, r.b > 0.0);
    let t = select(ahead, 2.0 * r.b / s.curvature, ray.face == face);
    return nearer(hit, true, fmax(t, 0.0), key);
}

fn huge_sphere_boundary(hit: Hit, ray: Ray, s: HugeSphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    if ray.medium == solid {
        return huge_sphere_inside(hit, ray, s, face, key);
    }
    let met = huge_sphere_outside(hit, ray, s, face, key);
    return Hit(select(hit.t, met.t, ray.medium == parent), select(hit.key, met.key, ray.medium == parent));
}
