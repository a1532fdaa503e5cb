// Spheres [Haines2019]: with f from centre to origin and b = -f.d, the part l of f across the ray
// gives the discriminant r^2 - l.l without the cancellation of b^2 - c; the roots are c/q and q.

struct Sphere {
    center: vec3f,
    radius: f32,
}

// The entering root, for a ray known to be outside. An origin that rounding put a little inside is on
// the surface: the hit is at 0 if the ray heads inwards, else there is none. The surface is convex, so
// a ray that leaves its face never comes back to it.
fn sphere_outside(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let c = max(dot(f, f) - s.radius * s.radius, 0.0);
    let t = c / (b + safe_sqrt(disc));
    return nearer(hit, disc >= 0.0 && b > 0.0 && ray.face != face, t, key);
}

// Whether sphere_outside would meet anything nearer than hit.t, without root or quotient: for shadow rays,
// which need no distance. The entering root b - sqrt(disc) lies below t where b does, or where
// disc > (b - t)^2.
fn sphere_shadow(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let beyond = max(b - hit.t, 0.0);
    let met = disc >= 0.0 && b > 0.0 && beyond * beyond <= disc && ray.face != face;
    return Hit(hit.t, select(hit.key, key, met));
}

// The leaving root, for a ray known to be inside. From the sphere's own face the other root, 0, is
// divided out.
fn sphere_inside(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let q = max(abs(b) + safe_sqrt(s.radius * s.radius - dot(l, l)), TINY);
    let c = dot(f, f) - s.radius * s.radius;
    let ahead = select(-c / q, q, b > 0.0);
    let t = select(ahead, 2.0 * b, ray.face == face);
    return nearer(hit, true, max(t, 0.0), key);
}

// The boundary of dielectric solid `solid` inside `parent`.
fn sphere_boundary(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let inside = ray.medium == solid;
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let q = max(abs(b) + safe_sqrt(disc), TINY);
    let c = dot(f, f) - s.radius * s.radius;
    let on = ray.face == face;
    let ahead = select(-c / q, q, b > 0.0);
    let leaving = select(ahead, 2.0 * b, on);
    let enters = ray.medium == parent && disc >= 0.0 && b > 0.0 && !on;
    return nearer(hit, inside || enters, max(select(c / q, leaving, inside), 0.0), key);
}

// For shadow rays: whatever starts inside a solid that holds no light is in its shadow.
fn sphere_boundary_shadow(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let outside = sphere_shadow(hit, ray, s, face, key);
    let met = ray.medium == solid || (ray.medium == parent && outside.key != hit.key);
    return Hit(hit.t, select(hit.key, key, met));
}
