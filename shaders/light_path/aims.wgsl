// Where light paths are aimed, and how dense they are: see src/world/aims.rs. A light path starts at a point that is uniform on its
// light, in the cone of directions to a sphere around a specular surface.

struct Aim {
    // The sphere.
    center: vec3f,
    radius: f32,
    // Its number among the aims; AIM_COUNT: there is none.
    index: u32,
}

// The directions in which light paths start at one point of a light.
struct Cone {
    axis: vec3f,
    // 1 - cos of half its angle.
    height: f32,
    // It is too wide, or the point lies in the sphere: directions are cosine-distributed about the light's normal instead. A cone around
    // all directions would have a density without the cosine that light leaves with.
    wide: bool,
}

// The squared sine of half a cone's angle from which on it is wide. src/world/aims.rs has the same number.
const WIDE: f32 = 0.9375;

fn cone_to(center: vec3f, radius: f32, y: vec3f) -> Cone {
    let to = center - y;
    let inverse = inverseSqrt(fmax(dot(to, to), TINY_SQUARE));
    let sine = radius * inverse;
    let sine2 = fmin(sine * sine, 1.0);
    return Cone(to * inverse, sine2 / (1.0 + sqrt(1.0 - sine2)), sine >= sqrt(WIDE));
}

// The density of light paths through a point of their light, over the cosine at the light: per area, solid angle and cosine. `photons`
// is that of the pair, per area, times the number of light paths that go with one sample of every pixel.
fn start_density(cone: Cone, cos: f32, photons: f32) -> f32 {
    let in_cone = 1.0 / fmax(2.0 * PI * cone.height * cos, TINY);
    return photons * select(in_cone, INV_PI, cone.wide);
}

// The area of a pixel's part of a surface that the eye sees, over the cosine there and times it: the inverse of the density with which
// camera rays of one pixel meet the surface, but for the cosine. `r` is the distance from the eye, `along` that part of it that lies
// along the view direction.
fn pixel_spread(r: f32, along: f32) -> f32 {
    // The quotient first: no cube leaves f32.
    let cos = along / fmax(r, TINY);
    return PIXEL_AREA * (cos * along) * along;
}
