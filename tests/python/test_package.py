"""Rendering, films, comparing, and errors."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time
import tomllib

import numpy as np
import pytest

import etendue
from etendue._scene import dumps


def test_a_film_has_means_errors_and_samples(film):
    assert film.size == (24, 16) and film.bounds == (0, 0, 24, 16)
    assert film.mean.shape == (16, 24, 3) and film.error.shape == (16, 24, 4) and film.samples.shape == (16, 24)
    assert (film.samples == 64).all() and np.isfinite(film.mean).all() and (film.error >= 0).all()
    assert film.provenance["scene_title"] == "Test room" and film.provenance["version"]
    told = subprocess.run([etendue.program(), "info", film.path], capture_output=True, text=True, check=True).stdout
    assert float(re.search(r"relative_error +(\S+)", told)[1]) == pytest.approx(film.relative_error, rel=1e-3)
    assert film.doubt is not None and "too few samples" in film.doubt
    assert film.relative_error_uncertainty < film.relative_error
    assert repr(film).startswith("<Film 24 x 16, 64 samples per pixel, relative error ")


def test_path_text_and_dict_are_one_scene(room, film, tmp_path):
    path = tmp_path / "room.toml"
    path.write_text(dumps(room))
    for scene in (path, str(path), path.read_text()):
        again = etendue.render(scene, spp=64, backend="cpu")
        assert (again.mean == film.mean).all()
        assert again.provenance["scene_hash"] == film.provenance["scene_hash"]


def test_dicts_become_toml_that_says_the_same(room):
    odd = {
        "title": 'quotes " and \\ and \x7f and \n and é',
        "material": {"two words": {"a": np.float64(1e22), "b": np.array([1, 2.5]), "c": True}, "è": {"d": ()}},
        "sphere": [{"x": -0.0}, {"x": 1}],
    }
    expected = json.loads(json.dumps(odd, default=lambda v: v.tolist()))
    assert tomllib.loads(dumps(odd)) == expected
    assert tomllib.loads(dumps(room)) == json.loads(json.dumps(room))
    with pytest.raises(TypeError, match="not object"):
        dumps({"title": object()})


def test_rows_lie_beside_the_working_directory(room, tmp_path, monkeypatch):
    (tmp_path / "balls.csv").write_text("x,y,z,radius\n0,0.2,0,0.2\n")
    monkeypatch.chdir(tmp_path)
    rows = {**room, "spheres": [{"file": pathlib.Path("balls.csv"), "material": "white"}]}
    for scene in (rows, dumps(rows), dumps(rows).replace('"balls.csv"', "'balls.csv'")):
        assert not (etendue.render(scene, spp=16, backend="cpu").mean == etendue.render(room, spp=16, backend="cpu").mean).all()


def test_a_film_is_resumed_saved_and_merged(room, tmp_path):
    whole = etendue.render(room, spp=512, backend="cpu")
    path = tmp_path / "long.npz"
    early = etendue.render(room, spp=256, film=path, backend="cpu")
    late = etendue.render(room, spp=512, film=path, backend="cpu")
    assert (late.mean == whole.mean).all() and late.path == path
    with pytest.raises(etendue.FileError, match="has changed since it was opened"):
        early.save(tmp_path / "early.npz")
    halves = [etendue.render(room, samples=s, backend="cpu") for s in [(0, 256), (256, 512)]]
    merged = etendue.merge(halves)
    assert np.allclose(merged.mean, whole.mean, rtol=1e-6) and (merged.samples == 512).all()
    merged.save(tmp_path / "merged.npz")
    assert (etendue.Film.open(tmp_path / "merged.npz").mean == merged.mean).all()
    with pytest.raises(etendue.InputError, match="^film 2 of 2: cannot be merged with film 1 of 2: .*samples"):
        etendue.merge([halves[0], etendue.render(room, samples=(0, 8), backend="cpu")])
    with pytest.raises(ValueError, match="at least one film"):
        etendue.merge([])
    with pytest.raises(TypeError, match="a list of films"):
        etendue.merge(halves[0])


def test_sizes_samples_and_regions_have_several_forms(room):
    whole = etendue.render(room, spp=16, size=(12, 8), backend="cpu")
    for size, samples in [("12x8", (0, 16)), ([12, 8], range(16)), (np.array([12, 8]), "0..16")]:
        assert (etendue.render(room, size=size, samples=samples, backend="cpu").mean == whole.mean).all()
    part = etendue.render(room, spp=16, size="12x8", regions=(2, 3, 10, 8), backend="cpu")
    assert part.bounds == (2, 3, 10, 8)
    for wrong, told in [
        ({"size": "32"}, r"size is '32'; it must be a width and a height: \(640, 480\)"),
        ({"size": (32,)}, r"size is \(32,\);"),
        ({"samples": range(0, 64, 2)}, r"samples is range\(0, 64, 2\); it must be the first number"),
        ({"samples": 64}, "samples is 64;"),
        ({"regions": [(0, 0, 10)]}, r"a region is \(0, 0, 10\); it must be four whole numbers"),
        ({"regions": "0,0"}, "a region is '0,0'; it must be four"),
    ]:
        with pytest.raises(ValueError, match=told):
            etendue.render(room, **wrong)
    with pytest.raises(etendue.InputError, match="^scene:1:7: "):
        etendue.render("title=")


def test_regions_have_bounds(room):
    film = etendue.render(room, spp=16, regions=[(2, 3, 10, 8)], backend="cpu")
    assert film.bounds == (2, 3, 10, 8) and film.mean.shape == (5, 8, 3) and film.size == (24, 16)


def test_pictures_are_what_the_program_writes(film, tmp_path):
    assert film._repr_png_().startswith(b"\x89PNG\r\n\x1a\n")
    assert film.png(exposure=1) != film.png()
    film.save(tmp_path / "a.exr")
    verdict = etendue.compare(film, tmp_path / "a.exr")
    assert verdict and verdict.metrics["rmse"] < 1e-6
    assert etendue.compare(tmp_path / "a.exr", tmp_path / "a.exr").identical
    with pytest.raises(etendue.InputError, match=r"a\.jpeg"):
        film.save(tmp_path / "a.jpeg")


def test_compare_tells_light_from_noise(room, film, tmp_path):
    other = etendue.render(room, spp=64, seed=1, backend="cpu")
    verdict = etendue.compare(film, other)
    assert verdict.same and bool(verdict) and not verdict.identical and verdict.p >= verdict.alpha == 0.001
    assert 0 < verdict.detects < 1 and verdict.sentence.startswith("equal up to noise")
    room["light"][0]["radiance"] = [12, 8, 8]
    brighter = etendue.render(room, spp=64, seed=1, backend="cpu")
    png = tmp_path / "film.png"
    film.save(png)
    verdict = etendue.compare(film, brighter, html=tmp_path / "page.html")
    assert not verdict and verdict.p < 0.001 and (tmp_path / "page.html").exists()
    first = verdict.findings[0]
    assert first.channel == "red" and first.means[1] > first.means[0]
    assert verdict.table in str(verdict) + "\n" and "different scenes" in str(verdict)
    with pytest.raises(etendue.InputError, match="^a has 24 x 16 pixels, but b has 8 x 8"):
        etendue.compare(film, etendue.render(room, spp=16, size=(8, 8), backend="cpu"))
    renders = [etendue.render(room, spp=16, seed=seed, backend="cpu") for seed in range(8)]
    room["light"][0]["radiance"] = [4, 4, 4]
    dim = [etendue.render(room, spp=16, seed=seed, backend="cpu") for seed in range(8, 12)]
    assert not etendue.compare(renders[:4], dim) and not etendue.compare(brighter, dim)
    assert not etendue.compare(renders[:4], renders[4:]).identical
    with pytest.raises(ValueError, match="^a is empty"):
        etendue.compare([], dim)
    with pytest.raises(etendue.InputError, match=r"use max_flip= or max_relative_rmse=.*\(a=, b=\), or by variances with spp_a= or spp_b="):
        etendue.compare(film, png)


def test_errors_carry_the_program_s_message(room, tmp_path):
    room["sphere"][0]["material"] = "steal"
    with pytest.raises(etendue.InputError, match=r'^scene:\d+:\d+: unknown material "steal"') as told:
        etendue.render(room)
    assert told.value.status == 2 and isinstance(told.value, ValueError)
    with pytest.raises(etendue.FileError, match="no_such.toml"):
        etendue.render(tmp_path / "no_such.toml")
    with pytest.raises(etendue.InputError, match=r"^invalid value '-1' for spp=: expected a whole number from 1 to \d+$"):
        etendue.render(room, spp=-1)
    with pytest.raises(etendue.DeviceError, match="no adapter"):
        room["sphere"][0]["material"] = "steel"
        etendue.render(room, adapter="no such thing")
    with pytest.raises(etendue.FileError):
        etendue.Film.open(tmp_path / "no_such.npz")
    (tmp_path / "bad.npz").write_bytes(b"PK\x03\x04 damaged")
    with pytest.raises(etendue.InputError, match="bad.npz"):
        etendue.Film.open(tmp_path / "bad.npz")
    with pytest.raises(TypeError, match="not int"):
        etendue.render(3)


def test_warnings_are_warnings_of_the_caller(room):
    with pytest.warns(etendue.RenderWarning, match="^the stated relative error is uncertain") as told:
        etendue.render(room, spp=16, backend="cpu")
    assert all(w.filename == __file__ for w in told)


def test_the_program_can_be_named(monkeypatch, tmp_path):
    monkeypatch.setenv("ETENDUE_PROGRAM", os.fspath(tmp_path / "missing"))
    with pytest.raises(etendue.FileError, match="ETENDUE_PROGRAM"):
        etendue.Film.open("a.npz")


def test_progress_is_shown_if_asked_for(room, capfd):
    pytest.importorskip("tqdm")
    etendue.render(room, time=1.0, backend="cpu", progress=True)
    assert "spp" in capfd.readouterr().err
    etendue.render(room, spp=16, backend="cpu")
    assert capfd.readouterr().err == ""


SLEEPER = """
import etendue, signal, sys
# A shell without job control starts what runs beside it with SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    etendue.render(sys.argv[1], time=60, backend="cpu", film=sys.argv[2], progress=False)
except KeyboardInterrupt:
    print("interrupted")
"""


def test_ctrl_c_saves_the_film(room, tmp_path):
    scene, film = tmp_path / "room.toml", tmp_path / "film.npz"
    scene.write_text(dumps(room))
    child = subprocess.Popen([sys.executable, "-c", SLEEPER, scene, film], stdout=subprocess.PIPE, text=True)
    # The program holds the lock from before the first sample on.
    lock, patience = tmp_path / ".film.npz.lock", time.monotonic() + 60
    while not lock.exists() and time.monotonic() < patience:
        time.sleep(0.05)
    time.sleep(2)
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=60)[0] == "interrupted\n"
    assert etendue.Film.open(film).samples.max() > 0
