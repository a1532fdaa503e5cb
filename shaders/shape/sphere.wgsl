// Spheres [Haines2019]. f leads from the centre to the origin of the ray, and b = -f.d. The part l of f across the ray gives the
// discriminant r^2 - l.l, without the cancellation of b^2 - c. The roots are b -+ sqrt(disc). For a small root the form c/q would not
// be more accurate, because c = f.f - r^2 has lost as many digits; and every hit is moved onto its surface afterwards.

struct Sphere {
    center: vec3f,
    radius: f32,
}

// The entering root, for a ray known to be outside. If rounding has put the origin slightly inside, the hit is at distance 0 if the
// ray heads inwards, and there is none otherwise. A sphere is convex, so a ray that starts on its outside never meets it again.
fn sphere_outside(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let t = fmax(b - safe_sqrt(disc), 0.0);
    return nearer(hit, disc >= 0.0 && b > 0.0 && ray.face != face, t, key);
}

// For shadow rays, which need no distance: whether sphere_outside would find a hit nearer than hit.t. This takes no square root: the
// entering root b - sqrt(disc) is less than t if b < t, or if disc > (b - t)^2.
fn sphere_shadow(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32) -> Hit {
    let f = ray.o - s.center;
    let b = -dot(f, ray.d);
    let l = f + b * ray.d;
    let disc = s.radius * s.radius - dot(l, l);
    let beyond = fmax(b - hit.t, 0.0);
    let met = disc >= 0.0 && b > 0.0 && beyond * beyond <= disc && ray.face != face;
    return Hit(hit.t, select(hit.key, key, met));
}

// The leaving root, for a ray known to be inside. If the ray starts on the sphere, one root is exactly 0, and the other is 2 b.
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

// The same for shadow rays, if the solid holds no light: every ray that starts inside is blocked.
fn sphere_boundary_shadow(hit: Hit, ray: Ray, s: Sphere, face: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let outside = sphere_shadow(hit, ray, s, face, key);
    let met = ray.medium == solid || (ray.medium == parent && outside.key != hit.key);
    return Hit(hit.t, select(hit.key, key, met));
}
