# SPDX-License-Identifier: MIT
"""Colliders that a program drives in a session."""
from __future__ import annotations

import gc
from pathlib import Path

import pytest

import firn
from conftest import add_blade, make_scene


def push(now: firn.DrivenCollider) -> firn.ColliderVelocity:
    return firn.ColliderVelocity((1 + 10 * now.time, 0, 0), (0, 5, 0))


def scene() -> firn.Scene:
    return add_blade(make_scene(frames=6)).set("output.formats", ["pfm"]).set("output.checkpoint_every", 2)


def files(run: Path) -> list[bytes]:
    return [path.read_bytes() for path in sorted(run.glob("frames/*")) + sorted(run.glob("particles/*"))]


class Stopper(firn.Observer):
    def __init__(self, frame: int) -> None:
        self.frame, self.stop = frame, __import__("threading").Event()

    def stage_ends(self, stage: str, frame: int) -> None:
        if stage == "write" and frame == self.frame:
            self.stop.set()


@pytest.mark.parametrize("frame", [0, 2, 4])
def test_a_run_goes_on_when_it_is_driven_again(tmp_path: Path, frame: int) -> None:
    whole = firn.Session.start(scene(), out=tmp_path / "whole", particles=True)
    whole.drive("blade", push)
    whole.run()
    del whole
    stopper = Stopper(frame)
    session = firn.Session.start(scene(), out=tmp_path / "run", particles=True, observer=stopper)
    session.drive("blade", push)
    result = session.run(stop=stopper.stop)
    del session
    gc.collect()
    if result.interrupted:
        with pytest.raises(firn.UsageError, match="drives collider 'blade'"):
            firn.Session.resume(tmp_path / "run").run()
        again = firn.Session.resume(tmp_path / "run")
        again.drive("blade", push)
        again.run()
    assert files(tmp_path / "run") == files(tmp_path / "whole") and len(files(tmp_path / "run")) == 12


def test_what_a_driver_raises_comes_out_of_run(tmp_path: Path) -> None:
    class Lost(Exception):
        pass

    def fail(now: firn.DrivenCollider) -> firn.ColliderVelocity:
        if now.time > 0.05:
            raise Lost("nowhere")
        return firn.ColliderVelocity()

    session = firn.Session.start(scene(), out=tmp_path / "run")
    session.drive("blade", fail)
    with pytest.raises(Lost, match="nowhere"):
        session.run()


def test_what_may_be_driven(tmp_path: Path) -> None:
    session = firn.Session.start(scene(), out=tmp_path / "run")
    with pytest.raises(firn.UsageError, match="ground, blade"):
        session.drive("blad", push)
    with pytest.raises(TypeError, match="a driver is a function"):
        session.drive("blade", 3)  # type: ignore[arg-type]
    session.drive("blade", lambda now: (0, 0, 0))
    session.run()
    with pytest.raises(firn.UsageError, match="has run already"):
        session.drive("blade", push)


def test_a_session_is_not_run_within_itself(tmp_path: Path) -> None:
    session = firn.Session.start(scene(), out=tmp_path / "run")
    said: list[str] = []

    def nested(now: firn.DrivenCollider) -> firn.ColliderVelocity:
        try:
            session.run()
        except firn.UsageError as error:
            said.append(str(error))
        return firn.ColliderVelocity()

    session.drive("blade", nested)
    assert not session.run().interrupted
    assert said and "from within" in said[0]


def test_options_that_no_session_has(tmp_path: Path) -> None:
    for threads in (1.5, None, "a", True):
        with pytest.raises(TypeError, match="threads"):
            firn.Session.start(scene(), out=tmp_path / "run", threads=threads)  # type: ignore[arg-type]
    for options in ({"threads": 2**40}, {"threads": -1}, {"frames": 2**40}):
        with pytest.raises(firn.UsageError):
            firn.Session.start(scene(), out=tmp_path / "run", **options)  # type: ignore[arg-type]
    with pytest.raises(firn.UsageError, match="folder"):
        firn.Session.start(scene(), out="")
    with pytest.raises(ValueError, match="NUL"):
        firn.Session.start(scene(), out="a\0b")
    with pytest.raises(firn.UsageError, match="NUL"):
        scene().set("snow[0].name", "a\0b")
    with pytest.raises(firn.UsageError, match="test_drivers.py:"):
        firn.Scene("a b").check()
