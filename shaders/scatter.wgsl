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

// Scatters the path where it met a surface: direct light, then a new direction. False when it ends.
fn scatter_at(path: ptr<function, Path>, hit: Hit, draw_key: vec4u, count: ptr<function, vec4u>) -> bool {
    let surface = surface_at(hit.key);
    let material = material_at(surface.material);
    let d = (*path).ray.d;
    let v = vertex_at((*path).ray, hit, surface);
    let face = face_at(hit.key, surface);
    // Two-sided: the normal on the side that the ray comes from.
    var outside = dot(v.n, d) < 0.0;
#if DIELECTRIC
    if material.kind == MATERIAL_DIELECTRIC {
        // Known, where a grazing cosine may round to either sign.
        outside = (*path).ray.medium != surface.solid;
    }
#endif
    let n = select(-v.n, v.n, outside);
    let cos_i = abs(dot(v.n, d));

#if WHITTED
    if (*path).ending {
        return false;
    }
#endif
#if GLANCES_GO_ON
    let glance = (*path).glances > 0u;
    if glance && material.kind != MATERIAL_MIRROR && material.kind != MATERIAL_DIELECTRIC {
        return false;
    }
#endif
#if IMAGES
    if (*path).memory >= SENT && material.kind != MATERIAL_MIRROR {
        return false;
    }
#endif
    // The vertex on the light counts too, so nothing can be gathered beyond the last one.
    if (*path).depth >= LAST_DEPTH {
#if COUNT_TRUNCATED
        (*count).y += 1u;
#endif
        return false;
    }
    var u = draw(draw_key);
    if (*path).clear {
        let round = draw_key.y / ROUND_SAMPLES;
        let i = round / REPLICATES * ROUND_SAMPLES + draw_key.y % ROUND_SAMPLES;
#if PHONG
        let reflects = u.choices.y;
#endif
        u = draw_spread(u, draw_key.x, round % REPLICATES, i, draw_key.w);
#if PHONG
        // Of several specular vertices in a row each decides on its own.
        u.choices.y = select(reflects, u.choices.y, material.kind == MATERIAL_PHONG);
#endif
    }

#if LIGHT_WEIGHTS
#if GLOSSY
    var receiver = Receiver(n, mirrored(d, n), 1.0, 0.0, 0.0);
    if material.kind == MATERIAL_PHONG {
        let shares = vec2f(dot(material.color, LIGHT_COLORS), dot(material.specular, LIGHT_COLORS));
        receiver.diffuse = shares.x;
        receiver.specular = shares.y * (0.5 * material.exponent + 1.0);
        receiver.narrow = 0.125 * material.exponent;
    }
#else
    let receiver = Receiver(n);
#endif
#endif
#if LIGHT_SAMPLING
    // Direct light, where the surface scatters into more than one direction.
    var weights = 0.0;
    if material.kind == MATERIAL_DIFFUSE || material.kind == MATERIAL_PHONG {
        var gathered = vec3f(0.0);
#if SEVERAL_SHADOW_RAYS
        for (var k = 0u; k < u32(SHADOW_RAYS); k++) {
            var points = u.points.xy;
            var choice = u.choices.x;
#if GLOSSY
            var among = u.choices.y;
#endif
#if LIGHT_TREE
            var spare = u.choices.w;
#endif
            if k > 0u {
                let more = draw(draw_key + vec4u(0u, 0u, k << 20u, 0u));
                points = more.points.xy;
                choice = more.choices.x;
#if GLOSSY
                among = more.choices.y;
#endif
#if LIGHT_TREE
                spare = more.choices.w;
#endif
            }
            choice = (choice + f32(k)) * (1.0 / SHADOW_RAYS);
#else
            let points = u.points.xy;
            let choice = u.choices.x;
#if GLOSSY
            let among = u.choices.y;
#endif
#if LIGHT_TREE
            let spare = u.choices.w;
#endif
#endif
#if LIGHT_TREE
            let chosen = choose_light(v.p, receiver, vec2f(choice, spare));
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
            let suited = sample_suited(chosen.light, chosen.cap, receiver, points, among);
            let to = suited.to;
#else
            let to = sample_cap(chosen.light, chosen.cap, points);
#endif
            let cos = dot(n, to.d);
            // 1 / density of this sample among all.
            let inverse_pdf = to.inverse_pdf * chosen.inverse_probability * (1.0 / SHADOW_RAYS);
            if cos > 0.0 && inverse_pdf > 0.0 && kept((*path).depth) {
                var f_cos = material.color * (0.31830989 * cos);
#if MIS_DIFFUSE
                if material.kind == MATERIAL_DIFFUSE {
                    f_cos *= power_heuristic(inverse_pdf * (1.0 / DENSER), cos * 0.31830989);
                }
#endif
#if PHONG
                if material.kind == MATERIAL_PHONG {
                    let power = phong_power(to.d, mirrored(d, n), material.exponent);
                    let value = phong_value(material.color, material.specular, material.exponent, cos, power);
                    f_cos = value.f_cos;
#if MIS
                    f_cos *= power_heuristic(inverse_pdf * (1.0 / DENSER), value.pdf);
#endif
                }
#endif
                (*count).x += 1u;
                let shadow = Ray(v.p, to.d, face, (*path).ray.medium, chosen.light.face);
                if !occluded(shadow, to.distance, chosen.index) {
#if GLOSSY
                    gathered += f_cos * chosen.light.radiance * (inverse_pdf * suited.worth);
#else
                    gathered += f_cos * chosen.light.radiance * inverse_pdf;
#endif
                }
            }
#if SEVERAL_SHADOW_RAYS
        }
#endif
#if LIGHT_SCALES
        gathered *= light_scale((*path).ray.medium);
#endif
        (*path).radiance += (*path).beta * gathered;
#if WHITTED
        (*path).ending = true;
#endif
    }
#endif

    // A new direction.
    var next = d;
    var weight = vec3f(0.0);
    var medium = (*path).ray.medium;
    (*path).specular = false;
#if IMAGES
    let memory = (*path).memory;
    (*path).memory = FREE;
#endif
#if MIS
    (*path).pdf = 0.0;
#endif
#if DIFFUSE
    if material.kind == MATERIAL_DIFFUSE {
        next = sample_cosine(n, u.points.zw);
        weight = material.color;
#if MIS_DIFFUSE
        (*path).pdf = fmax(dot(n, next), 0.0) * 0.31830989;
#endif
#if IMAGES
        (*path).memory = FROM_DIFFUSE;
        if (*path).depth + 1u < LAST_DEPTH {
            let chosen = choose_image(v.p, n, weights, u.choices.y);
            weight *= chosen.inverse_probability;
            if chosen.taken {
                next = vec3f(u.points.zw, f32(chosen.index));
                weight *= 0.31830989;
                (*path).memory = image_memory(chosen.index);
                (*path).specular = true;
                (*path).sends = true;
                (*path).normal = n;
            }
        }
#endif
    }
#endif
#if PHONG
    if material.kind == MATERIAL_PHONG {
        let r = mirrored(d, n);
        let choice = lobe_probability(material.color, material.specular);
        var power: f32;
        if u.choices.y < choice {
            let lobe = sample_lobe(r, material.exponent, u.points.zw);
            next = lobe.d;
            power = lobe.power;
        } else {
            next = sample_cosine(n, u.points.zw);
            power = phong_power(next, r, material.exponent);
        }
        let cos = dot(n, next);
        let value = phong_value(material.color, material.specular, material.exponent, cos, power);
        // Below the horizon the sample counts as zero and is not drawn again. Where there is no diffuse part the
        // powers cancel, and nothing is left to divide.
        var quotient = value.f_cos * (1.0 / fmax(value.pdf, TINY));
        if choice >= 1.0 {
            quotient = material.specular * ((material.exponent + 2.0) / (material.exponent + 1.0) * cos);
        }
        weight = select(vec3f(0.0), quotient, cos > 0.0);
#if MIS
        (*path).pdf = value.pdf;
#endif
    }
#endif
#if MIRROR
    if material.kind == MATERIAL_MIRROR {
        next = mirrored(d, n);
        weight = material.color;
        (*path).specular = true;
#if IMAGES
        (*path).memory = after_mirror(memory, hit.key >> 2u, cos_i);
        if (*path).memory == ASTRAY {
            return false;
        }
#endif
    }
#endif
#if DIELECTRIC
    if material.kind == MATERIAL_DIELECTRIC {
        let eta = select(1.0 / material.exponent, material.exponent, outside);
        let fresnel = refraction(cos_i, eta);
        var crosses = u.choices.y < fresnel.transmitted;
#if GLANCES_GO_ON
        // What glass reflects is a twentieth of what comes: left to chance it would be noise. Half of the glances see it, and
        // weigh less.
        crosses = select((*path).way == CROSSES, crosses, (*path).way == BY_CHANCE);
        let share = 2.0 * select(1.0 - fresnel.transmitted, fresnel.transmitted, crosses);
#endif
        if crosses {
            next = refracted(d, n, cos_i, fresnel.cos_t, eta);
            weight = material.color;
            medium = select(surface.parent, surface.solid, outside);
        } else {
            next = mirrored(d, n);
            weight = vec3f(1.0);
        }
#if GLANCES_GO_ON
        weight *= select(share, 1.0, (*path).way == BY_CHANCE);
#endif
        (*path).specular = true;
    }
#endif

    let beta = (*path).beta * weight;
    (*path).ray = Ray(v.p, next, face, medium, NO_FACE);
#if MIS
#if SEVERAL_LIGHTS
    (*path).receiver = receiver;
    (*path).weights = weights;
#endif
#endif
    let clear = (*path).clear;
    (*path).clear = clear && (*path).specular;
#if IMAGES
    (*path).clear = (*path).clear && (*path).memory < SENT;
#endif
    // Russian roulette: paths that carry little beside what the pixel shows, which is in proportion to their weight where they
    // first scatter in more than one direction. A dark thing in a bright room is no noisier so than a bright one.
    let brightest = fmax(fmax(beta.x, beta.y), beta.z);
    if clear && !(*path).clear {
        (*path).shown = brightest;
    }
    var survival = fmin(1.0, brightest / fmax(LITTLE * (*path).shown, TINY));
#if GLANCES_GO_ON
    // Few and short: what they show is to be free of noise.
    survival = select(survival, 1.0, glance);
#endif
#if IMAGES
    if (*path).memory >= SENT {
        survival = 1.0;
    }
#endif
    (*path).beta = beta * (1.0 / fmax(survival, TINY));
    (*path).depth += 1u;
    return brightest > 0.0 && u.choices.z < survival;
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
