# SPDX-License-Identifier: MIT
"""Other Python threads run while firn computes; one object is used by one of them at a time."""
from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Callable

import pytest

import firn
from conftest import make_scene


def counted_during(work: Callable[[], Any]) -> tuple[int, float]:
    """How often another thread came round meanwhile, and the seconds that it took."""
    count, done = 0, threading.Event()

    def loop() -> None:
        nonlocal count
        while not done.is_set():
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=loop)
    thread.start()
    began = time.monotonic()
    try:
        work()
    finally:
        took = time.monotonic() - began
        done.set()
        thread.join()
    return count, took


def test_a_thread_counts_while_a_simulation_advances() -> None:
    simulation = firn.Simulation(make_scene(dx=0.008))
    count, took = counted_during(lambda: simulation.advance_to(0.1))
    assert took > 0.1 and count > 50 * took


def test_a_thread_counts_while_pictures_are_made(tmp_path: Path) -> None:
    session = firn.Session.start(make_scene().set("image.width", 200).set("image.height", 150).set("image.samples", 8), out=tmp_path / "run")
    count, took = counted_during(session.run)
    assert count > 50 * took


def test_a_simulation_at_work_is_not_used_by_another_thread() -> None:
    simulation = firn.Simulation(make_scene(dx=0.01))
    stop, refused = threading.Event(), []
    thread = threading.Thread(target=lambda: simulation.advance_to(1e3, stop=stop))
    thread.start()
    time.sleep(0.2)
    uses: list[Callable[[], object]] = [lambda: simulation.time, lambda: len(simulation), simulation.metrics, simulation.snapshot,
                                        simulation.hash, simulation.step, lambda: simulation.advance_to(1), lambda: simulation.remove_snow([1])]
    for use in uses:
        with pytest.raises(firn.UsageError, match="another thread"):
            use()
        refused.append(use)
    stop.set()
    thread.join()
    assert len(refused) == len(uses) and 0 < simulation.time < 1e3


def test_simulations_in_threads_of_their_own_have_their_bits() -> None:
    alone = firn.Simulation(make_scene(balls=2))
    alone.advance_to(0.05)
    hashes: list[int] = []

    def run(threads: int) -> None:
        simulation = firn.Simulation(make_scene(balls=2), threads=threads)
        simulation.advance_to(0.05)
        hashes.append(simulation.hash())

    workers = [threading.Thread(target=run, args=(1 + i % 3,)) for i in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert hashes == [alone.hash()] * 6


def test_a_daemon_thread_at_work_does_not_hold_up_the_end(script: Any) -> None:
    done = script("""
import threading, time, firn
scene = firn.Scene("d").set("simulation.dx", 0.02).set("ground.friction", 0.4)
scene.add("snow", shape="ball", radius=0.1, center=(0, 0.3, 0))
simulation = firn.Simulation(scene)
threading.Thread(target=lambda: simulation.advance_to(1e4), daemon=True).start()
time.sleep(0.3)
""")
    assert done.stderr == ""
