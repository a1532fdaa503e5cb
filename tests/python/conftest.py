"""What the tests of the Python package share. They run against the installed package, or python/ on the path."""

import pathlib

import pytest

import etendue

pytest_plugins = ["pytester"]

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture
def room():
    """A small scene with a mirror and glass, as a dict."""
    return {
        "title": "Test room",
        "camera": {"eye": [0, 1, 3], "look_at": (0, 0.9, 0), "vfov": 45.0, "resolution": [24, 16]},
        "material": {
            "white": {"type": "diffuse", "reflectance": [0.7, 0.6, 0.5]},
            "steel": {"type": "mirror"},
            "glass": {"type": "dielectric"},
        },
        "plane": [
            {"point": [0, 0, 0], "normal": [0, 1, 0], "material": "white"},
            {"point": [0, 0, -1.5], "normal": [0, 0, 1], "material": "white"},
        ],
        "sphere": [
            {"center": [-0.5, 0.5, -0.5], "radius": 0.45, "material": "steel"},
            {"center": [0.6, 0.5, 0.0], "radius": 0.4, "material": "glass"},
        ],
        "light": [{"center": [0, 2.2, 0], "normal": [0, -1, 0], "radius": 0.5, "radiance": [8, 8, 8]}],
    }


@pytest.fixture
def film(room):
    """A film of it."""
    return etendue.render(room, spp=64, backend="cpu")
