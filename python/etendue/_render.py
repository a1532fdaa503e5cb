"""Renders scenes."""

from __future__ import annotations

import os
import pathlib
import typing

from . import _program, _progress
from ._film import Film, keep, temporary_folder
from ._scene import Scene, scene_file


def render(
    scene: Scene,
    *,
    spp: int | None = None,
    error: float | str | None = None,
    time: float | str | None = None,
    samples: tuple[int, int] | None = None,
    film: str | os.PathLike[str] | None = None,
    size: tuple[int, int] | None = None,
    regions: typing.Iterable[tuple[int, int, int, int]] = (),
    adaptive: bool = False,
    light: str | typing.Iterable[str] | None = None,
    integrator: str | None = None,
    light_paths: str | None = None,
    shadow_rays: int | None = None,
    max_depth: int | None = None,
    strata: int | None = None,
    seed: int | None = None,
    backend: str | None = None,
    adapter: str | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> Film:
    """Renders a scene until the first stop condition is met; without one, 256 samples per pixel.

    Args:
        scene: the path of a scene file, the text of one, or its tables as a dict. Text has line breaks, a path has none.
            Files of rows that text and dicts name lie relative to the working directory.
        spp: stop at so many samples per pixel, those in `film` included.
        error: stop at this relative error: 0.02 or "2%".
        time: stop after so long: seconds, or text such as "10m".
        samples: only the samples with these numbers: the first, and one more than the last.
        film: a film to create, or to resume. It is saved now and then, and at Ctrl-C.
        size: width and height in pixels instead of the scene's.
        regions: only these parts of the picture: x0, y0, x1, y1, half open.
        adaptive: put samples where the noise is.
        light: the light to keep: "emitted", "direct", "indirect", or several of them.
        integrator: "path" or "whitted".
        light_paths: "off" traces nothing from the lamps.
        shadow_rays, max_depth, strata, seed: as the flags of these names.
        backend: "gpu" is any adapter, "cpu" the f64 reference, "auto" the best there is.
        adapter: the adapter whose name contains this.
        threads: for a software adapter or the reference.
        progress: show a bar. By default there is one on terminals and in notebooks, if tqdm is installed.

    Raises:
        InputError: the scene or an option is wrong.
        DeviceError: there is no usable adapter, or it failed.
        FileError: a file cannot be read or written.
        KeyboardInterrupt: after Ctrl-C; a `film` has been saved then.
    """
    flags: dict[str, typing.Any] = {
        "spp": spp,
        "error": error,
        "time": f"{time}s" if isinstance(time, (int, float)) else time,
        "samples": samples and "..".join(map(str, samples)),
        "size": size and "x".join(map(str, size)),
        "light": light if light is None or isinstance(light, str) else ",".join(light),
        "integrator": integrator,
        "light-paths": light_paths,
        "shadow-rays": shadow_rays,
        "max-depth": max_depth,
        "strata": strata,
        "seed": seed,
        "backend": backend,
        "adapter": adapter,
        "threads": threads,
    }
    arguments = [f"--{flag}={value}" for flag, value in flags.items() if value is not None]
    arguments += [f"--region={','.join(map(str, region))}" for region in regions]
    if adaptive:
        arguments.append("--adaptive")
    with temporary_folder() as folder:
        out = pathlib.Path(film) if film is not None else folder / "film.npz"
        # A render writes at least one picture. This one is not kept: the film has it.
        picture = folder / "picture.png"
        arguments += ["--progress=json", f"--film={out}", f"--output={picture}"]
        with scene_file(scene) as (path, renamed):
            bar = _progress.bar(progress, "scene" if renamed else path.stem)
            _program.run(["render", *arguments, "--", path], bar=bar, renamed=renamed)
        picture.unlink()
        return keep(Film(out), folder)
