"""etendue in Python: render scenes, read films, compare pictures.

>>> import etendue
>>> room = {
...     "camera": {"eye": [0, 1, 5], "look_at": [0, 0.5, 0], "vfov": 40, "resolution": [32, 24]},
...     "material": {"white": {"type": "diffuse", "reflectance": [0.75, 0.75, 0.75]}},
...     "sphere": [{"center": [0, 0, 0], "radius": 8, "material": "white"}],
...     "light": [{"center": [0, 4, 0], "normal": [0, -1, 0], "radius": 0.6, "radiance": [12, 12, 12]}],
... }
>>> film = etendue.render(room, spp=64)
>>> film.mean.shape, film.error.shape, int(film.samples.min())
((24, 32, 3), (24, 32, 4), 64)
>>> 0 < film.relative_error < 0.2
True

The package runs the program `etendue`, which the wheel carries. Nothing is computed in Python: numbers are those of the
program, and its messages are those of the exceptions.
"""

from ._compare import Finding, Verdict, compare
from ._film import Film, merge
from ._program import DeviceError, Error, FileError, InputError, RenderWarning, program, version
from ._render import render
from ._scene import Scene

__version__ = version()

__all__ = [
    "DeviceError",
    "Error",
    "FileError",
    "Film",
    "Finding",
    "InputError",
    "RenderWarning",
    "Scene",
    "Verdict",
    "compare",
    "merge",
    "program",
    "render",
]

# Messages and pages call them by the name under which they are imported.
for _public in (DeviceError, Error, FileError, Film, Finding, InputError, RenderWarning, Verdict, compare, merge, program, render):
    _public.__module__ = __name__
