# SPDX-License-Identifier: MIT
"""Simulations: their bits, snow that comes and goes, drivers, states, threads."""
from __future__ import annotations

import copy
import gc
import io
import os
import pickle
import struct
import subprocess
import threading
import weakref
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import firn
from conftest import add_blade, make_scene


def particles_of(file: Path) -> dict[str, Any]:
    """A particle file of firn, as docs of its format say."""
    raw = file.read_bytes()
    assert raw[:8] == b"FIRNSNAP"
    (n,) = struct.unpack_from("<Q", raw, 56)
    columns: dict[str, Any] = {"time": struct.unpack_from("<d", raw, 16)[0]}
    at = 72
    for name, width, dtype in [("position", 3, "<f4"), ("velocity", 3, "<f4"), ("density", 1, "<f4"), ("volume0", 1, "<f4"),
                               ("rotation", 3, "<i2"), ("id", 1, "<u4"), ("object", 1, "<u2")]:
        columns[name] = np.frombuffer(raw, dtype, width * n, at).reshape((width, n) if width > 1 else n)
        at += columns[name].nbytes
    return columns


@pytest.mark.parametrize("balls, dx", [(1, 0.03), (2, 0.04), (3, 0.025)])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_the_bits_are_those_of_the_command_line(tmp_path: Path, program: str, balls: int, dx: float, threads: int) -> None:
    scene = make_scene(dx=dx, balls=balls, frames=4)
    (tmp_path / "scene.toml").write_text(scene.toml())
    subprocess.run([program, "simulate", "scene.toml", "--out", "run", "--quiet"], cwd=tmp_path, check=True, capture_output=True)
    simulation = firn.Simulation(scene, threads=threads)
    for frame in range(scene.frames):
        assert simulation.advance_to(scene.frame_time(frame))
        expected, snow = particles_of(tmp_path / f"run/particles/{frame:04}.firn"), simulation.snapshot()
        for name, column in expected.items():
            assert np.array_equal(getattr(snow, name), column), name


def test_threads_do_not_change_bits_and_times_are_met_exactly() -> None:
    hashes = set()
    for threads in (1, 2, 3, 0):
        simulation = firn.Simulation(make_scene(balls=2), threads=threads)
        assert simulation.advance_to(0.05) and simulation.time == 0.05
        dt = simulation.step()
        assert 0 < dt < 0.05 and simulation.time == 0.05 + dt
        hashes.add(simulation.hash())
    assert len(hashes) == 1 and 0 <= hashes.pop() < 2**64


def test_a_time_that_has_passed_does_nothing_and_one_that_is_no_number_is_refused(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    simulation.advance_to(0.01)
    before = simulation.hash()
    assert simulation.advance_to(0.005) and simulation.advance_to(-1) and simulation.advance_to(float(np.float32(0)))
    assert simulation.hash() == before and simulation.time == 0.01
    for wrong in (np.inf, np.nan):
        with pytest.raises(firn.UsageError, match="finite"):
            simulation.advance_to(wrong)
    with pytest.raises(TypeError):
        simulation.advance_to("1")  # type: ignore[arg-type]


def test_metrics_are_of_the_snow(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    simulation.advance_to(0.05)
    m, snow = simulation.metrics(), simulation.snapshot(J=True)
    assert m == simulation.metrics() and m.time == 0.05 and m.particles == len(simulation) == len(snow)
    assert snow.J is not None
    mass = snow.density * snow.volume0 * snow.J
    assert m.mass == pytest.approx(mass.sum(), rel=1e-5)
    assert np.allclose(m.momentum, (mass * snow.velocity).sum(axis=1), rtol=1e-4, atol=1e-6)
    world = snow.world_positions()
    assert np.allclose(m.bounds_min, world.min(axis=0)) and np.allclose(m.bounds_max, world.max(axis=0))
    assert [contact.collider for contact in m.contacts] == ["ground"] and m.contacts[0].force.shape == (3,)
    assert m.step.dt > 0 and m.step.cause and pickle.loads(pickle.dumps(m)) == m
    simulation.step()
    assert m != simulation.metrics() and m != 3
    with pytest.raises(AttributeError):
        m.mass = 1  # type: ignore[misc]


def test_options_are_checked(scene: firn.Scene) -> None:
    with pytest.raises(firn.Error, match="isa|instruction|sse"):
        firn.Simulation(scene, isa="sse9")
    wrongs: list[Any] = ["scene", None, {}]
    for wrong in wrongs:
        with pytest.raises(TypeError):
            firn.Simulation(wrong)
    assert firn.Simulation(scene, threads=1, isa="base").advance_to(0.001)


def test_snow_comes_and_goes(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    count = len(simulation)
    assert simulation.add_snow(shape="ball", radius=0.05, center=(1, 0.2, 0)) == 1
    assert simulation.add_snow({"shape": "ball", "radius": 0.05}, center=np.array([-1, 0.2, 0])) == 2
    snow = simulation.snapshot()
    assert set(snow.object) == {0, 1, 2} and len(set(snow.id)) == len(simulation) > count
    for wrong in ({"shape": "ball", "radius": 0.05, "center": (1, 0.2, 0)}, {"shape": "bal"}, {"shape": "ball", "radius": None}):
        before = simulation.hash()
        with pytest.raises(firn.UsageError, match=r"test_simulation.py:\d+: "):
            simulation.add_snow(wrong)  # type: ignore[arg-type]
        assert simulation.hash() == before
    gone = snow.id[snow.object == 1]
    assert simulation.remove_snow(gone) == len(gone) and simulation.remove_snow(gone) == 0
    assert set(simulation.snapshot().object) == {0, 2}
    simulation.advance_to(0.02)


@pytest.mark.parametrize("kind", [list, tuple, set, np.uint32, np.int64, np.uint8, "strided", "view"])
def test_ids_are_whole_numbers_of_any_kind(scene: firn.Scene, kind: Any) -> None:
    simulation = firn.Simulation(scene)
    count, snow = len(simulation), simulation.snapshot()
    if kind == "view":
        assert simulation.remove_snow(snow.id[:5]) == 5
        return
    ids = np.array([1, 0, 2, 0, 3, 0], np.uint32)[::2] if kind == "strided" else [1, 2, 3] if kind is set else kind([1, 2, 3])
    assert simulation.remove_snow(ids) == 3 and len(simulation) == count - 3
    assert not np.isin([1, 2, 3], simulation.snapshot().id).any()


def test_what_is_no_id_is_refused_and_none_and_all_are_taken(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    count = len(simulation)
    wrongs: list[Any] = [[-1], [2**32], [1.5], [True], ["1"], [[1, 2], [3, 4]], None]
    for wrong in wrongs:
        with pytest.raises(firn.UsageError, match="ids"):
            simulation.remove_snow(wrong)
    assert simulation.remove_snow([]) == 0 and simulation.remove_snow(np.arange(0)) == 0 and len(simulation) == count
    assert simulation.remove_snow(5) == 1
    assert simulation.remove_snow(simulation.snapshot().id) == count - 1 and len(simulation) == 0
    assert simulation.snapshot().position.shape == (3, 0) and simulation.metrics().particles == 0
    assert simulation.advance_to(simulation.time + 0.01)
    simulation.add_snow(shape="ball", radius=0.05, center=(0, 1, 0))
    assert len(simulation) > 0 and simulation.advance_to(simulation.time + 0.01)


@pytest.mark.parametrize("answer", [(0.5, 0, 0), [0.5, 0.0, 0], np.array([0.5, 0, 0], np.float32), firn.ColliderVelocity((0.5, 0, 0)),
                                    firn.ColliderVelocity(linear=np.array([0.5, 0, 0]), angular=[0, 0, 0])])
def test_a_driver_says_the_velocity(answer: Any) -> None:
    simulation = firn.Simulation(add_blade(make_scene()))
    told: list[firn.DrivenCollider] = []

    def driver(now: firn.DrivenCollider) -> Any:
        told.append(now)
        return answer

    simulation.drive("blade", driver)
    simulation.advance_to(0.05)
    assert told[0].dt == 0 and told[0].name == "blade" and np.array_equal(told[0].rotation, np.eye(3))
    assert np.isclose(told[-1].position[0] - told[0].position[0], 0.5 * told[-1].time) and told[-1].velocity[0] == 0.5
    assert len(told) == simulation.metrics().steps


def test_a_driver_turns_a_collider() -> None:
    simulation = firn.Simulation(add_blade(make_scene()))
    told: list[firn.DrivenCollider] = []
    simulation.drive("blade", lambda now: told.append(now) or firn.ColliderVelocity(angular=(0, 0, 2)))  # type: ignore[func-returns-value]
    simulation.advance_to(0.05)
    angle = 2 * told[-1].time
    assert np.allclose(told[-1].rotation[:2, :2], [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_what_a_driver_raises_comes_out_unchanged_and_the_simulation_goes_on() -> None:
    simulation = firn.Simulation(add_blade(make_scene()))
    error = KeyError("mine")
    state = {"fail": True}

    def driver(now: firn.DrivenCollider) -> tuple[float, float, float]:
        if state["fail"] and now.time > 0.01:
            raise error
        return 0, 0, 0

    simulation.drive("blade", driver)
    with pytest.raises(KeyError) as raised:
        simulation.advance_to(0.05)
    assert raised.value is error and raised.value.__traceback__ is not None and 0.01 < simulation.time < 0.05
    with pytest.raises(KeyError):
        simulation.step()
    state["fail"] = False
    assert simulation.advance_to(0.05)


@pytest.mark.parametrize("answer", [None, (1, 2), (1, 2, 3, 4), "abc", 5, [[1, 2, 3]], firn.ColliderVelocity(linear=(1, 2))])
def test_what_is_no_velocity_is_refused(answer: Any) -> None:
    simulation = firn.Simulation(add_blade(make_scene()))
    def driver(now: firn.DrivenCollider) -> Any:
        return answer

    simulation.drive("blade", driver)
    with pytest.raises(firn.UsageError, match="driver of 'blade'"):
        simulation.advance_to(0.05)
    with pytest.raises(firn.Error):
        simulation.drive("blade", lambda now: (np.nan, 0, 0))
        simulation.step()


def test_drivers_look_but_do_not_touch() -> None:
    simulation = firn.Simulation(add_blade(make_scene()))
    seen: list[int] = []

    def driver(now: firn.DrivenCollider) -> tuple[float, float, float]:
        seen.append(len(simulation))
        assert simulation.metrics().time == simulation.time == now.time and simulation.snapshot().size == seen[-1]
        simulation.save(io.BytesIO())
        touches: list[Callable[[], object]] = [simulation.step, lambda: simulation.advance_to(1), lambda: simulation.remove_snow([1])]
        for touch in touches:
            with pytest.raises(firn.UsageError):
                touch()
        return 0, 0, 0

    simulation.drive("blade", driver)
    simulation.advance_to(0.002)
    simulation.step()
    assert len(seen) >= 2


def test_wrong_drivers_are_refused(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    with pytest.raises(firn.UsageError, match="no collider 'blade'"):
        simulation.drive("blade", lambda now: (0, 0, 0))
    with pytest.raises(TypeError):
        simulation.drive("ground", 3)  # type: ignore[arg-type]


def test_a_driver_that_holds_its_simulation_is_collected() -> None:
    simulation = firn.Simulation(add_blade(make_scene()))

    class Driver:
        def __init__(self, owner: firn.Simulation) -> None:
            self.owner = owner

        def __call__(self, now: firn.DrivenCollider) -> tuple[float, float, float]:
            return 0, 0, 0

    simulation.drive("blade", Driver(simulation))
    simulation.step()
    gone = weakref.ref(simulation)
    del simulation
    gc.collect()
    assert gone() is None


def test_a_saved_simulation_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    simulation = firn.Simulation(add_blade(make_scene(balls=2)))
    simulation.drive("blade", lambda now: (0.3, 0, 0))
    simulation.add_snow(shape="ball", radius=0.05, center=(0, 0.6, 0))
    simulation.advance_to(0.02)
    memory = io.BytesIO()
    places: list[Any] = [tmp_path / "a", str(tmp_path / "b"), memory]
    for place in places:
        simulation.save(place)
    memory.seek(0)
    simulation.advance_to(0.04)
    for place in places:
        again = firn.Simulation.load(place, threads=1)
        assert again.time == 0.02
        with pytest.raises(firn.UsageError, match="driver"):
            again.advance_to(0.04)
        again.drive("blade", lambda now: (0.3, 0, 0))
        again.advance_to(0.04)
        assert again.hash() == simulation.hash()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


def test_what_was_not_saved_is_not_loaded(tmp_path: Path, scene: firn.Scene) -> None:
    state = io.BytesIO()
    firn.Simulation(scene).save(state)
    raw = state.getvalue()
    for wrong in (b"", b"FIRNSIMU", b"something else", raw[:-1], raw[:100], raw[:500] + b"x" + raw[501:], raw + b"x"):
        with pytest.raises(firn.FileError):
            firn.Simulation.load(io.BytesIO(wrong))
    with pytest.raises(firn.FileError, match="none"):
        firn.Simulation.load(tmp_path / "none")
    with pytest.raises(firn.FileError, match="no/file"):
        firn.Simulation(scene).save(tmp_path / "no/file")
    with pytest.raises(TypeError, match="binary"):
        firn.Simulation.load(io.StringIO("a"))  # type: ignore[arg-type]


def test_simulations_are_not_copied(scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    for way in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="save"):
            way(simulation)  # type: ignore[operator]


def test_progress_is_told_and_can_stop_it() -> None:
    simulation = firn.Simulation(make_scene(dx=0.01))
    times: list[float] = []
    simulation.advance_to(0.5, progress=times.append)
    assert times == sorted(times) and all(0 <= t <= 0.5 for t in times) and simulation.time == 0.5

    def fail(now: float) -> None:
        raise LookupError(str(now))

    with pytest.raises(LookupError):
        simulation.advance_to(100, progress=fail)
    assert 0.5 <= simulation.time < 100
    with pytest.raises(TypeError):
        simulation.advance_to(200, progress="bar")


def test_an_event_stops_it_and_the_bits_are_those_of_one_way() -> None:
    one, other = firn.Simulation(make_scene(dx=0.012)), firn.Simulation(make_scene(dx=0.012))
    stop = threading.Event()
    timer = threading.Timer(0.15, stop.set)
    timer.start()
    reached = one.advance_to(0.5, stop=stop)
    timer.join()
    assert stop.is_set() and (reached or one.time < 0.5)
    assert one.advance_to(0.5) and other.advance_to(0.5) and one.hash() == other.hash()
    assert one.advance_to(0.6, stop=threading.Event())


def test_bars_are_drawn_where_they_are_wanted(capsys: pytest.CaptureFixture[str], scene: firn.Scene) -> None:
    simulation = firn.Simulation(scene)
    simulation.advance_to(0.01, progress="auto")
    simulation.advance_to(0.02)
    assert capsys.readouterr() == ("", "")
    simulation.advance_to(0.03, progress=True)
    out, error = capsys.readouterr()
    assert out == "" and "100" in error and "firn" in error


class Raw:
    """A raw file: it takes and gives little at a time."""

    def __init__(self, most: int = 10**9) -> None:
        self.bytes, self.at, self.most = b"", 0, most

    def write(self, data: bytes) -> int:
        took = bytes(data[: min(1000, self.most - len(self.bytes))])
        self.bytes += took
        return len(took)

    def read(self) -> bytes:
        self.at += 700
        return self.bytes[self.at - 700 : self.at]


def test_raw_files_are_written_and_read_whole_or_not_at_all(tmp_path: Path) -> None:
    simulation = firn.Simulation(make_scene())
    file = Raw()
    simulation.save(file)  # type: ignore[arg-type]
    assert firn.Simulation.load(file).hash() == simulation.hash()  # type: ignore[arg-type]
    with pytest.raises(firn.FileError, match="takes no more"):
        simulation.save(Raw(5000))  # type: ignore[arg-type]
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(firn.FileError, match="no regular file"):
        simulation.save(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "state")
    simulation.save(tmp_path / "link")
    assert (tmp_path / "link").is_symlink() and firn.Simulation.load(tmp_path / "state").hash() == simulation.hash()


def test_a_stop_that_is_asked_for_before_counts() -> None:
    stop = threading.Event()
    stop.set()
    simulation = firn.Simulation(make_scene())
    assert simulation.advance_to(0.001, stop=stop) is False and simulation.time == 0
    with pytest.raises(AttributeError):
        simulation.advance_to(0.001, stop=3)  # type: ignore[arg-type]
