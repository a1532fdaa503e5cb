// Chooses one of many lights by a balanced tree of clusters [Conty2018]. Each level takes one of two halves, in proportion to what
// each could send. The last cluster holds few lights, and the choice among them is in proportion to their weights.

// A cluster: a ball that holds its lights, and a cone that holds their normals.
struct LightCluster {
    center: vec3f,
    radius: f32,
    // Unit axis of the cone times the power, up to a factor. Zero if no light of the cluster shines.
    power: vec3f,
    // Cosine of the cone's half angle.
    cos_cone: f32,
}

// The halves of cluster k are 2k and 2k + 1. Cluster 1 holds all lights. The last LIGHT_CLUSTERS clusters are leaves, with at most four
// lights each.
fn light_cluster(k: u32) -> LightCluster {
    let a = bitcast<vec4f>(record(CLUSTER_RECORDS + 2u * k));
    let b = bitcast<vec4f>(record(CLUSTER_RECORDS + 2u * k + 1u));
    return LightCluster(a.xyz, a.w, b.xyz, b.w);
}

// The lights of a leaf; NONE where it has fewer than four.
fn lights_of(cluster: u32) -> vec4u {
    return record(FOUR_RECORDS + cluster - LIGHT_CLUSTERS);
}

// An estimate of what the cluster sends to a receiver at p. It is 0 only if no light of the cluster can send anything.
fn cluster_importance(c: LightCluster, p: vec3f, at: Receiver) -> f32 {
    let power = length(c.power);
    let v = p - c.center;
    let distance = length(v);
    // `receiver` is the greatest height of any point of the ball above the receiver's plane. `light` is the greatest height that p can
    // have above the plane of any light: its normal is at best the cone's axis, turned towards p by the cone's half angle.
    let receiver = c.radius - dot(at.n, v);
    let along = dot(c.power, v) / max(power, TINY);
    let turned = c.cos_cone * along + safe_sqrt((1.0 - c.cos_cone * c.cos_cone) * max(distance * distance - along * along, 0.0));
    let light = c.radius + select(turned, distance, along >= c.cos_cone * distance);
    let far = distance > c.radius;
    let inverse = 1.0 / max(max(distance, c.radius), TINY);
    // Cosines have rounding errors, which are relatively larger in small ones.
    let cosines = vec2f(light, receiver) * inverse;
    let dark = power == 0.0 || (far && (cosines.x < -0.002 || cosines.y < -0.002));
    let both = clamp(cosines, vec2f(0.01), vec2f(1.0));
    var weight = power * select(1.0, both.x * both.y, far) * inverse * inverse;
    weight *= scattered(at, -v, inverse, c.radius);
    return select(max(weight, TINY), 0.0, dark);
}

// The probability of the first half of a cluster.
fn first_half(k: u32, p: vec3f, at: Receiver) -> f32 {
    let a = min(cluster_importance(light_cluster(2u * k), p, at), 1.0e30);
    let b = min(cluster_importance(light_cluster(2u * k + 1u), p, at), 1.0e30);
    let share = a / max(a + b, TINY);
    // The importance is only an estimate: if both halves may shine, each is chosen with a probability of at least 1 in 500.
    return select(share, clamp(share, 0.002, 0.998), a > 0.0 && b > 0.0);
}

fn weight_of(index: u32, p: vec3f, at: Receiver) -> f32 {
    let weight = light_weight(light_at(select(0u, index, index != NONE)), p, at);
    return select(weight, 0.0, index == NONE);
}

fn weights_of(four: vec4u, p: vec3f, at: Receiver) -> vec4f {
    return vec4f(
        weight_of(four.x, p, at),
        weight_of(four.y, p, at),
        weight_of(four.z, p, at),
        weight_of(four.w, p, at)
    );
}

// Takes two random numbers, because so many levels would use up the digits of one.
fn choose_light(p: vec3f, at: Receiver, u: vec2f) -> Chosen {
    var k = 1u;
    var v = u.x;
    var probability = 1.0;
    for (var level = 0u; level < LIGHT_LEVELS; level++) {
        if level == LIGHT_LEVELS / 2u {
            v = u.y;
        }
        let share = first_half(k, p, at);
        let first = v < share;
        let taken = select(1.0 - share, share, first);
        v = select(v - share, v, first) / max(taken, TINY);
        probability *= taken;
        k = 2u * k + select(1u, 0u, first);
    }
    let four = lights_of(k);
    let weights = weights_of(four, p, at);
    let two = weights.x + weights.y;
    let three = two + weights.z;
    let sum = three + weights.w;
    let chosen_at = v * sum;
    // The last light that has weight and whose share begins at or below chosen_at.
    var found = four.x;
    var chosen = weights.x;
    let second = weights.y > 0.0 && (chosen_at >= weights.x || chosen == 0.0);
    found = select(found, four.y, second);
    chosen = select(chosen, weights.y, second);
    let third = weights.z > 0.0 && (chosen_at >= two || chosen == 0.0);
    found = select(found, four.z, third);
    chosen = select(chosen, weights.z, third);
    let fourth = weights.w > 0.0 && (chosen_at >= three || chosen == 0.0);
    found = select(found, four.w, fourth);
    chosen = select(chosen, weights.w, fourth);
    let index = select(0u, found, found != NONE);
    let light = light_at(index);
    probability *= chosen;
    return Chosen(light, index, cap_of(light, p), select(sum / max(probability, TINY), 0.0, probability <= 0.0), 1.0);
}

// The probability with which choose_light takes a light.
fn light_probability(index: u32, light: DiskLight, p: vec3f, at: Receiver, weights: f32) -> f32 {
    let places = record(PLACE_RECORDS + index / 4u);
    let place = select(
        select(places.x, places.y, index % 4u == 1u),
        select(places.z, places.w, index % 4u == 3u),
        index % 4u >= 2u
    );
    let cluster = LIGHT_CLUSTERS + place / 4u;
    var probability = 1.0;
    for (var level = LIGHT_LEVELS; level > 0u; level--) {
        let share = first_half(cluster >> level, p, at);
        let second = (cluster >> (level - 1u)) & 1u;
        probability *= select(share, 1.0 - share, second == 1u);
    }
    let four = weights_of(lights_of(cluster), p, at);
    let sum = four.x + four.y + four.z + four.w;
    return probability * weight_of(index, p, at) / max(sum, TINY);
}
