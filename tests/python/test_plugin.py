"""The pytest plugin, in a pytest of its own."""

import importlib.util

import pytest

from etendue._scene import dumps

TEST = """
def test_room(etendue_golden):
    etendue_golden("room.toml", size=(24, 16), power="5%", backend="cpu")
"""


@pytest.fixture
def project(pytester, room):
    """A folder with a scene and a test of it."""
    pytester.makefile(".toml", room=dumps(room))
    pytester.makepyfile(TEST)
    return pytester


def test_the_first_run_makes_the_golden_and_the_next_pass(project):
    first = project.runpytest_subprocess()
    first.assert_outcomes(failed=1)
    first.stdout.fnmatch_lines(["E * AssertionError: *golden/room.exr was created: look at it and commit it"])
    project.runpytest_subprocess().assert_outcomes(passed=1)
    # A golden that passes is left alone.
    before = (project.path / "golden/room.exr").read_bytes()
    project.runpytest_subprocess("--force-regen").assert_outcomes(passed=1)
    assert (project.path / "golden/room.exr").read_bytes() == before


def test_a_changed_scene_fails_until_it_is_made_anew(project, room):
    project.runpytest_subprocess()
    room["light"][0]["radiance"] = [9, 9, 9]
    project.makefile(".toml", room=dumps(room))
    done = project.runpytest_subprocess()
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(["*is of another scene than*re-create the golden: pytest --force-regen"])
    done = project.runpytest_subprocess("--force-regen")
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(["*golden/room.exr was re-created*", "*the golden before it: *is of another scene than*"])
    assert "pytest --force-regen" not in done.stdout.str()
    project.runpytest_subprocess().assert_outcomes(passed=1)


def test_a_difference_is_told_with_its_place_and_page(project):
    project.runpytest_subprocess()
    golden = project.path / "golden/room.exr"
    data = golden.read_bytes()
    room = (project.path / "room.toml").read_text()
    # A golden of another light that says it is of this scene: what a fault of the renderer would look like.
    (project.path / "room.toml").write_text(room.replace("radiance = [8, 8, 8]", "radiance = [9, 9, 9]"))
    project.runpytest_subprocess("--force-regen")
    other = golden.read_bytes()
    (project.path / "room.toml").write_text(room)
    old, new = (scene_hash(d) for d in (data, other))
    golden.write_bytes(other.replace(new, old))
    done = project.runpytest_subprocess()
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines([
        "E * AssertionError: FAILED  room: different in the whole picture*",
        "*where * channel * golden * now * change * z*",
        "*see *room.report.html and *room.actual.npz*pytest --force-regen*",
    ])
    assert (project.path / "golden/room.report.html").exists()


def test_a_golden_that_cannot_be_written_is_an_error(project):
    (project.path / "golden/room.exr/in the way").mkdir(parents=True)
    done = project.runpytest_subprocess("--force-regen")
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(["E * etendue.FileError: no access  room: *room.exr: cannot *"])


def scene_hash(exr: bytes) -> bytes:
    """The value of the attribute in the header of an EXR file."""
    start = exr.index(b"scene_hash\0string\0") + len(b"scene_hash\0string\0") + 4
    return exr[start : start + 64]


def test_a_missing_scene_is_an_error(pytester):
    pytester.makepyfile('def test_it(etendue_golden):\n    etendue_golden("none.toml")\n')
    done = pytester.runpytest_subprocess()
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(["E * etendue.FileError: *none.toml: there is no such scene"])


def test_the_option_is_shared_with_pytest_regressions(project):
    if importlib.util.find_spec("pytest_regressions") is None:
        pytest.skip("pytest-regressions is not installed")
    project.runpytest_subprocess("--force-regen").assert_outcomes(failed=1)
    project.runpytest_subprocess().assert_outcomes(passed=1)
    # Without that plugin its option is gone, and goldens are compared.
    project.runpytest_subprocess("-p", "no:regressions").assert_outcomes(passed=1)
