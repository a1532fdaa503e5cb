// How a pixel's numbers are stored where the loop may have ended in the middle of a sample: see trips/counted.wgsl.

// Counts when the last sample ended: those of an unfinished sample do not count.
var<private> kept_counts: vec4u;

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
