// What every material takes and returns: where a path meets a surface, how it continues, and how much light a direction carries.

// What is known where a path meets a surface.
struct Interaction {
    // Point on the surface.
    p: vec3f,
    // Unit normal on the side of the ray.
    n: vec3f,
#if SMOOTH
    // That of the surface itself. n is the one that light is scattered about: smooth, so it may turn away from the ray, but not at mirrors
    // and glass.
    geometric: vec3f,
#endif
    // Unit direction that the ray came from.
    wo: vec3f,
    // n . wo, at least 0.
    cos_o: f32,
    // The ray came from the normal's own side: from outside a solid.
    outside: bool,
    face: u32,
    // Number of the surface.
    number: u32,
    material: Material,
    // The medium of the ray; the dielectric solid that the surface bounds, and the one around it.
    medium: u32,
    solid: u32,
    parent: u32,
    // What glass does with the path: CROSSES, IS_REFLECTED, or BY_CHANCE.
    way: u32,
}

// How a path continues from a surface.
struct Scattered {
    // Unit direction.
    wi: vec3f,
    // f cos / pdf, or what stands for it where f is a delta function.
    weight: vec3f,
    // Density per solid angle; 0 where light sampling alone looks for lights, and for delta functions.
    pdf: f32,
    // f is a delta function.
    specular: bool,
    // The medium that it continues in.
    medium: u32,
}

// f cos per steradian, and the density per solid angle with which the material samples that direction (0 as in Scattered).
struct BsdfValue {
    f_cos: vec3f,
    pdf: f32,
}

// What glass does with a path.
const CROSSES: u32 = 0u;
const IS_REFLECTED: u32 = 1u;
const BY_CHANCE: u32 = 2u;

// b if it is taken, else a.
fn select_sampled(a: Scattered, b: Scattered, take: bool) -> Scattered {
    return Scattered(
        select(a.wi, b.wi, take),
        select(a.weight, b.weight, take),
        select(a.pdf, b.pdf, take),
        select(a.specular, b.specular, take),
        select(a.medium, b.medium, take)
    );
}

fn select_evaluated(a: BsdfValue, b: BsdfValue, take: bool) -> BsdfValue {
    return BsdfValue(select(a.f_cos, b.f_cos, take), select(a.pdf, b.pdf, take));
}
