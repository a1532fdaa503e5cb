// Several rays that are traced one after another: see rays/queued.wgsl.

struct Queue {
    // A shadow ray, and how far away its light is.
    shadow: Ray,
    distance: f32,
    shadow_waits: bool,
    // The path's own ray, and whether it comes from the eye.
    own: Ray,
    own_waits: bool,
    own_from_eye: bool,
    // The ray to be traced if the path's own meets nothing.
    spare: Ray,
    spare_waits: bool,
    // Where rays from the eye begin, in this pixel: see `entry_of`.
    entry: vec4u,
}

struct Traced {
    hit: Hit,
    // The shadow ray has met something.
    blocked: bool,
    // The path's own ray has met nothing, and `hit` is the spare one's.
    passed: bool,
}

// Where the camera rays of a pixel begin their walks: a unit, or AT_ROOTS, and three words of what is put off. They can meet nothing else:
// src/world/tree/beam.rs has found this out for a square of pixels.
const AT_ROOTS: u32 = 0xffffffffu;

fn entry_of(place: vec2u) -> vec4u {
    let cell = place / CELL_SIDE;
    return record(CELL_RECORDS + cell.y * CELLS_A_ROW + cell.x);
}

fn either_ray(a: Ray, b: Ray, second: bool) -> Ray {
    return Ray(
        select(a.o, b.o, second),
        select(a.d, b.d, second),
        select(a.face, b.face, second),
        select(a.medium, b.medium, second),
        select(a.target_face, b.target_face, second)
    );
}

fn either_slabs(a: Slabs, b: Slabs, second: bool) -> Slabs {
    return Slabs(select(a.inverse, b.inverse, second), select(a.slack, b.slack, second));
}

fn either_hit(a: Hit, b: Hit, second: bool) -> Hit {
    return Hit(select(a.t, b.t, second), select(a.key, b.key, second));
}

// The nearer of two hits. What a shadow ray meets counts only if the surface of `item` can block light at all: it alone has a light to reach.
fn keep_queued(hit: Hit, found: Hit, item: u32, ray: Ray) -> Hit {
    let counts = (item & 1u) == 1u || ray.target_face == NO_FACE;
    return either_hit(hit, keep_nearest(hit, found, item), counts);
}
