// Capped cylinders as the common part of an infinite cylinder and the slab between the caps: the interval
// of the ray inside one intersected with that inside the other, which makes the rim watertight
// [Cychosz1994]. In the plane across the axis, A = |d|^2, B = m.d, and the discriminant is A (r^2 - |w|^2)
// with w the nearest point to the axis, which keeps the precision that B^2 - A C loses.

// Parts of a cylinder's key.
const CYLINDER_SIDE: u32 = 0u;
const CYLINDER_BASE: u32 = 1u;
const CYLINDER_TOP: u32 = 2u;

// Below this squared sine to the axis a ray runs along it: only the caps can be met.
const ALONG_AXIS: f32 = 1.0e-12;

struct Cylinder {
    base: vec3f,
    radius: f32,
    axis: vec3f,
    // axis . p on the planes of the two caps.
    offsets: vec2f,
}

// Where a ray is inside the cylinder, and through which part it enters and leaves.
struct Span {
    enter: f32,
    leave: f32,
    enter_part: u32,
    leave_part: u32,
    // Whether the face that a shadow ray aims at is where it enters, or leaves: a light flush on a cap.
    enter_target: bool,
    leave_target: bool,
    // The ray meets the infinite cylinder at all.
    crosses: bool,
}

fn cylinder_span(ray: Ray, c: Cylinder, side: u32, base: u32, top: u32) -> Span {
    // The slab between the caps. A cap that lies in the plane the ray stands on is at distance 0. The product
    // is that of planes and disks, so that what coincides is met at the same distance to the bit.
    let along = dot(c.axis, ray.d);
    let up = along > 0.0;
    let inv_cos = safe_inverse(along);
    let height = dot(c.axis, ray.o);
    let at_base = select((c.offsets.x - height) * inv_cos, 0.0, ray.face == base);
    let at_top = select((c.offsets.y - height) * inv_cos, 0.0, ray.face == top);
    let slab_enter = select(at_top, at_base, up);
    let slab_leave = select(at_base, at_top, up);

    // The infinite cylinder.
    let from_base = ray.o - c.base;
    let m = from_base - c.axis * dot(c.axis, from_base);
    let d = ray.d - c.axis * along;
    let a = dot(d, d);
    let b = dot(m, d);
    let parallel = a < ALONG_AXIS;
    let inv_a = 1.0 / fmax(a, ALONG_AXIS);
    let w = m - d * (b * inv_a);
    let excess = dot(m, m) - c.radius * c.radius;
    let disc = a * (c.radius * c.radius - dot(w, w));
    // Standing on the side, one root is 0 and the other is known without it: as if the square root were |b|.
    let root = select(safe_sqrt(disc), abs(b), ray.face == side);
    let near = select((-b - root) * inv_a, -FAR, parallel);
    let far = select((root - b) * inv_a, FAR, parallel);

    let by_cap = slab_enter >= near;
    let to_cap = slab_leave < far;
    return Span(
        fmax(slab_enter, near),
        fmin(slab_leave, far),
        select(CYLINDER_SIDE, select(CYLINDER_TOP, CYLINDER_BASE, up), by_cap),
        select(CYLINDER_SIDE, select(CYLINDER_BASE, CYLINDER_TOP, up), to_cap),
        by_cap && ray.target_face == select(top, base, up),
        to_cap && ray.target_face == select(base, top, up),
        select(disc >= 0.0, excess <= 0.0, parallel),
    );
}

// For a ray known to be outside.
fn cylinder_outside(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    let met = s.crosses && s.enter < s.leave && s.leave > 0.0 && ray.face != side && !s.enter_target;
    return nearer(hit, met, fmax(s.enter, 0.0), key + s.enter_part);
}

// For a ray known to be inside.
fn cylinder_inside(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    return nearer(hit, !s.leave_target, fmax(s.leave, 0.0), key + s.leave_part);
}

// The boundary of dielectric solid `solid` inside `parent`.
fn cylinder_boundary(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let s = cylinder_span(ray, c, side, base, top);
    let inside = ray.medium == solid;
    let enters = ray.medium == parent && s.crosses && s.enter < s.leave && s.leave > 0.0 && ray.face != side;
    let t = fmax(select(s.enter, s.leave, inside), 0.0);
    let met = (inside && !s.leave_target) || (enters && !s.enter_target);
    return nearer(hit, met, t, key + select(s.enter_part, s.leave_part, inside));
}

// For shadow rays: whatever starts inside a solid that holds no light is in its shadow.
fn cylinder_boundary_shadow(hit: Hit, ray: Ray, c: Cylinder, side: u32, base: u32, top: u32, key: u32, solid: u32, parent: u32) -> Hit {
    let outside = cylinder_outside(hit, ray, c, side, base, top, key);
    let met = ray.medium == solid || (ray.medium == parent && outside.key != hit.key);
    return Hit(hit.t, select(hit.key, key, met));
}
