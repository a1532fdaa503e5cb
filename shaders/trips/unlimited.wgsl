// Kernels without trees do not count loop trips: the host knows how many a path can take, and cuts the work accordingly.

fn begin_trips() {}

fn trips_remain() -> bool {
    return true;
}

// Whether the path still lives after this vertex.
fn spend_trips(lives: bool) -> bool {
    return lives;
}
