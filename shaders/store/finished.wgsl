// How a pixel's numbers are stored where every sample that was begun is finished.

fn keep_counts(film: ptr<function, PixelFilm>, ended: bool) {}

fn store_pixel(pixel: Pixel, film: ptr<function, PixelFilm>) {
    work.words[pixel.index] = film.s;
    for (var k = 0u; k < 2u * params.opaque_two; k++) {
        store_replicate(pixel, film, k);
    }
}
