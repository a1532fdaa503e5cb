// No light paths: nothing in the scene is specular, or they are switched off.

struct LightTrail {
    unused: u32,
}

fn begin_trail(path: ptr<function, Path>, ended: bool) {}

fn follow_trail(path: ptr<function, Path>, x: ptr<function, Interaction>, t: f32, scattered: Scattered) {}

fn is_hidden(path: ptr<function, Path>) -> bool {
    return false;
}

fn share_of_chance(path: ptr<function, Path>, hit: Hit, light: DiskLight, index: u32) -> f32 {
    return 1.0;
}
