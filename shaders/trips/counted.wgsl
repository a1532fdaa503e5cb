// Loop trips of kernels with trees, for Mesa before 23: its llvmpipe lets an invocation's loops go round 65 535 times in all and then
// ends every loop in silence. What a walk through a tree takes is not known beforehand, so the kernel counts, and leaves the path
// that runs out of trips to the next dispatch. src/gpu/trips.rs is the host's part. Delete both, and use unlimited.wgsl, when Mesa
// 22 is gone.

// None are left: the path under way is worth nothing.
var<private> out_of_trips: bool = false;

fn begin_trips() {
    trips_left = params.trips - min(params.trips, TRIPS_AT_START + TRIPS_AT_VERTEX);
}

fn trips_remain() -> bool {
    return !out_of_trips;
}

// Takes off what a vertex may have used. Returns whether the path still lives after it: one that runs out of trips does, for it begins
// again.
fn spend_trips(lives: bool) -> bool {
    // The driver counts the trips of lanes side by side, of which each lane knows only its own. Once it has ended the loops this
    // one does not go round either.
    var turns = 0u;
    while turns < params.opaque_two {
        turns += 1u;
    }
    trips_left -= min(trips_left, select(TRIPS_AT_VERTEX, trips_left, turns < params.opaque_two));
    out_of_trips = out_of_trips || trips_left == 0u;
    return lives || out_of_trips;
}
