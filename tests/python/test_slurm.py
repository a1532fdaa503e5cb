"""What scripts/slurm/render.sh refuses before it submits anything, with a stand-in for sbatch."""

import os
import subprocess

import pytest

import etendue
from conftest import ROOT
from etendue._scene import dumps


@pytest.fixture
def submit(tmp_path, room):
    """Runs the script with these arguments behind the scene and the folder OUT."""
    (tmp_path / "sbatch").write_text('#!/bin/sh\necho "$@" >>submitted\necho 17\n')
    (tmp_path / "sbatch").chmod(0o755)
    (tmp_path / "room.toml").write_text(dumps(room))

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        env = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "ETENDUE": os.fspath(etendue.program())}
        script = ROOT / "scripts/slurm/render.sh"
        (tmp_path / "submitted").unlink(missing_ok=True)
        return subprocess.run([script, "room.toml", "out", *arguments], cwd=tmp_path, env=env, capture_output=True, text=True)

    return run


def test_good_commands_are_submitted(submit, tmp_path):
    done = submit("2", "1024", "--time=1:00", "--", "--size", "32x24")
    assert (done.returncode, done.stdout) == (0, "array 17, merge 17\n"), done.stderr
    array, merge = (tmp_path / "submitted").read_text().splitlines()
    assert "--array=0-1" in array and array.endswith("--size 32x24") and "--time=1:00" in array and "--merge" in merge


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["2", "1024", "--", "--siez", "32x24"], "unexpected argument '--siez'"),
        (["2", "1024", "--", "--size", "32y24"], "invalid value '32y24'"),
        (["2", "1024", "--", "--spp", "5"], "--spp can't be a RENDER FLAG"),
        (["2", "256"], "256 samples are 1 block of 256: too few for 2 tasks"),
        (["4", "512"], "512 samples are 2 blocks of 256: too few for 4 tasks"),
    ],
)
def test_what_every_task_would_refuse_is_refused_at_once(submit, tmp_path, arguments, told):
    done = submit(*arguments)
    assert done.returncode == 2 and told in done.stderr
    assert not (tmp_path / "submitted").exists() and not (tmp_path / "out").exists()


def test_a_folder_holds_one_division(submit, tmp_path):
    assert submit("2", "1024").returncode == 0
    (tmp_path / "out/parts/00000000-00000512.npz").touch()
    assert submit("2", "1024").returncode == 0
    for tasks, samples in [("4", "1024"), ("2", "2048")]:
        done = submit(tasks, samples)
        assert done.returncode == 2 and "00000000-00000512.npz is not a part of" in done.stderr
