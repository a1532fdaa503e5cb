"""Films: what has been measured of a picture so far."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import shutil
import tempfile
import typing
import weakref

import numpy as np
import numpy.typing as npt

from . import _program


class Film:
    """What has been measured of a picture: means, errors, samples, and where they come from.

    Rows are from top to bottom. h and w are the size of :attr:`bounds`, which is the whole picture unless regions were
    rendered. Pixels without samples hold 0.
    """

    mean: npt.NDArray[np.float32]
    """Mean radiance, linear Rec. 709: shape (h, w, 3)."""

    error: npt.NDArray[np.float32]
    """Standard errors of the mean of R, G and B, and of the luminance: shape (h, w, 4)."""

    samples: npt.NDArray[np.uint64]
    """Samples of each pixel: shape (h, w)."""

    provenance: dict[str, typing.Any]
    """Where it comes from: version, scene text and hash, settings, devices, seconds, counters, ..."""

    size: tuple[int, int]
    """Width and height of the whole picture in pixels."""

    bounds: tuple[int, int, int, int]
    """The part of the picture that the arrays hold: x0, y0, x1, y1, half open."""

    _has_name = True

    path: pathlib.Path
    """The file that holds it. A film without a name of its own has a temporary one, which goes with the object."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = pathlib.Path(path)
        # The program checks every byte, and says what is wrong.
        about = json.loads(_program.run(["info", "--json", self.path]).output)
        if about["kind"] != "film":
            raise _program.InputError(f"{self.path}: not a film ({about['kind']})", 2)
        self._stamp = self._state()
        with np.load(self.path) as arrays:
            self.mean, self.error, self.samples = arrays["mean"], arrays["error"], arrays["counts"]
            head = json.loads(arrays["provenance"].item())
        self.provenance = head["provenance"]
        width, height = head["size"]
        self.size = (width, height)
        self.bounds = tuple(head["bounds"][key] for key in ("x0", "y0", "x1", "y1"))

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Film:
        """The film in a file.

        Raises:
            FileError: the file cannot be read.
            InputError: it is no film, or damaged.
        """
        return cls(path)

    @property
    def relative_error(self) -> float | None:
        """The standard error of a pixel over its luminance, as a root mean square; None while it is unknown."""
        return typing.cast("float | None", self.provenance["relative_error"])

    @property
    def relative_error_uncertainty(self) -> float | None:
        """The standard error of :attr:`relative_error`; None while it is unknown."""
        return typing.cast("float | None", self.provenance["relative_error_uncertainty"])

    @property
    def doubt(self) -> str | None:
        """Why :attr:`relative_error` is in doubt, in words; None if it is not."""
        return typing.cast("str | None", self.provenance["relative_error_doubt"])

    def save(self, path: str | os.PathLike[str], *, exposure: float = 0.0) -> None:
        """Writes it to a file: a film (``.npz``), or a picture (``.exr`` or ``.png``).

        Args:
            path: where to; a file that is there is replaced.
            exposure: stops, of PNG pictures.
        """
        path = pathlib.Path(path)
        if path.suffix.lower() != ".npz":
            _program.run(["develop", self._file(), "-o", path, "--exposure", str(exposure)])
            return
        # Beside its name and renamed: never half a film.
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as new:
            try:
                new.write(self._file().read_bytes())
                os.chmod(new.name, 0o666 & ~_umask())
                os.replace(new.name, path)
            except BaseException:
                os.unlink(new.name)
                raise

    def png(self, *, exposure: float = 0.0) -> bytes:
        """The picture as a PNG file: 8-bit sRGB after so many stops of exposure."""
        with tempfile.TemporaryDirectory(prefix="etendue-") as folder:
            path = pathlib.Path(folder, "picture.png")
            self.save(path, exposure=exposure)
            return path.read_bytes()

    def _repr_png_(self) -> bytes:
        return self.png()

    def __repr__(self) -> str:
        (width, height), error = self.size, self.relative_error
        told = "unknown" if error is None else f"{100 * error:.3g} %"
        samples = float(self.samples.mean())
        return f"<Film {width} x {height}, {samples:.6g} samples per pixel, relative error {told}>"

    def _state(self) -> tuple[int, int, int]:
        try:
            state = self.path.stat()
        except OSError as e:
            raise _program.FileError(f"{self.path}: {e.strerror}", 4) from None
        return (state.st_ino, state.st_mtime_ns, state.st_size)

    def _file(self) -> pathlib.Path:
        """Its file, if that still holds this film."""
        if self._state() != self._stamp:
            raise _program.FileError(f"{self.path} has changed since it was opened; open it again", 4)
        return self.path


def _umask() -> int:
    """The mask of new files, which can only be read by setting it."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


@contextlib.contextmanager
def temporary_folder() -> typing.Iterator[pathlib.Path]:
    """A folder that is removed if there is an error. After that it is the caller's."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="etendue-"))
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder)
        raise


def keep(film: Film, folder: pathlib.Path) -> Film:
    """The film, whose folder goes when it goes."""
    film._has_name = folder not in film.path.parents
    weakref.finalize(film, shutil.rmtree, folder, ignore_errors=True)
    return film


def file_of(source: Film | str | os.PathLike[str]) -> pathlib.Path:
    """The file of a film or a picture."""
    return source._file() if isinstance(source, Film) else pathlib.Path(source)


def called(source: Film | str | os.PathLike[str], name: str) -> dict[str, str]:
    """What messages call a film whose file has no name of its own."""
    return {os.fspath(source.path): name} if isinstance(source, Film) and not source._has_name else {}


def merge(films: typing.Iterable[Film | str | os.PathLike[str]]) -> Film:
    """All samples of some films of one scene as one film.

    Args:
        films: films or their paths. They have the same scene, size, seed and settings, and no sample in common.

    Raises:
        InputError: two of them do not fit; the message names them.
    """
    if isinstance(films, (Film, str, os.PathLike)):
        raise TypeError("merge takes a list of films")
    films = list(films)
    if not films:
        raise ValueError("merge takes at least one film, and the list is empty")
    renamed: dict[str, str] = {}
    for k, film in enumerate(films, 1):
        renamed.update(called(film, f"film {k} of {len(films)}"))
    with temporary_folder() as folder:
        out = folder / "merged.npz"
        _program.run(["merge", out, *map(file_of, films)], renamed=renamed)
        return keep(Film(out), folder)
