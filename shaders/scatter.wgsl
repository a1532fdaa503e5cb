// What happens to a path where it meets something.

// Whether light scattered this often on its way to the eye is kept.
fn kept(scatterings: u32) -> bool {
#if ALL_LIGHT
    return true;
#else
    return (KEEP_EMITTED && scatterings == 0u) || (KEEP_DIRECT && scatterings == 1u) || (KEEP_INDIRECT && scatterings >= 2u);
#endif
}

#if MIS
// Power heuristic [Veach1995]: the share of a sample whose density is 1 / inverse, where density b would find it too.
fn power_heuristic(inverse: f32, b: f32) -> f32 {
    // The ratio first: squares of large densities overflow.
    let r = b * inverse;
    return 1.0 / (1.0 + r * r);
}

#if GLOSSY
// How dense light sampling counts as: with sample_suited up to twice as dense as without, where it matters. Squared errors had
// efficiencies of 1.13 (1000 spheres), 1.08 (phong_gallery) and 1.05 so; 1.5 and 3 were no better.
const DENSER: f32 = 2.0;
#else
const DENSER: f32 = 1.0;
#endif
#endif

// What a light met by chance adds, before the path's weight.
fn emission(path: Path, hit: Hit) -> vec3f {
    let light = light_at(hit.key >> 2u);
    let front = dot(path.ray.d, light.normal) < 0.0;
    var share = select(0.0, 1.0, front && kept(path.depth - 1u));
#if LIGHT_SAMPLING
#if MIS
    if !path.specular && path.pdf > 0.0 {
        let cap = cap_of(light, path.ray.o);
        var pdf = cap_pdf(light, cap, path.ray.d);
#if LIGHT_TREE
        pdf *= light_probability(hit.key >> 2u, path.ray.o, path.receiver);
#else
#if SEVERAL_LIGHTS
        pdf *= light_weight(light, path.ray.o, path.receiver) / fmax(path.weights, TINY);
#endif
#endif
        share *= power_heuristic(1.0 / fmax(path.pdf, TINY), SHADOW_RAYS * DENSER * pdf);
    } else {
        share *= select(0.0, 1.0, path.specular);
    }
#else
    share *= select(0.0, 1.0, path.specular);
#endif
#endif
#if LIGHT_SCALES
    share *= light_scale(path.ray.medium);
#endif
#if IMAGES
    share = select(0.0, share, counts_light(path.memory, hit.key >> 2u));
#endif
    return light.radiance * share;
}

// Share of what the pixel shows below which a path may be ended. By squared error, 0.85 and 1 had 0.88 to 1.08 and 0.80 to 1.12
// of this one's efficiency, and ending what is below 1 from the fifth vertex on, whatever is shown, 0.72 to 1.01.
const LITTLE: f32 = 0.7;

#if GLANCES_GO_ON
// What a path does where it meets glass.
const CROSSES: u32 = 0u;
const IS_REFLECTED: u32 = 1u;
const BY_CHANCE: u32 = 2u;
#endif

// Scatters a path that `meets` a surface: direct light, then a new direction. False when it ends there, or met none.
//
// Nearly without branches. A software adapter goes through every branch for all its lanes, and what a branch sets in a loop is
// alive all the way round it: selections made three_materials 1.08 to 1.1 times as fast, and compiled in 0.8 of the time.
// Where values are not baked in, the adapter may be one whose compiler takes minutes over so long a block: SwiftShader's.
fn scatter_at(path: ptr<function, Path>, meets: bool, hit: Hit, draw_key: vec4u, count: ptr<function, vec4u>) -> bool {
    let surface = surface_at(hit.key);
    let material = material_at(surface.material);
    let d = (*path).ray.d;
    let v = vertex_at((*path).ray, hit, surface);
    let face = face_at(hit.key, surface);
    // Two-sided: the normal on the side that the ray comes from.
    var outside = dot(v.n, d) < 0.0;
#if DIFFUSE
    let diffuse = material.kind == MATERIAL_DIFFUSE;
#endif
#if MIRROR
    let mirror = material.kind == MATERIAL_MIRROR;
#endif
#if DIELECTRIC
    let glass = material.kind == MATERIAL_DIELECTRIC;
    // Known, where a grazing cosine may round to either sign.
    outside = select(outside, (*path).ray.medium != surface.solid, glass);
#endif
#if PHONG
    let phong = material.kind == MATERIAL_PHONG;
#endif
    let n = select(-v.n, v.n, outside);
    let cos_i = abs(dot(v.n, d));

    var ends = !meets;
#if WHITTED
    ends = ends || (*path).ending;
#endif
#if GLANCES_GO_ON
    let glance = (*path).glances > 0u;
    ends = ends || (glance && material.kind != MATERIAL_MIRROR && material.kind != MATERIAL_DIELECTRIC);
#endif
#if IMAGES
    ends = ends || ((*path).memory >= SENT && !mirror);
#endif
    // The vertex on the light counts too, so nothing can be gathered beyond the last one.
    let last = (*path).depth >= LAST_DEPTH;
#if COUNT_TRUNCATED
    (*count).y += select(0u, 1u, last && !ends);
#endif
    ends = ends || last;

    var u = draw(draw_key);
    let round = draw_key.y / ROUND_SAMPLES;
    let i = round / REPLICATES * ROUND_SAMPLES + draw_key.y % ROUND_SAMPLES;
    let spread = draw_spread(u, draw_key.x, round % REPLICATES, i, draw_key.w);
    u.points = select(u.points, spread.points, (*path).clear);
#if PHONG
    // Of several specular vertices in a row each decides on its own.
    u.choices.y = select(u.choices.y, spread.choices.y, (*path).clear && phong);
#endif
    u.choices.x = select(u.choices.x, spread.choices.x, (*path).clear);

#if LIGHT_WEIGHTS
#if GLOSSY
    let shares = vec2f(dot(material.color, LIGHT_COLORS), dot(material.specular, LIGHT_COLORS));
    let receiver = Receiver(
        n,
        mirrored(d, n),
        select(1.0, shares.x, phong),
        select(0.0, shares.y * (0.5 * material.exponent + 1.0), phong),
        select(0.0, 0.125 * material.exponent, phong)
    );
#else
    let receiver = Receiver(n);
#endif
#endif
#if LIGHT_SAMPLING
    // Direct light, where the surface scatters into more than one direction.
    let scatters = material.kind == MATERIAL_DIFFUSE || material.kind == MATERIAL_PHONG;
    var weights = 0.0;
    var gathered = vec3f(0.0);
#if BRANCHES
    if scatters && !ends {
#endif
#if SEVERAL_SHADOW_RAYS
    for (var k = 0u; k < u32(SHADOW_RAYS); k++) {
        let more = draw(draw_key + vec4u(0u, 0u, k << 20u, 0u));
        let points = select(more.points.xy, u.points.xy, k == 0u);
        let choices = select(more.choices, u.choices, k == 0u);
        let choice = (choices.x + f32(k)) * (1.0 / SHADOW_RAYS);
#else
        let points = u.points.xy;
        let choices = u.choices;
        let choice = choices.x;
#endif
#if LIGHT_TREE
        let chosen = choose_light(v.p, receiver, vec2f(choice, choices.w));
#else
#if LIGHT_WEIGHTS
        let chosen = choose_light(v.p, receiver, choice);
#else
        let chosen = choose_light(v.p, choice);
#endif
#endif
        weights = chosen.weights;
#if GLOSSY
        // The lobe's number is free here: what it decides below adds to this, and does not multiply it.
        let suited = sample_suited(chosen.light, chosen.cap, receiver, points, choices.y);
        let to = suited.to;
#else
        let to = sample_cap(chosen.light, chosen.cap, points);
#endif
        let cos = dot(n, to.d);
        // 1 / density of this sample among all.
        let inverse_pdf = to.inverse_pdf * chosen.inverse_probability * (1.0 / SHADOW_RAYS);
        var f_cos = material.color * (0.31830989 * cos);
#if MIS_DIFFUSE
        f_cos *= select(1.0, power_heuristic(inverse_pdf * (1.0 / DENSER), cos * 0.31830989), diffuse);
#endif
#if PHONG
        let power = phong_power(to.d, mirrored(d, n), material.exponent);
        let value = phong_value(material.color, material.specular, material.exponent, cos, power);
#if MIS
        let lobes = value.f_cos * power_heuristic(inverse_pdf * (1.0 / DENSER), value.pdf);
#else
        let lobes = value.f_cos;
#endif
        f_cos = select(f_cos, lobes, phong);
#endif
        let asks = scatters && !ends && cos > 0.0 && inverse_pdf > 0.0 && kept((*path).depth);
        (*count).x += select(0u, 1u, asks);
        let shadow = Ray(v.p, to.d, face, (*path).ray.medium, chosen.light.face);
        // A branch here: walks through trees are long.
        let lit = asks && !occluded(shadow, to.distance, chosen.index);
#if GLOSSY
        gathered += select(vec3f(0.0), f_cos * chosen.light.radiance * (inverse_pdf * suited.worth), lit);
#else
        gathered += select(vec3f(0.0), f_cos * chosen.light.radiance * inverse_pdf, lit);
#endif
#if SEVERAL_SHADOW_RAYS
    }
#endif
#if BRANCHES
    }
#endif
#if LIGHT_SCALES
    gathered *= light_scale((*path).ray.medium);
#endif
    // Not even zero where nothing is asked: the path's weight may have left f32.
    (*path).radiance += select(vec3f(0.0), (*path).beta * gathered, scatters && !ends);
#if WHITTED
    (*path).ending = (*path).ending || scatters;
#endif
#endif

    // A new direction.
    var next = d;
    var weight = vec3f(0.0);
    var medium = (*path).ray.medium;
    var specular = false;
#if MIS
    var pdf = 0.0;
#endif
#if IMAGES
    var memory = FREE;
#endif
#if DIFFUSE
#if BRANCHES
    if diffuse {
#endif
    let around = sample_cosine(n, u.points.zw);
    next = select(next, around, diffuse);
    weight = select(weight, material.color, diffuse);
#if MIS_DIFFUSE
    pdf = select(pdf, fmax(dot(n, around), 0.0) * 0.31830989, diffuse);
#endif
#if IMAGES
    let image = choose_image(v.p, n, weights, u.choices.y);
    let chooses = diffuse && (*path).depth + 1u < LAST_DEPTH;
    let taken = chooses && image.taken;
    next = select(next, vec3f(u.points.zw, f32(image.index)), taken);
    weight *= select(1.0, image.inverse_probability, chooses) * select(1.0, 0.31830989, taken);
    memory = select(memory, select(FROM_DIFFUSE, image_memory(image.index), taken), diffuse);
    specular = taken;
    (*path).sends = taken;
    (*path).normal = n;
#endif
#if BRANCHES
    }
#endif
#endif
#if PHONG
#if BRANCHES
    if phong {
#endif
    let r = mirrored(d, n);
    let glossy = sample_phong(material.color, material.specular, material.exponent, n, r, u.choices.y, u.points.zw);
    next = select(next, glossy.d, phong);
    weight = select(weight, glossy.weight, phong);
#if MIS
    pdf = select(pdf, glossy.pdf, phong);
#endif
#if BRANCHES
    }
#endif
#endif
#if MIRROR
#if BRANCHES
    if mirror {
#endif
    next = select(next, mirrored(d, n), mirror);
    weight = select(weight, material.color, mirror);
    specular = specular || mirror;
#if IMAGES
    memory = select(memory, after_mirror((*path).memory, hit.key >> 2u, cos_i), mirror);
    ends = ends || (mirror && memory == ASTRAY);
#endif
#if BRANCHES
    }
#endif
#endif
#if DIELECTRIC
#if BRANCHES
    if glass {
#endif
    let eta = select(1.0 / material.exponent, material.exponent, outside);
    let fresnel = refraction(cos_i, eta);
    var crosses = u.choices.y < fresnel.transmitted;
    var share = 1.0;
#if GLANCES_GO_ON
    // What glass reflects is a twentieth of what comes: left to chance it would be noise. Half of the glances see it, and
    // weigh less.
    let by_chance = (*path).way == BY_CHANCE;
    crosses = select((*path).way == CROSSES, crosses, by_chance);
    share = select(2.0 * select(1.0 - fresnel.transmitted, fresnel.transmitted, crosses), 1.0, by_chance);
#endif
    next = select(next, select(mirrored(d, n), refracted(d, n, cos_i, fresnel.cos_t, eta), crosses), glass);
    weight = select(weight, select(vec3f(1.0), material.color, crosses) * share, glass);
    medium = select(medium, select(surface.parent, surface.solid, outside), glass && crosses);
    specular = specular || glass;
#if BRANCHES
    }
#endif
#endif

    let beta = (*path).beta * weight;
    (*path).ray = Ray(v.p, next, face, medium, NO_FACE);
    (*path).specular = specular;
#if MIS
    (*path).pdf = pdf;
#if SEVERAL_LIGHTS
    (*path).receiver = receiver;
    (*path).weights = weights;
#endif
#endif
    // Whether all so far was specular; of what is sent to an image its first vertex was not.
    var clear = (*path).clear && specular;
#if IMAGES
    (*path).memory = memory;
    clear = clear && memory < SENT;
#endif
    // Russian roulette: paths that carry little beside what the pixel shows, which is in proportion to their weight where they
    // first scatter in more than one direction. A dark thing in a bright room is no noisier so than a bright one.
    let brightest = fmax(fmax(beta.x, beta.y), beta.z);
    (*path).shown = select((*path).shown, brightest, (*path).clear && !clear);
    (*path).clear = clear;
    var survival = fmin(1.0, brightest / fmax(LITTLE * (*path).shown, TINY));
#if GLANCES_GO_ON
    // Few and short: what they show is to be free of noise.
    survival = select(survival, 1.0, glance);
#endif
#if IMAGES
    survival = select(survival, 1.0, memory >= SENT);
#endif
    (*path).beta = beta * (1.0 / fmax(survival, TINY));
    (*path).depth += 1u;
    return !ends && brightest > 0.0 && u.choices.z < survival;
}

#if IMAGES
// Gives a path that is sent to an image its direction.
fn send(path: ptr<function, Path>) {
    let choice = (*path).ray.d;
    let index = u32(choice.z);
    let image = sample_image((*path).ray.o, image_ball(index), image_light(index), choice.xy);
    let weight = fmax(dot((*path).normal, image.d), 0.0) * image.inverse_pdf;
    (*path).beta *= weight;
    (*path).ray.d = select((*path).normal, image.d, weight > 0.0);
    (*path).sends = false;
}
#endif
