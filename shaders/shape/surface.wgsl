// What a ray has met: the point, moved onto its surface, the normal, and the material.

// One for each surface, lights first: its number is key / 4. A sphere counts as a cylinder whose axis is zero. A plane has no radius.
struct Surface {
    // Centre; of a cylinder, the centre of its base; of a huge sphere, the pole.
    point: vec3f,
    radius: f32,
    // Normal of a flat surface, axis of a cylinder, normal at the pole of a huge sphere; zero for a sphere.
    axis: vec3f,
    // axis . p on the plane, or on the base of a cylinder; curvature of a huge sphere.
    offset: f32,
    // Identities of the faces of parts 0, 1, 2: 1 + the key of the first face in the same plane.
    faces: vec3u,
    // Number of its material; lights have none.
    material: u32,
    // axis . p on a cylinder's top.
    top: f32,
    // The dielectric solid that it bounds, and the one around that.
    solid: u32,
    parent: u32,
    // A SHAPE_ constant.
    shape: u32,
}

fn face_of(s: Surface, part: u32) -> u32 {
#if PARTS
    return select(select(s.faces.x, s.faces.y, part == 1u), s.faces.z, part == 2u);
#else
    return s.faces.x;
#endif
}

// Scattering parameters. `kind`, a MATERIAL_ constant, decides which of them are used.
struct Material {
    // Reflectance, transmittance, or kd.
    color: vec3f,
    kind: u32,
    // ks.
    specular: vec3f,
    // Phong exponent, or index of refraction inside over outside.
    exponent: f32,
}

struct Vertex {
    // On the surface.
    p: vec3f,
    // Unit normal, on the outside of a solid or the front of a flat surface.
    n: vec3f,
}

fn vertex_at(ray: Ray, hit: Hit, s: Surface) -> Vertex {
    let part = hit.key & 3u;
    let p = ray.o + hit.t * ray.d;
#if IMPLICIT
    if s.shape == SHAPE_IMPLICIT {
        return implicit_vertex(hit.key, p, ray.d);
    }
#endif
#if ROUND
    let m = p - s.point;
#endif
#if FLAT
    // Onto the plane.
#if CYLINDER
    let top = part == 2u;
    let offset = select(s.offset, s.top, top);
#else
    let offset = s.offset;
#endif
    var v = Vertex(p - s.axis * (dot(s.axis, p) - offset), s.axis);
#if CYLINDER
    // The outward normal of the base is opposite to the axis.
    v.n = select(v.n, -v.n, part == 1u);
#endif
#endif
#if ROUND
    // Radially: from the centre of a sphere, from the axis of a cylinder.
    let along = s.axis * dot(s.axis, m);
    let across = m - along;
    let distance2 = dot(across, across);
    // If a surface is smaller than the rounding error of its position, the hit may be at its very centre.
    let n = select(across * inverseSqrt(fmax(distance2, TINY_SQUARE)), -ray.d, distance2 < TINY_SQUARE);
    let round = Vertex(s.point + along + s.radius * n, n);
#if FLAT
    let curved = s.shape >= SHAPE_CYLINDER && part == 0u;
    v = Vertex(select(v.p, round.p, curved), select(v.n, round.n, curved));
#else
    var v = round;
#endif
#endif
#if HUGE_SPHERE
    // Moves the point along the normal by its height above the surface. s.axis is the normal at the pole, s.offset the curvature.
    let w = p - s.point;
    let normal = normalize(s.axis + s.offset * w);
    let height = 0.5 * s.offset * dot(w, w) + dot(s.axis, w);
    let huge = s.shape == SHAPE_HUGE_SPHERE;
    v = Vertex(select(v.p, p - normal * height, huge), select(v.n, normal, huge));
#endif
    return v;
}
