// Every ray is traced where it is asked for.

// What the path's ray meets.
fn next_hit(path: ptr<function, Path>, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) -> Hit {
    count_ray(film, true);
    return intersect(path.ray);
}

// Adds direct light to the path's radiance, if it `counts`.
fn gather(path: ptr<function, Path>, direct: vec3f, counts: bool) {
    path.radiance += select(vec3f(0.0), direct, counts);
}

// Adds the sample of a path that has ended, and starts the next at once: no lane waits for a longer path.
fn next_path(path: ptr<function, Path>, lives: bool, pixel: Pixel, sight: Sight, film: ptr<function, PixelFilm>) {
    let ended = !spend_trips(lives);
    let is_sample = ended & !is_glance(path);
    add_sample(film, path.radiance, is_sample);
    keep_counts(film, is_sample);
    let glances = glances_after(path, sight);
    let seen = select(vec3f(0.0), path.radiance, is_glance(path));
    begin_path(path, ended, camera_path(pixel, film.s, glances, sight), glances, seen);
}
