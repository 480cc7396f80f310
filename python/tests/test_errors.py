# SPDX-License-Identifier: MIT
"""The exceptions: their classes, their pickles."""
from __future__ import annotations

import copy
import pickle

import pytest

import firn


@pytest.mark.parametrize("kind, base, code", [(firn.UsageError, ValueError, "usage"), (firn.FileError, OSError, "io"),
                                              (firn.UnstableError, ArithmeticError, "unstable"), (firn.Error, Exception, "failed")])
def test_classes_have_pythons_own_beside_them(kind: type[firn.Error], base: type[Exception], code: str) -> None:
    assert issubclass(kind, firn.Error) and issubclass(kind, base)
    error = kind("a: b")
    assert (str(error), error.code, error.where) == ("a: b", code, "")


def test_pickles_and_copies_keep_everything() -> None:
    with pytest.raises(firn.UsageError) as raised:
        firn.Scene().set("imge", 1)
    for again in (pickle.loads(pickle.dumps(raised.value)), copy.copy(raised.value)):
        assert type(again) is firn.UsageError
        assert (str(again), again.code, again.where) == (str(raised.value), "usage", raised.value.where)


def test_a_simulation_that_blows_up_says_so() -> None:
    scene = firn.Scene().set("simulation.dx", 0.03).set("simulation.dt", 0.05)
    scene.add("snow", shape="ball", radius=0.1, center=(0, 0.1, 0), velocity=(0, -30, 0), young_modulus=1e7)
    scene.set("ground.friction", 0.3)
    with pytest.raises(firn.UsageError):
        firn.Simulation(scene)
    simulation = firn.Simulation(scene, force=True)
    with pytest.raises(firn.UnstableError) as raised:
        simulation.advance_to(10)
    assert raised.value.code == "unstable" and isinstance(raised.value, ArithmeticError)


def test_the_version_is_that_of_the_library() -> None:
    assert firn.__version__.count(".") == 2 and isinstance(firn.__revision__, str)
