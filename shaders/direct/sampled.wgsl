// Direct light by sampling the lights, and what is left to count when chance meets a light.

struct DirectLight {
    // What the surface scatters of it towards the eye, if the light lay in the medium of the scene's lights: see light_scale.
    radiance: vec3f,
    // Sum of the weights of all lights at the receiver.
    weights: f32,
}

// How dense light sampling counts as in the heuristic. With sample_light of glossy receivers it is up to twice as dense as its
// density says, where it matters: squared errors had efficiencies of 1.13 (1000 spheres), 1.08 (phong_gallery) and 1.05 with
// 2; 1.5 and 3 were no better.
const DENSER: f32 = select(1.0, 2.0, GLOSSY);

// Power heuristic [Veach1995]: the share of a sample whose density is 1 / inverse, where density b would find it too.
fn power_heuristic(inverse: f32, b: f32) -> f32 {
    // The ratio first: squares of large densities overflow.
    let r = b * inverse;
    return 1.0 / (1.0 + r * r);
}

// One light sample of SHADOW_RAYS; if `asks` is false it may be wrong, but costs no ray.
fn light_sample(asks: bool, x: ptr<function, Interaction>, to: Receiver, u: LightDraws, depth: u32, film: ptr<function, PixelFilm>) -> DirectLight {
    let chosen = choose_light(x.p, to, u.which);
    let wi = sample_light(chosen.light, chosen.cap, to, u.point, u.lobe);
    // 1 / density of this sample among all.
    let inverse_pdf = wi.inverse_pdf * chosen.inverse_probability * (1.0 / SHADOW_RAYS);
    let bsdf = evaluate_bsdf(x, wi.d);
    let f_cos = bsdf.f_cos * select(1.0, power_heuristic(inverse_pdf * (1.0 / DENSER), bsdf.pdf), MIS);
    let traced = asks && dot(x.n, wi.d) > 0.0 && inverse_pdf > 0.0 && keeps(depth);
    count_ray(film, traced);
    let shadow = Ray(x.p, wi.d, x.face, x.medium, chosen.light.face);
    // A branch here: walks through trees are long.
    let lit = traced && !occluded(shadow, wi.distance, chosen.index);
    let radiance = f_cos * chosen.light.radiance * (inverse_pdf * wi.worth);
    return DirectLight(select(vec3f(0.0), radiance, lit), chosen.weights);
}

// The weight of a light that the path meets by chance, where light sampling looked for it as well.
fn chance_weight(path: ptr<function, Path>, light: DiskLight, index: u32) -> f32 {
    var weight = select(0.0, 1.0, path.specular);
    if MIS && !path.specular && path.pdf > 0.0 {
        let receiver = path.ray.o;
        let pdf = cap_pdf(light, cap_of(light, receiver), path.ray.d)
            * light_probability(index, light, receiver, path.receiver, path.light_weights);
        weight = power_heuristic(1.0 / fmax(path.pdf, TINY), SHADOW_RAYS * DENSER * pdf);
    }
    return weight;
}
