"""The examples in docstrings, in docs/python.md, and in the notebook run and say what they say."""

import doctest
import importlib
import os
import pkgutil

import pytest

import etendue
from conftest import ROOT

MODULES = ["etendue", *(f"etendue.{m.name}" for m in pkgutil.iter_modules(etendue.__path__))]


@pytest.mark.parametrize("name", MODULES)
def test_docstrings(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = doctest.testfile(os.fspath(ROOT / "docs/python.md"), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert done.attempted > 10 and done.failed == 0


def test_the_notebook(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(ROOT / "examples/first_picture.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": os.fspath(tmp_path)}}).execute()
    shown = [o for cell in notebook.cells for o in cell.get("outputs", [])]
    assert any("image/png" in o.get("data", {}) for o in shown)
    assert not any(o["output_type"] == "error" for o in shown)
