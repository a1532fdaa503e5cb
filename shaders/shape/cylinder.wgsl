// Capped cylinders. A capped cylinder is the intersection of an infinite cylinder and the slab between the caps. A ray is inside it
// where it is inside both, so its interval is the intersection of two intervals, which makes the rim watertight [Cychosz1994].
//
// In the plane across the axis, A = |d|^2 and B = m.d. The discriminant is A (r^2 - |w|^2), where w is the point of the ray's line
// nearest to the axis. This form keeps the precision that B^2 - A C loses.

// Parts of a cylinder's key.
const CYLINDER_SIDE: u32 = 0u;
const CYLINDER_BASE: u32 = 1u;
const CYLINDER_TOP: u32 = 2u;

// A ray whose squared sine to the axis is below this counts as parallel to the axis, and can meet only the caps.
const ALONG_AXIS: f32 = 1.0e-12;

struct Cylinder {
    base: vec3f,
    radius: f32,
    axis: vec3f,
    // axis . p on the planes of the two caps.
    offsets: vec2f,
}

// Where a ray is inside the cylinder.
struct Span {
    enter: f32,
    leave: f32,
    // Whether it enters and leaves through a cap, not through the side.
    enter_by_cap: bool,
    leave_by_cap: bool,
    // The ray runs up the axis.
    up: bool,
    // The ray meets the infinite cylinder at all.
    crosses: bool,
}

fn cylinder_span(ray: Ray, c: Cylinder, side: u32, base: u32, top: u32) -> Span {
    // The slab between the caps. If the ray starts in the plane of a cap, that cap is at distance 0. The formula is that of planes
    // and disks, so coincident faces are met at the same distance, to the last bit.
    let along = dot(c.axis, ray.d);
    let inv_cos = safe_inverse(along);
    let height = dot(c.axis, ray.o);
    let at_base = select((c.offsets.x - height) * inv_cos, 0.0, ray.face == base);
    let at_top = select((c.offsets.y - height) * inv_cos, 0.0, ray.face == top);
    let slab_enter = fmin(at_base, at_top);
    let slab_leave = fmax(at_base, at_top);

    // The infinite cylinder.
    let from_base = ray.o - c.base;
    let m = from_base - c.axis * dot(c.axis, from_base);
    let d = ray.d - c.axis * along;
    let a = dot(d, d);
    let b = dot(m, d);
    let parallel = a < ALONG_AXIS;
    let inv_a = 1.0 / fmax(a, ALONG_AXIS);
    let w = m - d * select(b * inv_a, 0.0, parallel);
    let inside = c.radius * c.radius - dot(w, w);
    // If the ray starts on the side, one root is exactly 0, so the square root must be |b|.
    let root = select(safe_sqrt(a * inside), abs(b), ray.face == side);
    let near = select((-b - root) * inv_a, -FAR, parallel);
    let far = select((root - b) * inv_a, FAR, parallel);
    let by_cap = slab_enter >= near;
    let to_cap = slab_leave < far;
    return Span(
        select(near, slab_enter, by_cap),
        select(far, slab_leave, to_cap),
        by_cap,
        to_cap,
        along > 0.0,
        inside >= 0.0,
    );
}

// The parts that a ray enters and leaves by.
fn enter_part(s: Span) -> u32 {
    return select(CYLINDER_SIDE, select(CYLINDER_TOP, CYLINDER_BASE, s.up), s.enter_by_cap);
}

fn leave_part(s: Span) -> u32 {
    return select(CYLINDER_SIDE, select(CYLINDER_BASE, CYLINDER_TOP, s.up), s.leave_by_cap);
}

// Whether a ray from outside meets the cylinder.
fn enters(ray: Ray, s: Span, side: u32, base: u32, top: u32) -> bool {
    let met = s.crosses && s.enter < s.leave && s.leave > 0.0 && ray.face != side;
#if LIT_CAPS
    // A shadow ray does not meet the cap on which the light that it aims at lies flush.
    return met && !(s.enter_by_cap && ray.target_face == select(top, base, s.up));
#else
    return met;
#endif
}

// Whether a ray from inside meets the cylinder. It always does, unless it is a shadow ray that leaves through the cap on which its
// light lies flush.
fn leaves(ray: Ray, s: Span, base: u32, top: u32) -> bool {
#if LIT_CAPS
    return !(s.leave_by_cap && ray.target_face == select(base, top, s.up));
#else
    return true;
#endif
}

// For a ray known to be outside.
fn cylinder_outside(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    return nearer(hit, enters(ray, s, side, base, top), fmax(s.enter, 0.0), key + enter_part(s));
}

// For a ray known to be inside.
fn cylinder_inside(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    return nearer(hit, leaves(ray, s, base, top), fmax(s.leave, 0.0), key + leave_part(s));
}

// The boundary of dielectric solid `solid` inside `parent`.
fn cylinder_boundary(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    let inside = ray.medium == solid;
    let t = fmax(select(s.enter, s.leave, inside), 0.0);
    let met = (inside && leaves(ray, s, base, top)) || (ray.medium == parent && enters(ray, s, side, base, top));
    return nearer(hit, met, t, key + select(enter_part(s), leave_part(s), inside));
}

// The same for shadow rays, if the solid holds no light: every ray that starts inside is blocked.
fn cylinder_boundary_shadow(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    let met = ray.medium == solid || (ray.medium == parent && enters(ray, s, side, base, top) && s.enter < hit.t);
    return Hit(hit.t, select(hit.key, key, met));
}

// Whether cylinder_outside would meet anything nearer than hit.t: for shadow rays, which need neither distance nor part.
fn cylinder_shadow(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    let met = enters(ray, s, side, base, top) && s.enter < hit.t;
    return Hit(hit.t, select(hit.key, key, met));
}
