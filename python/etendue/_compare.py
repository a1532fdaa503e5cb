"""Whether two pictures are the same up to their noise."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import tempfile
import typing

from . import _program
from ._film import Film, called, file_of

CHANNELS = ("red", "green", "blue")


@dataclasses.dataclass(frozen=True)
class Finding:
    """A block of pixels that differs in one channel."""

    bounds: tuple[int, int, int, int]
    """Its pixels: x0, y0, x1, y1, half open."""
    whole: bool
    """Whether it is the whole picture."""
    channel: str
    """"red", "green" or "blue"."""
    p: float
    """The probability that any test finds such a difference in equal pictures."""
    z: float
    """B - A over its standard error."""
    means: tuple[float, float]
    """Mean of the channel over the block in A and B."""


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What a comparison found. It is true if the pictures are the same: ``assert etendue.compare(a, b)``."""

    same: bool
    """Whether nothing speaks against the pictures being the same."""
    identical: bool
    """Whether every pixel is the same to the bit."""
    sentence: str
    """The verdict in one sentence."""
    table: str
    """Where the difference is; empty without one."""
    alpha: float | None
    """The rate of false alarms; None if a picture does not state its noise."""
    p: float | None
    """The probability that pictures of the same scene differ as much somewhere."""
    findings: tuple[Finding, ...]
    """What differs, the most certain first."""
    detects: float | None
    """The smallest relative change of the whole picture's brightness that would have been seen; None if there is none."""
    metrics: dict[str, typing.Any]
    """Distances, noise included: `means`, `rmse`, `relative_rmse`, `psnr`, `flip`."""
    exceeded: tuple[str, ...]
    """Limits that are exceeded, in words."""
    notes: tuple[str, ...]
    """What one should know about the pair."""

    def __bool__(self) -> bool:
        return self.same

    def __str__(self) -> str:
        notes = [f"note: {note}" for note in self.notes]
        return "\n".join([self.sentence, *self.table.splitlines(), *notes])

    def __repr__(self) -> str:
        return f"<Verdict: {self}>"


Picture = typing.Union[Film, str, "os.PathLike[str]"]
"""A film, or the path of a picture."""


def compare(
    a: Picture | typing.Sequence[Picture],
    b: Picture | typing.Sequence[Picture],
    *,
    alpha: float | None = None,
    max_flip: float | None = None,
    max_relative_rmse: float | str | None = None,
    html: str | os.PathLike[str] | None = None,
) -> Verdict:
    """Whether two pictures are the same up to their noise.

    Args:
        a: a film or the path of a picture; the reference where the order matters. Several independent renders of it, by any
            program, are a list: their spread is its noise.
        b: the other.
        alpha: the probability that two pictures of the same scene are called different; 0.001 by default.
        max_flip: the largest mean FLIP allowed, 0 to 1.
        max_relative_rmse: the largest relative RMSE allowed.
        html: write a page with both pictures and their difference.

    Raises:
        InputError: they cannot be compared.
        FileError: a file cannot be read or written.
    """
    sides = {name: side(name, pictures) for name, pictures in (("a", a), ("b", b))}
    renamed: dict[str, str] = {}
    for name, pictures in sides.items():
        for k, picture in enumerate(pictures):
            renamed.update(called(picture, name if len(pictures) == 1 else f"{name}[{k}]"))
    if any(len(pictures) > 1 for pictures in sides.values()):
        given: list[str | os.PathLike[str]] = []
        for name, pictures in sides.items():
            given += [f"--{name}", *map(file_of, pictures)]
    else:
        given = ["--", *(file_of(pictures[0]) for pictures in sides.values())]
    flags = {"alpha": alpha, "max-flip": max_flip, "max-relative-rmse": max_relative_rmse, "html": html}
    arguments = [f"--{flag}={value}" for flag, value in flags.items() if value is not None]
    with tempfile.TemporaryDirectory(prefix="etendue-") as folder:
        report = pathlib.Path(folder, "report.json")
        arguments += [f"--report={report}", "--progress=none"]
        _program.run(["compare", *arguments, *given], good=(0, 1), renamed=renamed)
        return read(json.loads(_program.rename(report.read_text(encoding="utf-8"), renamed)))


def side(name: str, pictures: Picture | typing.Sequence[Picture]) -> list[Picture]:
    """The pictures of one side."""
    if isinstance(pictures, (Film, str, os.PathLike)):
        return [pictures]
    found = list(pictures)
    if not found:
        raise ValueError(f"{name} is empty; it must be a film, a path, or a list of them")
    return found


def read(report: dict[str, typing.Any]) -> Verdict:
    """The verdict in a report of ``etendue compare``."""
    stated = report["verdict"] or {"alpha": None, "p": None, "findings": [], "sensitivity": []}
    findings = (
        Finding(
            bounds=tuple(f["rect"][key] for key in ("x0", "y0", "x1", "y1")),
            whole=f["whole"],
            channel=CHANNELS[f["channel"]],
            p=f["p"],
            z=f["z"],
            means=tuple(f["means"]),
        )
        for f in stated["findings"]
    )
    whole = [s["change"] for s in stated["sensitivity"] if s["side"] == 0]
    return Verdict(
        same=report["same"],
        identical=report["identical"],
        sentence=report["sentence"],
        table=report["table"],
        alpha=stated["alpha"],
        p=stated["p"],
        findings=tuple(findings),
        detects=whole[0] if whole else None,
        metrics=report["metrics"],
        exceeded=tuple(report["exceeded"]),
        notes=tuple(report["notes"]),
    )
