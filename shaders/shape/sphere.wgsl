// Spheres [Haines2019]: with f from centre to origin and b = -f.d, the part l of f across the ray
// gives the discriminant r^2 - l.l without the cancellation of b^2 - c. The roots are taken as b -+ sqrt(disc): c/q would
// keep the digits of a small root, but c = f.f - r^2 has lost as many, and what is met is put back on its surface.

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
    let t = fmax(b - safe_sqrt(disc), 0.0);
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
    let beyond = fmax(b - hit.t, 0.0);
    let met = disc >= 0.0 && b > 0.0 && beyond * beyond <= disc && ray.face != face;
    return Hit(hit.t, select(hit.key, key, met));
}

// The leaving root, for a ray known to be inside. From the sphere's own face the other root, 0, is
// divided out.
fn sphere_inside(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let root = safe_sqrt(s.radius * s.radius - dot(l, l));
    let t = b + select(root, b, ray.face == face);
    return nearer(hit, true, fmax(t, 0.0), key);
}

// The boundary of dielectric solid `solid` inside `parent`.
fn sphere_boundary(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let inside = ray.medium == solid;
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let root = safe_sqrt(disc);
    let on = ray.face == face;
    let enters = ray.medium == parent && disc >= 0.0 && b > 0.0 && !on;
    let t = b + select(-root, select(root, b, on), inside);
    return nearer(hit, inside || enters, fmax(t, 0.0), key);
}

// For shadow rays: whatever starts inside a solid that holds no light is in its shadow.
fn sphere_boundary_shadow(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let outside = sphere_shadow(hit, ray, s, face, key);
    let met = ray.medium == solid || (ray.medium == parent && outside.key != hit.key);
    return Hit(hit.t, select(hit.key, key, met));
}
