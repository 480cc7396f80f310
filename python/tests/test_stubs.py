# SPDX-License-Identifier: MIT
"""Every public name has its words and its types, and the types are those of what runs."""
from __future__ import annotations

import inspect
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import firn
from conftest import ROOT


def public() -> list[tuple[str, Any]]:
    names: list[tuple[str, Any]] = [("firn", firn)]
    for name in firn.__all__:
        thing = getattr(firn, name)
        names.append((name, thing))
        for inner, member in vars(thing).items():
            if not inner.startswith("_") and (callable(member) or isinstance(member, (property, classmethod, staticmethod))):
                names.append((f"{name}.{inner}", getattr(thing, inner)))
    return names


@pytest.mark.parametrize("name, thing", public(), ids=[name for name, _ in public()])
def test_every_public_name_says_what_it_is(name: str, thing: Any) -> None:
    words = thing.__doc__ or ""
    if name.split(".")[-1] in {"message", "made_folders", "frames_begin", "frames_end", "stage_begins", "stage_ends"}:
        words = inspect.getdoc(getattr(firn.Observer, name.split(".")[-1])) or ""
    assert len(words.strip()) > 10, f"{name}: {words!r}"


def test_names_are_those_of_the_package() -> None:
    for name in firn.__all__:
        assert getattr(firn, name).__module__ == "firn", name


def mypy(*words: str) -> None:
    if shutil.which("mypy") is None and subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode != 0:
        pytest.skip("mypy is not installed: types are not checked")
    done = subprocess.run([sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_is_content_with_the_examples_the_tests_and_the_package(tmp_path: Path) -> None:
    cache = f"--cache-dir={tmp_path}"
    for example in sorted((ROOT / "examples/python").glob("*.py")):
        mypy("mypy", "--strict", cache, str(example))
    mypy("mypy", "--strict", cache, *map(str, sorted((ROOT / "python/tests").glob("*.py"))))
    mypy("mypy", "--strict", cache, "-p", "firn")


def test_the_stubs_are_those_of_what_runs() -> None:
    mypy("mypy.stubtest", "firn._core", "--allowlist", str(ROOT / "python/tests/stubtest_allowed.txt"))
