"""The shell parts of action.yml, run as a runner would, with a server of ours in place of the releases."""

import functools
import http.server
import os
import pathlib
import subprocess
import tarfile
import threading
import tomllib

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


def test_the_version_and_the_keys_come_from_the_sources_and_the_scenes(runner):
    def told():
        (runner.folder / "output").unlink(missing_ok=True)
        done = runner.run("The version of this action", SOURCE=os.fspath(ROOT), SCENES="scenes")
        assert done.returncode == 0, done.stderr
        return runner.outputs()

    first = told()
    cargo = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{first["version"]}"' in cargo and first["program"].startswith(f"etendue-{first['version']}-")
    assert first["key"].startswith(first["program"] + "-") and told() == first
    # Scenes that are added have kernels of their own, and goldens have none.
    (runner.folder / "work/scenes/golden").mkdir()
    (runner.folder / "work/scenes/golden/room.exr").write_text("")
    assert told() == first
    (runner.folder / "work/scenes/more.toml").write_text("")
    assert told()["key"] != first["key"] and told()["program"] == first["program"]
    restore = runner.steps["The program and compiled kernels of an earlier run"]
    save = runner.steps["Keep the program and compiled kernels"]
    assert restore["with"]["key"] == save["with"]["key"] == "${{ steps.version.outputs.key }}"
    assert restore["with"]["restore-keys"] == "${{ steps.version.outputs.program }}-"
    # A red run keeps what it has made.
    assert save["if"].startswith("always() && ") and save["with"]["path"] == restore["with"]["path"]


@pytest.fixture
def release(runner):
    """A release on a server of ours: its version, and the folder that holds it."""
    archive = os.environ.get("ETENDUE_ARCHIVE")
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["package"]["version"]
    there = runner.folder / f"www/some/one/releases/download/v{version}"
    there.mkdir(parents=True)
    name = f"etendue-{os.uname().machine}-unknown-linux-gnu-v{version}"
    if archive is None:
        with tarfile.open(there / f"{name}.tgz", "w:gz") as made:
            made.add(etendue.program(), f"{name}/etendue")
    else:
        (there / f"{name}.tgz").write_bytes(pathlib.Path(archive).read_bytes())
    workflow = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())
    steps = {step["name"]: step for step in workflow["jobs"]["packages"]["steps"] if "name" in step}
    script = steps["Checksums, by which the action knows the archive"]["run"].replace("target/package", os.fspath(there))
    subprocess.run(["bash", "-ec", script], check=True)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=runner.folder / "www")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        runner.server = f"http://127.0.0.1:{server.server_port}"
        yield version, there
        server.shutdown()


def test_a_release_is_downloaded_once_and_verified(runner, release):
    version, there = release
    values = {"SOURCE": os.fspath(ROOT), "REPOSITORY": "some/one", "REF": f"v{version}", "VERSION": version}
    archive = next(there.glob("*.tgz"))
    good = archive.read_bytes()
    archive.write_bytes(good + b"more")
    done = runner.run("The program", **values)
    assert done.returncode != 0 and f"{archive.name}: FAILED" in done.stdout
    archive.write_bytes(good)
    done = runner.run("The program", **values)
    assert done.returncode == 0 and done.stdout.endswith(f"\netendue {version}\n"), done.stderr
    # The second time it is in the cache.
    archive.unlink()
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
    # Quotes hold words together, and nothing is run.
    for arguments, told in [
        ("--filter \"ro om\"", 'contains "ro om"'),
        ("--filter 'r\"m'", 'contains "r"m"'),
        ("--filter $(touch${IFS}ran)`touch${IFS}ran`", "contains"),
        ("--filter 'room", "quote"),
    ]:
        done = runner.run("Golden pictures", SCENES="scenes", ARGUMENTS=arguments)
        assert done.returncode != 0 and told in done.stderr, done.stderr
    assert not (runner.folder / "work/ran").exists()
    assert runner.run("Golden pictures", SCENES="scenes", ARGUMENTS="").returncode == 0
    uploaded = runner.steps["Pages, and films of what failed"]["with"]["path"].split("\n")
    assert all((runner.folder / "work" / path).exists() for path in uploaded if path.startswith("etendue-results"))


def test_a_driver_that_is_there_is_not_installed_again(runner):
    runner.tool("sudo", "echo installed >&2")
    done = runner.run("A software Vulkan driver")
    there = any(pathlib.Path("/usr/share/vulkan/icd.d").glob("*.json"))
    assert done.returncode == 0 and ("installed" in done.stderr) != there
