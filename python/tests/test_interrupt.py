# SPDX-License-Identifier: MIT
"""Ctrl-C: within two seconds at whatever moment it comes, and what it leaves can be used."""
from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

LIMIT = 2.0  # s
SCENE = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background leaves it ignored
import firn
scene = firn.Scene("big").set("simulation.dx", float(sys.argv[1])).set("ground.friction", 0.4)
scene.add("snow", shape="ball", radius=0.1, center=(0, 0.2, 0), velocity=(0, -2, 0))
scene.add("collider", name="blade", shape="box", size=(0.05, 0.3, 0.3), center=(-0.25, 0.2, 0))
scene.set("time.frames", 400).set("image.width", 320).set("image.height", 240).set("image.samples", int(sys.argv[2]))
scene.set("camera.position", (0, 0.3, 0.6)).set("camera.target", (0, 0.1, 0)).set("output.particles", True)
def interrupted(work):
    print("ready", flush=True)
    try:
        work()
    except KeyboardInterrupt:
        print("interrupted", flush=True)
    else:
        print("never interrupted", flush=True)
"""
ADVANCE = SCENE + """
simulation = firn.Simulation(scene)
interrupted(lambda: simulation.advance_to(1e3))
time_now, particles = simulation.time, len(simulation)
assert simulation.advance_to(time_now + 1e-4) and len(simulation.snapshot()) == particles
"""
STEP = SCENE + """
simulation = firn.Simulation(scene)
def steps():
    while True:
        simulation.step()
interrupted(steps)
assert simulation.step() > 0
"""
DRIVEN = SCENE + """
simulation = firn.Simulation(scene)
simulation.drive("blade", lambda now: (0.01, 0, 0))
interrupted(lambda: simulation.advance_to(1e3))
assert simulation.step() > 0
"""
PROGRESS = SCENE + """
simulation = firn.Simulation(scene)
interrupted(lambda: simulation.advance_to(1e3, progress=True))
assert simulation.step() > 0
"""
CONSTRUCT = SCENE + """
def construct():
    while True:
        firn.Simulation(scene)
interrupted(construct)
assert firn.Simulation(scene.set("simulation.dx", 0.05)).step() > 0
"""
RUN = SCENE + """
interrupted(firn.Session.start(scene, out="run", progress=True).run)
"""
RENDER = SCENE + """
firn.Session.start(scene, out="run", frames=(0, 3), pictures=False, particles=True).run()
interrupted(firn.Session.render("run").run)
"""
ANOTHER = SCENE + """
class Mine(Exception):
    pass
def handler(number, frame):
    raise Mine
signal.signal(signal.SIGINT, handler)
simulation = firn.Simulation(scene)
print("ready", flush=True)
try:
    simulation.advance_to(1e3)
except Mine:
    print("interrupted", flush=True)
"""
NOTHING = SCENE + """
signal.signal(signal.SIGINT, lambda number, frame: print("seen", flush=True))
simulation = firn.Simulation(scene)
print("ready", flush=True)
assert simulation.advance_to(2.0)
print("interrupted", flush=True)
"""


def start(folder: Path, text: str, dx: float, samples: int) -> subprocess.Popen[str]:
    (folder / "script.py").write_text(text)
    process = subprocess.Popen([sys.executable, "-W", "error", "script.py", str(dx), str(samples)], cwd=folder, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout and process.stdout.readline() == "ready\n", process.communicate(timeout=60)
    return process


def interrupt(process: subprocess.Popen[str], delay: float) -> float:
    """Seconds from the signal to the exception."""
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    assert process.stdout and process.stdout.readline() == "interrupted\n", process.communicate(timeout=60)
    return time.monotonic() - began


def finish(process: subprocess.Popen[str]) -> None:
    out, error = process.communicate(timeout=60)
    assert process.returncode == 0, out + error


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.4])
@pytest.mark.parametrize("dx", [0.02, 0.006])
@pytest.mark.parametrize("text", [ADVANCE, STEP, DRIVEN, PROGRESS, CONSTRUCT], ids=["advance", "step", "driven", "progress", "construct"])
def test_simulations_stop_and_can_be_used(tmp_path: Path, text: str, dx: float, delay: float) -> None:
    process = start(tmp_path, text, dx, 1)
    assert interrupt(process, delay) < LIMIT
    finish(process)


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("samples", [1, 16, 4096])
def test_a_run_stops_with_a_checkpoint(tmp_path: Path, samples: int, delay: float) -> None:
    process = start(tmp_path, RUN, 0.02, samples)
    assert interrupt(process, delay) < LIMIT
    finish(process)
    assert json.loads((tmp_path / "run/run.json").read_text())["status"] == "interrupted"


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.3])
def test_a_run_that_was_interrupted_goes_on_to_the_same_bits(tmp_path: Path, delay: float) -> None:
    small = 'scene.set("time.frames", 8).set("image.width", 48).set("image.height", 36)\ninterrupted('
    process = start(tmp_path, RUN.replace("\ninterrupted(", "\n" + small), 0.02, 8)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    finish(process)
    again = "import firn; print(firn.Session.resume('run').run().interrupted)"
    done = subprocess.run([sys.executable, "-c", again], cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert (done.returncode, done.stdout) == (0, "False\n"), done.stderr
    whole = "import firn; firn.Session.start(firn.Scene.read('run/scene.resolved.toml'), out='whole').run()"
    subprocess.run([sys.executable, "-c", whole], cwd=tmp_path, check=True, timeout=100)
    for frame in range(8):
        for name in (f"frames/{frame:04}.png", f"particles/{frame:04}.firn"):
            assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_pictures_of_kept_particles_stop(tmp_path: Path, delay: float) -> None:
    process = start(tmp_path, RENDER, 0.02, 4096)
    assert interrupt(process, delay) < LIMIT
    finish(process)


def test_a_handler_of_the_program_decides(tmp_path: Path) -> None:
    process = start(tmp_path, ANOTHER, 0.02, 1)
    assert interrupt(process, 0.2) < LIMIT
    finish(process)
    process = start(tmp_path, NOTHING, 0.03, 1)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 0 and out.splitlines() in (["seen", "interrupted"], ["interrupted", "seen"]), out + error


@pytest.mark.parametrize("text", [ADVANCE, CONSTRUCT, RUN], ids=["advance", "construct", "run"])
def test_an_interrupt_that_nobody_catches_ends_the_process_as_any_other(tmp_path: Path, text: str) -> None:
    process = start(tmp_path, text.replace("except KeyboardInterrupt", "except LookupError"), 0.006, 64)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, error = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT and "KeyboardInterrupt" in error and time.monotonic() - began < LIMIT
