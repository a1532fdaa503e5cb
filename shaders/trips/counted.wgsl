// Loop trips of kernels with trees, for Mesa before 23: its llvmpipe lets an invocation's loops go round 65 535 times in all and then
// ends every loop in silence. What a walk through a tree takes is not known beforehand, so the kernel counts, and leaves the sample
// that runs out of trips to the next dispatch. src/gpu/trips.rs is the host's part. Delete both, and use unlimited.wgsl, when Mesa
// 22 is gone.

// None are left: the sample under way is worth nothing.
var<private> out_of_trips: bool = false;
// Counts when the last sample ended: those of an unfinished sample do not count.
var<private> kept_counts: vec4u;

fn begin_trips(film: ptr<function, PixelFilm>) {
    trips_left = params.trips - min(params.trips, TRIPS_AT_START + TRIPS_AT_VERTEX);
    kept_counts = film.counts;
}

fn trips_remain() -> bool {
    return !out_of_trips;
}

// Takes off what a vertex may have used. Returns whether the path still lives after it: one that runs out of trips does, for its
// sample begins again.
fn spend_trips(film: ptr<function, PixelFilm>, lives: bool) -> bool {
    // The driver counts the trips of lanes side by side, of which each lane knows only its own. Once it has ended the loops this
    // one does not go round either.
    var turns = 0u;
    while turns < params.opaque_two {
        turns += 1u;
    }
    trips_left -= min(trips_left, select(TRIPS_AT_VERTEX, trips_left, turns < params.opaque_two));
    if trips_left == 0u {
        out_of_trips = true;
        film.counts = kept_counts;
    }
    return lives || out_of_trips;
}

fn keep_counts(film: ptr<function, PixelFilm>, ended: bool) {
    kept_counts = select(kept_counts, film.counts, ended);
}

// Without a loop, which may not go round any more.
fn store_pixel(pixel: Pixel, film: ptr<function, PixelFilm>) {
    work.words[pixel.index] = film.s;
    if film.s < film.end {
        film.counts = kept_counts;
        atomicAdd(&work.unfinished, 1u);
        atomicMax(&work.stuck, select(0u, pixel.index + 1u, film.s == film.first));
    }
    store_replicate(pixel, film, 0u);
    store_replicate(pixel, film, 1u);
    store_replicate(pixel, film, 2u);
    store_replicate(pixel, film, 3u);
}
