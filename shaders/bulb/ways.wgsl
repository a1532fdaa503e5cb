// The ways of a ray out of a bulb: straight through the shells, or once reflected at the inner or the outer one. A ray that the outer shell
// reflects crosses what is in the inner one again, and so does one that the inner shell reflects.
const BULB_STRAIGHT: u32 = 0u;
const BULB_INNER: u32 = 1u;
const BULB_OUTER: u32 = 2u;

// How many vertices there are on a way between the light and what is outside.
fn vertices_on(way: u32, shells: u32) -> u32 {
    // The outer shell of two is met from inside, then the inner one twice.
    return shells + select(select(0u, 1u, way == BULB_INNER), select(1u, 3u, shells == 2u), way == BULB_OUTER);
}
