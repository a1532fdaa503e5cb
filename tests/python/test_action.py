"""The shell parts of action.yml, run as a runner would, with a server of ours in place of the releases."""

import functools
import http.server
import os
import pathlib
import subprocess
import threading

import pytest

import etendue
from conftest import ROOT
from etendue._scene import dumps

yaml = pytest.importorskip("yaml")


@pytest.fixture
def runner(tmp_path, room):
    """A folder as a runner has it: a home, a work tree with scenes, and the files that steps write."""
    for folder in ("home", "work/scenes", "tools"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "work/scenes/room.toml").write_text(dumps(room))
    return Runner(tmp_path)


class Runner:
    """Runs the steps with `run` by their names."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder
        steps = yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"]
        self.steps = {step["name"]: step for step in steps}
        self.server = "http://127.0.0.1:9"

    def file(self, name: str) -> str:
        path = self.folder / name
        return path.read_text() if path.exists() else ""

    def run(self, name: str, **values: str) -> subprocess.CompletedProcess[str]:
        step = self.steps[name]
        env = {
            "HOME": os.fspath(self.folder / "home"),
            "PATH": os.pathsep.join([os.fspath(self.folder / "tools"), *self.file("path").split(), "/usr/bin", "/bin"]),
            "GITHUB_SERVER_URL": self.server,
            **{f"GITHUB_{key}": os.fspath(self.folder / key.lower()) for key in ("OUTPUT", "PATH", "STEP_SUMMARY")},
            **values,
        }
        # Every value that the step names is given, and nothing else.
        assert set(step.get("env", {})) == set(values)
        # As `shell: bash` does.
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        return subprocess.run(command, env=env, cwd=self.folder / "work", capture_output=True, text=True)

    def outputs(self) -> dict[str, str]:
        return dict(line.split("=", 1) for line in self.file("output").splitlines())

    def tool(self, name: str, text: str) -> None:
        path = self.folder / "tools" / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)


def test_the_version_and_the_key_come_from_the_sources(runner):
    assert runner.run("The version of this action", SOURCE=os.fspath(ROOT)).returncode == 0
    told = runner.outputs()
    cargo = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{told["version"]}"' in cargo and told["key"].startswith(f"etendue-{told['version']}-")
    assert runner.steps["The program and compiled kernels of an earlier run"]["with"]["key"] == "${{ steps.version.outputs.key }}"


def test_a_release_is_downloaded_once(runner):
    archive = os.environ.get("ETENDUE_ARCHIVE")
    if archive is None:
        pytest.skip("scripts/package names the archive in ETENDUE_ARCHIVE")
    archive = pathlib.Path(archive)
    version = archive.stem.rsplit("-v", 1)[1]
    there = runner.folder / f"www/some/one/releases/download/v{version}"
    there.mkdir(parents=True)
    (there / archive.name).symlink_to(archive)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=runner.folder / "www")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        runner.server = f"http://127.0.0.1:{server.server_port}"
        values = {"SOURCE": os.fspath(ROOT), "REPOSITORY": "some/one", "REF": f"v{version}", "VERSION": version}
        done = runner.run("The program", **values)
        assert done.returncode == 0 and done.stdout == f"etendue {version}\n", done.stderr
        server.shutdown()
    # The second time it is in the cache.
    assert runner.run("The program", **values).returncode == 0


def test_other_commits_are_built(runner):
    runner.tool("rustup", 'echo "rustup $*" >&2')
    runner.tool("cargo", f'echo "cargo $*" >&2; mkdir -p "$7/bin"; ln -s {etendue.program()} "$7/bin/etendue"')
    values = {"SOURCE": "/the/source", "REPOSITORY": "some/one", "REF": "main", "VERSION": "0.0.0"}
    done = runner.run("The program", **values)
    assert done.returncode == 0, done.stderr
    assert "cargo +stable install --locked --path /the/source --root " in done.stderr
    assert runner.file("path").strip().endswith("/.cache/etendue-action/bin")


def test_pictures_are_compared_and_summed_up(runner):
    (runner.folder / "tools/etendue").symlink_to(etendue.program())
    scenes = runner.folder / "work/scenes"
    regress = {"SCENES": "scenes", "ARGUMENTS": "--alpha 1e-5 --scene room"}
    done = runner.run("Golden pictures", **regress)
    assert done.returncode == 1 and "new  room" in done.stdout, done.stderr
    subprocess.run([etendue.program(), "regress", scenes, "--bless", "--power=5%", "-q"], check=True, capture_output=True)
    done = runner.run("Golden pictures", **regress)
    assert done.returncode == 0, done.stdout + done.stderr
    assert runner.file("step_summary").startswith("### 1 of 1 scene (--scene room): 1 passed\n")
    assert "false-alarm rate 1e-5" in runner.file("step_summary")
    uploaded = runner.steps["Pages, and films of what failed"]["with"]["path"].split("\n")
    assert all((runner.folder / "work" / path).exists() for path in uploaded if path.startswith("etendue-results"))


def test_a_driver_that_is_there_is_not_installed_again(runner):
    runner.tool("sudo", "echo installed >&2")
    done = runner.run("A software Vulkan driver")
    there = any(pathlib.Path("/usr/share/vulkan/icd.d").glob("*.json"))
    assert done.returncode == 0 and ("installed" in done.stderr) != there
