"""Renders scenes."""

from __future__ import annotations

import operator
import os
import pathlib
import re
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
    samples: tuple[int, int] | range | str | None = None,
    film: str | os.PathLike[str] | None = None,
    size: tuple[int, int] | str | None = None,
    regions: typing.Iterable[tuple[int, int, int, int]] | tuple[int, int, int, int] = (),
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
            One line is text too if it has an equals sign, and no file has this name.
            Files of rows that text and dicts name lie relative to the working directory.
        spp: stop at so many samples per pixel, those in `film` included.
        error: stop at this relative error: 0.02 or "2%".
        time: stop after so long: seconds, or text such as "10m".
        samples: only the samples with these numbers: a range, or the first and one more than the last.
        film: a film to create, or to resume. It is saved now and then, and at Ctrl-C.
        size: width and height in pixels instead of the scene's, or text such as "640x480".
        regions: only these parts of the picture, or this one: x0, y0, x1, y1, half open.
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
        "samples": None if samples is None else samples_flag(samples),
        "size": None if size is None else size_flag(size),
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
    arguments += [f"--region={region}" for region in region_flags(regions)]
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


def numbers(value: typing.Any, count: int) -> list[int] | None:
    """So many whole numbers, if the value is that."""
    try:
        found = [operator.index(n) for n in value]
    except TypeError:
        return None
    return found if len(found) == count else None


def size_flag(size: typing.Any) -> str:
    """A size for the command line.

    >>> size_flag((640, 480)), size_flag("640x480")
    ('640x480', '640x480')
    """
    pair = numbers(size, 2)
    if isinstance(size, str) and re.fullmatch(r"\d+x\d+", size):
        return size
    if pair is None:
        raise ValueError(f'size is {size!r}; it must be a width and a height: (640, 480) or "640x480"')
    return "x".join(map(str, pair))


def samples_flag(samples: typing.Any) -> str:
    """Sample numbers for the command line.

    >>> samples_flag((0, 64)), samples_flag(range(0, 64)), samples_flag("0..64")
    ('0..64', '0..64', '0..64')
    """
    if isinstance(samples, str) and re.fullmatch(r"\d+\.\.\d+", samples):
        return samples
    if isinstance(samples, range):
        pair = [samples.start, samples.stop] if samples.step == 1 else None
    else:
        pair = numbers(samples, 2)
    if pair is None:
        raise ValueError(f"samples is {samples!r}; it must be the first number and one more than the last: (0, 64) or range(0, 64)")
    return "..".join(map(str, pair))


def region_flags(regions: typing.Any) -> list[str]:
    """Regions, or one of them, for the command line.

    >>> region_flags((0, 0, 10, 10)), region_flags([(0, 0, 10, 10), "1,2,3,4"])
    (['0,0,10,10'], ['0,0,10,10', '1,2,3,4'])
    """
    regions = list(regions) if not isinstance(regions, str) else [regions]
    if numbers(regions, 4) is not None:
        regions = [regions]
    flags = []
    for region in regions:
        if isinstance(region, str) and re.fullmatch(r"\d+(,\d+){3}", region):
            flags.append(region)
            continue
        four = numbers(region, 4)
        if four is None:
            raise ValueError(f"a region is {region!r}; it must be four whole numbers of pixels: (x0, y0, x1, y1)")
        flags.append(",".join(map(str, four)))
    return flags
