"""Finds the program, runs it, and turns its messages into exceptions."""

from __future__ import annotations

import importlib.metadata
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sysconfig
import threading
import typing
import warnings

from ._progress import Bar

PROGRAM_VARIABLE = "ETENDUE_PROGRAM"


class Error(RuntimeError):
    """The program failed. The text is its message."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.status = status
        """Exit status of the program."""


class InputError(Error, ValueError):
    """An option, a scene, a film or a picture is wrong (exit status 2)."""


class DeviceError(Error):
    """There is no usable adapter, or it failed (exit status 3)."""


class FileError(Error, OSError):
    """A file is missing, or cannot be read or written (exit status 4)."""

    # OSError has a __str__ of its own, which knows nothing of these arguments.
    def __str__(self) -> str:
        return str(self.args[0])


class RenderWarning(UserWarning):
    """What the program warns of, such as a light that lights nothing."""


KINDS: dict[int, type[Error]] = {2: InputError, 3: DeviceError, 4: FileError}


class Done(typing.NamedTuple):
    """How the program ended."""

    status: int
    output: str
    messages: list[str]


def version() -> str:
    """The version of the installed package; "0" in a checkout."""
    try:
        return importlib.metadata.version("etendue")
    except importlib.metadata.PackageNotFoundError:
        return "0"


def program() -> pathlib.Path:
    """The program that is run.

    It is the one that the environment variable ``ETENDUE_PROGRAM`` names, else the one that came with this package, else
    the one on the path.
    """
    named = os.environ.get(PROGRAM_VARIABLE)
    if named:
        found = shutil.which(named)
        if found is None:
            raise FileError(f"{PROGRAM_VARIABLE}={named}: there is no such program", 4)
        return pathlib.Path(found)
    # pip puts it into the environment, beside the user's own packages, or with --target into a folder beside this package.
    folders = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    folders.append(os.fspath(pathlib.Path(__file__).resolve().parents[1] / "bin"))
    found = shutil.which("etendue", path=os.pathsep.join(folders)) or shutil.which("etendue")
    if found is None:
        raise FileError(f"the program etendue is not installed; set {PROGRAM_VARIABLE} to where it is", 4)
    return pathlib.Path(found)


def run(
    arguments: typing.Sequence[str | os.PathLike[str]],
    *,
    bar: Bar | None = None,
    good: typing.Collection[int] = (0,),
    renamed: typing.Mapping[str, str] | None = None,
    cwd: str | os.PathLike[str] | None = None,
) -> Done:
    """Runs the program and waits for it.

    Ctrl-C ends the program as it does on a command line, after it has saved its film, and raises KeyboardInterrupt.

    Args:
        arguments: its arguments.
        bar: shows the events of ``--progress json``.
        good: exit statuses that are no failure.
        renamed: what messages call a file instead of its path.
        cwd: the folder that it runs in.

    Raises:
        Error: the program ended with another status.
    """
    child = subprocess.Popen(
        [program(), *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        cwd=cwd,
        # A terminal or notebook would send it Ctrl-C besides, and a second one ends it without saving.
        start_new_session=True,
    )
    assert child.stdout is not None and child.stderr is not None
    output: list[str] = []
    messages: list[str] = []
    reader = threading.Thread(target=lambda out: output.append(out.read()), args=[child.stdout], daemon=True)
    reader.start()

    def listen(stream: typing.IO[str]) -> None:
        for line in stream:
            # Events of ``--progress json``; what is said of arguments is plain text.
            event = json.loads(line) if line.startswith("{") else {"event": "message", "level": "info", "text": line}
            if event["event"] == "message":
                level = {"error": "error: ", "warning": "warning: "}.get(event["level"], "")
                messages.append(rename(level + event["text"].rstrip("\n"), renamed or {}))
            elif bar is not None:
                bar.show(event)

    try:
        try:
            listen(child.stderr)
        except KeyboardInterrupt:
            child.send_signal(signal.SIGINT)
            listen(child.stderr)
            raise
        status = child.wait()
    except BaseException:
        # A second Ctrl-C, or another exception: nothing is waited for.
        if child.poll() is None:
            child.terminate()
        child.wait()
        raise
    finally:
        if bar is not None:
            bar.close()
        reader.join()
        child.stdout.close()
        child.stderr.close()
    if status not in good:
        raise failure(status, messages)
    warn(messages)
    return Done(status, "".join(output), messages)


def rename(text: str, names: typing.Mapping[str, str]) -> str:
    for path, name in names.items():
        text = text.replace(path, name)
    return text


# Flags of the command line that have another name here.
RENAMED = {"region": "regions"}


def in_python(text: str) -> str:
    """What the program says, with the arguments of Python in place of flags.

    >>> in_python("invalid value '-1' for '--spp <N>': expected; raise it with --max-depth N (--spp-a)")
    "invalid value '-1' for spp=: expected; raise it with max_depth=N (spp_a=)"
    """

    def argument(match: re.Match[str]) -> str:
        return f"{RENAMED.get(match[1], match[1].replace('-', '_'))}="

    text = re.sub(r"\n+For more information, try '--help'\.", "", text)
    text = re.sub(r"'--([a-z][a-z-]*)(?: <[^>']*>)?'", argument, text)
    return re.sub(r"(?<![\w-])--([a-z][a-z-]*)(?: (?=[A-Z0-9]))?", argument, text)


def failure(status: int, messages: list[str]) -> Error:
    """The exception for an exit status, with the program's own message."""
    if status < 0:
        return Error(f"etendue was killed by {signal.Signals(-status).name}", status)
    first = next((k for k, line in enumerate(messages) if line.startswith("error: ")), 0)
    text = "\n".join(line.removeprefix("error: ") for line in messages[first:]).strip()
    return KINDS.get(status, Error)(in_python(text) or f"etendue ended with status {status}", status)


def warn(messages: list[str]) -> None:
    """Raises the program's warnings as those of the line that called the package."""
    here = os.path.dirname(__file__)
    level, frame = 1, __import__("sys")._getframe()
    while frame is not None and os.path.dirname(frame.f_code.co_filename) == here:
        level, frame = level + 1, frame.f_back
    for line in messages:
        if line.startswith("warning: "):
            warnings.warn(in_python(line.removeprefix("warning: ")), RenderWarning, stacklevel=level)
