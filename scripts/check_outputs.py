#!/usr/bin/env python3
"""Prints as JSON what independent readers find in pictures and films.

    pip install OpenEXR numpy pillow
    python3 scripts/check_outputs.py picture.exr picture.png film.npz

Prints one JSON object per file, each on one line. It has the type, shape, smallest and largest value of
every channel or array, and all values of small ones. Exits with 1 and a message if a file can't be read.
"""

import json
import sys
import zipfile

import numpy

# Arrays with at most this many numbers are printed in full.
SHOW = 4096


def describe(array):
    """Type, shape, range and, for small arrays, the values."""
    told = {"dtype": array.dtype.str, "shape": list(array.shape)}
    if array.size and array.dtype.kind in "fiu":
        told["min"] = array.min().item()
        told["max"] = array.max().item()
        told["finite"] = bool(numpy.isfinite(array).all())
        if array.size <= SHOW:
            told["values"] = array.tolist()
    return told


def plain(value):
    """A header's value as JSON; converted to text if JSON has no such type."""
    if isinstance(value, (str, int, float, bool)):
        return value
    if isinstance(value, numpy.ndarray):  # numbers are arrays with one element
        return value.item() if value.size == 1 else value.tolist()
    return str(value)


def exr(path):
    """Channels and attributes, by the reference implementation."""
    import OpenEXR

    with OpenEXR.File(path, separate_channels=True) as file:
        if len(file.parts) != 1:
            raise ValueError(f"expected one part, found {len(file.parts)}")
        window = file.header()["dataWindow"]
        return {
            "channels": {name: describe(c.pixels) for name, c in file.channels().items()},
            "attributes": {k: plain(v) for k, v in file.header().items() if k != "channels"},
            "size": [int(window[1][i] - window[0][i] + 1) for i in range(2)],
        }


def png(path):
    """Pixels and text chunks, by Pillow."""
    from PIL import Image

    with Image.open(path) as image:
        image.load()
        return {
            "mode": image.mode,
            "size": list(image.size),
            "pixels": describe(numpy.asarray(image)),
            "text": {k: str(v) for k, v in image.text.items()},
            "srgb": image.info.get("srgb"),
        }


def npz(path):
    """Arrays by NumPy, checksums by Python's zipfile."""
    with zipfile.ZipFile(path) as archive:
        bad = archive.testzip()
        if bad is not None:
            raise ValueError(f"wrong checksum of {bad}")
        compressed = any(i.compress_type != zipfile.ZIP_STORED for i in archive.infolist())
    with numpy.load(path) as film:
        arrays = {name: film[name] for name in film.files}
    provenance = json.loads(arrays["provenance"].item())
    return {
        "arrays": {name: describe(array) for name, array in arrays.items()},
        "provenance": provenance,
        "compressed": compressed,
    }


READERS = {"exr": exr, "png": png, "npz": npz}


def main(paths):
    """Describes each file; returns the exit status."""
    if not paths:
        print(__doc__, file=sys.stderr)
        return 2
    for path in paths:
        extension = path.rsplit(".", 1)[-1].lower()
        try:
            told = READERS[extension](path)
        except KeyError:
            print(f"{path}: the name must end in .exr, .png or .npz", file=sys.stderr)
            return 2
        except (OSError, ValueError, RuntimeError, zipfile.BadZipFile) as error:
            print(f"{path}: {error}", file=sys.stderr)
            return 1
        print(json.dumps(told))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
