# SPDX-License-Identifier: MIT
"""The examples and the notebook, each run in a folder of its own."""
from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT, make_scene

EXAMPLES = ROOT / "examples/python"


def run(folder: Path, name: str, *arguments: str) -> str:
    words = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and done.stderr == "", done.stdout + done.stderr
    return done.stdout


def test_a_scene(tmp_path: Path) -> None:
    assert run(tmp_path, "scene.py", "made") == "5 frames in made\n"
    assert len(list((tmp_path / "made/frames").glob("*.png"))) == 5


def test_a_ball_falls(tmp_path: Path) -> None:
    rows = [line.split() for line in run(tmp_path, "falling_ball.py").splitlines()[1:]]
    assert len(rows) == 13 and float(rows[-1][1]) < 0.2


def test_particles(tmp_path: Path) -> None:
    said = run(tmp_path, "particles.py")
    assert re.search(r"densest \d{3}\.\d kg/m\^3, mean pressure \d+\.\d Pa", said)


def test_snow_holds_a_blade_back(tmp_path: Path) -> None:
    rows = [[float(word) for word in line.split()] for line in run(tmp_path, "driven_blade.py").splitlines()[1:]]
    assert len(rows) == 10 and sum(row[3] for row in rows) / len(rows) < -50 and rows[-1][2] < 400 / 20 * 0.3


def test_snow_comes_and_goes(tmp_path: Path) -> None:
    assert re.fullmatch(r"(\S+ s: \d+ particles, \d+ taken out, \S+ kg\n){4}", run(tmp_path, "snow_comes_and_goes.py"))


def test_points_of_others(tmp_path: Path) -> None:
    said = run(tmp_path, "points.py", "heart.png")
    assert "points, (240, 240, 3) float32, brightest" in said and (tmp_path / "heart.png").read_bytes()[:4] == b"\x89PNG"


def test_a_session_is_stopped_and_gone_on_with(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(make_scene(frames=5).toml() + "\n[quick.image]\nsamples = 4\n")
    said = run(tmp_path, "session.py", "scene.toml", "run", "2")
    assert said.endswith("complete\n") and "traced frame 0" in said
    done = subprocess.run([sys.executable, str(EXAMPLES / "session.py"), "no.toml", "run"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "no.toml" in done.stderr and "Traceback" not in done.stderr


def test_every_example_is_run_here_and_short() -> None:
    here = Path(__file__).read_text()
    for example in sorted(EXAMPLES.glob("*.py")):
        assert f'"{example.name}"' in here and len(example.read_text().splitlines()) <= 60, example.name


def test_the_notebook(tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed: the notebook is not run")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: the notebook is not run")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed: the notebook is not run")
    spec = tmp_path / "kernels/python3"
    spec.mkdir(parents=True)
    # This interpreter, whatever kernels the machine has.
    (spec / "kernel.json").write_text(
        '{"argv": ["%s", "-m", "ipykernel_launcher", "-f", "{connection_file}"], "display_name": "Python 3", "language": "python"}'
        % sys.executable)
    os.environ["JUPYTER_PATH"] = str(tmp_path)
    notebook = nbformat.read(EXAMPLES / "firn.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = str([cell.outputs for cell in notebook.cells if cell.cell_type == "code"])
    assert "cell:" in said and "radius" in said and "image/png" in said and "mean pressure" in said


def test_the_notebook_is_kept_without_outputs() -> None:
    text = (EXAMPLES / "firn.ipynb").read_text()
    assert '"outputs": []' in text and "image/png" not in text and "SPDX-License-Identifier: MIT" in text
