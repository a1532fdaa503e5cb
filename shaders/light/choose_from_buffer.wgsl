// Chooses one of the lights in the buffer, with a probability in proportion to its weight. One pass is enough (weighted reservoir
// sampling): each light replaces the choice so far with a probability of its share of the sum so far, and the random number is
// rescaled to [0, 1) for the next light.

fn choose_light(p: vec3f, to: Receiver, u: vec2f) -> Chosen {
    var index = 0u;
    var chosen = 0.0;
    var sum = 0.0;
    var v = u.x;
    for (var i = 0u; i < LIGHT_COUNT; i++) {
        let w = light_weight(light_at(i), p, to);
        sum += w;
        let share = w / select(sum, 1.0, sum <= 0.0);
        let take = v < share;
        v = select((v - share) / fmax(1.0 - share, TINY), v / fmax(share, TINY), take);
        index = select(index, i, take);
        chosen = select(chosen, w, take);
    }
    let light = light_at(index);
    return Chosen(light, index, cap_of(light, p), select(sum / fmax(chosen, TINY), 0.0, chosen <= 0.0), sum);
}
