"""Scenes as paths, text or dicts."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import re
import tempfile
import typing

Scene = typing.Union[str, "os.PathLike[str]", typing.Mapping[str, typing.Any]]
"""A scene: the path of a file, the text of one, or its tables as a dict."""

# The key of [[spheres]] and the like that names a file of rows.
FILE = re.compile(r"""^(\s*file\s*=\s*)("[^"\\]*"|'[^']*')""", re.MULTILINE)


@contextlib.contextmanager
def scene_file(scene: Scene) -> typing.Iterator[tuple[pathlib.Path, dict[str, str]]]:
    """A file that holds the scene, and what messages shall call it."""
    if isinstance(scene, os.PathLike) or (isinstance(scene, str) and is_path(scene)):
        yield pathlib.Path(scene), {}
        return
    if not isinstance(scene, (str, typing.Mapping)):
        raise TypeError(f"a scene is a path, text or a dict, not {type(scene).__name__}")
    text = scene if isinstance(scene, str) else dumps(scene)
    with tempfile.TemporaryDirectory(prefix="etendue-") as folder:
        path = pathlib.Path(folder, "scene.toml")
        # Files of rows lie relative to the working directory. The line stays where it is, for messages.
        path.write_text(FILE.sub(lambda m: m[1] + basic(os.path.abspath(m[2][1:-1])), text), encoding="utf-8")
        yield path, {os.fspath(path): "scene"}


def is_path(text: str) -> bool:
    """Whether a string is the path of a scene, and not its text."""
    return "\n" not in text and ("=" not in text or os.path.exists(text))


def dumps(tables: typing.Mapping[str, typing.Any]) -> str:
    """A dict as TOML. Lists of dicts become ``[[name]]``, dicts become ``[name]``, NumPy values what they hold.

    >>> print(dumps({"title": "a", "camera": {"vfov": 40}, "light": [{"radius": 0.5}]}))
    title = "a"
    <BLANKLINE>
    [camera]
    vfov = 40
    <BLANKLINE>
    [[light]]
    radius = 0.5
    <BLANKLINE>
    """
    return "\n".join(section("", tables)) + "\n"


def section(name: str, table: typing.Mapping[str, typing.Any]) -> typing.Iterator[str]:
    """The lines of a table: its values first, then the tables in it."""
    inner = []
    for key, value in table.items():
        value = plain(value)
        label = key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else basic(key)
        path = f"{name}.{label}" if name else label
        if isinstance(value, typing.Mapping):
            inner += ["", f"[{path}]", *section(path, value)]
        elif isinstance(value, list) and value and all(isinstance(v, typing.Mapping) for v in value):
            for one in value:
                inner += ["", f"[[{path}]]", *section(path, one)]
        else:
            yield f"{label} = {literal(value)}"
    yield from inner


def plain(value: typing.Any) -> typing.Any:
    """NumPy arrays and scalars, and tuples, as what Python has for them."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return list(value) if isinstance(value, tuple) else value


def literal(value: typing.Any) -> str:
    """A value in TOML."""
    value = plain(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return basic(os.fspath(value))
    if isinstance(value, list):
        return f"[{', '.join(map(literal, value))}]"
    raise TypeError(f"a scene has numbers, texts, lists and dicts, not {type(value).__name__}: {value!r}")


def basic(text: str) -> str:
    """A string in TOML, whose escapes are those of JSON, and one more."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
