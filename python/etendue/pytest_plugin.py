"""A pytest plugin: scenes against golden pictures, up to their noise.

    def test_room(etendue_golden):
        etendue_golden("room.toml")
"""

from __future__ import annotations

import importlib.util
import os
import pathlib
import re
import typing

import pytest

from . import _program


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds ``--force-regen``, unless pytest-regressions, which has the same option, adds it."""
    if importlib.util.find_spec("pytest_regressions") is not None:
        return
    parser.getgroup("etendue").addoption(
        "--force-regen",
        action="store_true",
        default=False,
        help="Re-create the golden pictures that no longer pass, and fail their tests once.",
    )


WORD = r"(?:'(?:[^']|'\\'')*'|\S+)"

# What `etendue regress` says re-creates a golden.
COMMAND = re.compile(rf"etendue regress {WORD} --bless --scene {WORD}")


class Golden:
    """Compares scenes with their golden pictures."""

    def __init__(self, folder: pathlib.Path, regenerate: bool) -> None:
        self.folder = folder
        self.regenerate = regenerate

    def __call__(
        self,
        scene: str | os.PathLike[str],
        *,
        alpha: float | None = None,
        size: tuple[int, int] | None = None,
        power: float | str | None = None,
        max_spp: int | None = None,
        backend: str | None = None,
        adapter: str | None = None,
    ) -> None:
        """Renders a scene and compares it with ``golden/NAME.exr`` beside it.

        A golden that does not exist is created, and the test fails once. With ``--force-regen`` the same is done to a
        golden that no longer passes.

        Args:
            scene: a scene file; relative paths start at the folder of the test.
            alpha: the probability that an unchanged scene fails; 0.001 by default.
            size: of a new golden: width and height; 64 pixels wide by default.
            power: of a new golden: the smallest change of the whole brightness to detect; "1%" by default.
            max_spp: of a new golden: the most samples per pixel; 4096 by default.
            backend: "gpu" makes a missing adapter an error; by default the f64 reference steps in.
            adapter: the adapter whose name contains this.

        Raises:
            AssertionError: the picture differs; with the verdict, where it differs, and the path of a page.
            etendue.Error: nothing could be rendered or compared.
        """
        __tracebackhide__ = True
        path = self.folder / scene
        if not path.is_file():
            raise _program.FileError(f"{path}: there is no such scene", 4)
        golden = path.parent / "golden" / f"{path.stem}.exr"
        common = {"alpha": alpha, "backend": backend, "adapter": adapter}
        making = {"size": size and "x".join(map(str, size)), "power": power, "max-spp": max_spp}
        if golden.exists() and not self.regenerate:
            word, told = self.regress(path, common)
            if word != "passed":
                raise AssertionError(told)
            return
        was_there = golden.exists()
        word, told = self.regress(path, {**common, **making}, "--bless")
        if word == "kept":
            return
        if word != "blessed":
            raise AssertionError(told)
        done = "re-created" if was_there else "created"
        raise AssertionError(f"{golden} was {done}: look at it and commit it\n{told}")

    @staticmethod
    def regress(path: pathlib.Path, options: dict[str, typing.Any], *flags: str) -> tuple[str, str]:
        """The word of ``etendue regress`` for the scene, and what it says."""
        given = [f"--{flag}={value}" for flag, value in options.items() if value is not None]
        arguments: list[str | os.PathLike[str]] = ["regress", *flags, *given, "--progress=none", f"--scene={path.stem}", "--", path.parent]
        done = _program.run(arguments, good=(0, 1, 2, *_program.KINDS))
        found = re.match(rf"\s*(\w+(?: \w+)?)  {re.escape(path.stem)}: ", done.output)
        if found is None:
            raise _program.failure(done.status, done.messages)
        # The last line counts scenes.
        lines = done.output.splitlines()[:-1]
        text = "\n".join(line.strip() if k == 0 else line for k, line in enumerate(lines))
        # The command has another name here.
        text = COMMAND.sub("pytest --force-regen", text)
        if found[1] in ("no device", "no access"):
            raise _program.KINDS[done.status](text, done.status)
        return found[1], text


@pytest.fixture
def etendue_golden(request: pytest.FixtureRequest) -> Golden:
    """Compares a scene with its golden picture: ``etendue_golden("room.toml")``."""
    return Golden(request.path.parent, bool(request.config.getoption("--force-regen", default=False)))
