// Choosing one of many lights: down a balanced tree of clusters [Conty2018], each time in proportion to what the two
// halves could send, then among the few lights of a cluster by what each would send.

// A cluster: a ball that holds its lights, and a cone that holds their normals.
struct LightCluster {
    center: vec3f,
    radius: f32,
    // Unit axis of the cone times the power, up to a factor; zero: nothing shines.
    power: vec3f,
    // Cosine of its half angle.
    cos_cone: f32,
}

// Cluster k has the halves 2k and 2k + 1; the first is 1. The last LIGHT_CLUSTERS have LIGHTS_A_CLUSTER lights each.
@group(0) @binding(4) var<storage, read> light_clusters: array<LightCluster>;
// The lights in the order of the clusters, NONE where there is none; then of each light its place in that order.
@group(0) @binding(5) var<storage, read> light_places: array<u32>;

// Cosine of max(a - b, 0), for angles from 0 to pi by their cosines.
fn cos_of_difference(a: f32, b: f32) -> f32 {
    return select(a * b + safe_sqrt(1.0 - a * a) * safe_sqrt(1.0 - b * b), 1.0, a >= b);
}

// About what the cluster sends to a receiver with normal n at p; 0 only when none of it can.
fn cluster_importance(c: LightCluster, p: vec3f, n: vec3f) -> f32 {
    let power = length(c.power);
    let v = p - c.center;
    let distance = length(v);
    let far = distance > c.radius;
    let w = v / max(distance, TINY);
    let sine = min(c.radius / max(distance, TINY), 1.0);
    let cos_ball = safe_sqrt(1.0 - sine * sine);
    // The smallest angle that any of it can have to a normal there, and to the receiver's.
    let light = cos_of_difference(cos_of_difference(dot(c.power, w) / max(power, TINY), c.cos_cone), cos_ball);
    let receiver = cos_of_difference(-dot(n, w), cos_ball);
    // Cosines have errors, the more in the small ones.
    let dark = power == 0.0 || (far && (light < -0.002 || receiver < -0.002));
    let cosines = select(1.0, max(light, 0.01) * max(receiver, 0.01), far);
    let nearest = max(distance, c.radius);
    return select(max(power * cosines / max(nearest * nearest, TINY), TINY), 0.0, dark);
}

// The probability of the first half of a cluster.
fn first_half(k: u32, p: vec3f, n: vec3f) -> f32 {
    let a = min(cluster_importance(light_clusters[2u * k], p, n), 1.0e30);
    let b = min(cluster_importance(light_clusters[2u * k + 1u], p, n), 1.0e30);
    let share = a / max(a + b, TINY);
    // The importance is a guess: neither half that may shine is left to less than one choice in five hundred.
    return select(share, clamp(share, 0.002, 0.998), a > 0.0 && b > 0.0);
}

fn weight_at(place: u32, p: vec3f, n: vec3f) -> f32 {
    let index = light_places[place];
    let light = lights[select(0u, index, index != NONE)];
    return select(light_weight(light, p, n), 0.0, index == NONE);
}

// Two random numbers: so many levels would use up the digits of one.
fn choose_light(p: vec3f, n: vec3f, u: vec2f) -> Chosen {
    var k = 1u;
    var v = u.x;
    var probability = 1.0;
    for (var level = 0u; level < LIGHT_LEVELS; level++) {
        if level == LIGHT_LEVELS / 2u {
            v = u.y;
        }
        let share = first_half(k, p, n);
        let first = v < share;
        let taken = select(1.0 - share, share, first);
        v = select(v - share, v, first) / max(taken, TINY);
        probability *= taken;
        k = 2u * k + select(1u, 0u, first);
    }
    // One pass: each light replaces the choice with its share of the sum so far.
    let begin = (k - LIGHT_CLUSTERS) * LIGHTS_A_CLUSTER;
    var place = begin;
    var chosen = 0.0;
    var sum = 0.0;
    for (var i = 0u; i < LIGHTS_A_CLUSTER; i++) {
        let w = weight_at(begin + i, p, n);
        sum += w;
        let share = w / select(sum, 1.0, sum <= 0.0);
        let take = v < share;
        v = select((v - share) / max(1.0 - share, TINY), v / max(share, TINY), take);
        place = select(place, begin + i, take);
        chosen = select(chosen, w, take);
    }
    let found = light_places[place];
    let index = select(0u, found, found != NONE);
    let light = lights[index];
    probability *= chosen;
    return Chosen(light, index, cap_of(light, p), select(sum / max(probability, TINY), 0.0, probability <= 0.0), 1.0);
}

// The probability with which choose_light takes a light.
fn light_probability(index: u32, p: vec3f, n: vec3f) -> f32 {
    let place = light_places[LIGHT_CLUSTERS * LIGHTS_A_CLUSTER + index];
    let cluster = LIGHT_CLUSTERS + place / LIGHTS_A_CLUSTER;
    var probability = 1.0;
    for (var level = LIGHT_LEVELS; level > 0u; level--) {
        let share = first_half(cluster >> level, p, n);
        let second = (cluster >> (level - 1u)) & 1u;
        probability *= select(share, 1.0 - share, second == 1u);
    }
    let begin = place / LIGHTS_A_CLUSTER * LIGHTS_A_CLUSTER;
    var sum = 0.0;
    for (var i = 0u; i < LIGHTS_A_CLUSTER; i++) {
        sum += weight_at(begin + i, p, n);
    }
    return probability * weight_at(place, p, n) / max(sum, TINY);
}
