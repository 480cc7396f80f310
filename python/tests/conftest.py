# SPDX-License-Identifier: MIT
"""What the tests of the package share: small scenes, the program `firn`, and scripts in processes of their own."""
from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import firn

ROOT = Path(__file__).resolve().parents[2]


def make_scene(dx: float = 0.03, balls: int = 1, frames: int = 3) -> firn.Scene:
    """Snowballs above a ground, seen by a small camera."""
    scene = firn.Scene("small").set("simulation.dx", dx).set("ground.friction", 0.4)
    for ball in range(balls):
        preset = ("fresh", "packed", "powder")[ball % 3]
        scene.add("snow", shape="ball", radius=0.1, center=(0.3 * ball, 0.2, 0), velocity=(0, -2, 0), preset=preset)
    scene.set("time.frames", frames).set("time.fps", 25)
    scene.set("image.width", 32).set("image.height", 24).set("image.samples", 2)
    return scene.set("camera.position", (0, 0.4, 1.5)).set("camera.target", (0, 0.1, 0))


def add_blade(scene: firn.Scene, name: str = "blade") -> firn.Scene:
    """A plate that a program may drive."""
    return scene.add("collider", name=name, shape="box", size=(0.05, 0.3, 0.3), center=(-0.25, 0.2, 0))


@pytest.fixture
def scene() -> firn.Scene:
    return make_scene()


@pytest.fixture
def program() -> str:
    """The command line of the same build."""
    path = os.environ.get("FIRN_PROGRAM", "")
    if not path:
        pytest.skip("FIRN_PROGRAM does not name the program firn")
    return path


Script = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def script(tmp_path: Path) -> Script:
    """Runs a text as a Python program in a folder of its own."""

    def run(text: str, *arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        file = tmp_path / "script.py"
        file.write_text(text)
        words = [sys.executable, "-W", "error", str(file), *arguments]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert not check or done.returncode == 0, done.stdout + done.stderr
        return done

    return run
