// Kernels without trees do not count loop trips: the host knows how many a sample can take, and cuts the work accordingly.

fn begin_trips(film: ptr<function, PixelFilm>) {}

fn trips_remain() -> bool {
    return true;
}

// Whether the path still lives after this vertex.
fn spend_trips(film: ptr<function, PixelFilm>, lives: bool) -> bool {
    return lives;
}

fn keep_counts(film: ptr<function, PixelFilm>, ended: bool) {}

fn store_pixel(pixel: Pixel, film: ptr<function, PixelFilm>) {
    work.words[pixel.index] = film.s;
    for (var k = 0u; k < 2u * params.opaque_two; k++) {
        store_replicate(pixel, film, k);
    }
}
