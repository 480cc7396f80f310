# SPDX-License-Identifier: MIT
"""Snapshots: views without copies that keep their memory, of any number of particles."""
from __future__ import annotations

import copy
import gc
import pickle
from typing import Any

import numpy as np
import pytest

import firn
from conftest import make_scene

PLAIN = {"position": (3, "f4"), "velocity": (3, "f4"), "density": (1, "f4"), "volume0": (1, "f4"), "rotation": (3, "i2"),
         "id": (1, "u4"), "object": (1, "u2")}
STATE = {"F": (9, "f4"), "Jp": (1, "f4"), "J": (1, "f4"), "stress": (9, "f4")}
ALL = {**PLAIN, **STATE}
SIZES = [0, 1, 2, 15, 16, 17, 1000]


def filled(size: int, **state: bool) -> firn.Snapshot:
    snow = firn.Snapshot(size, **state)
    for k, name in enumerate(ALL):
        column = getattr(snow, name)
        if column is not None:
            column[...] = (np.arange(column.size).reshape(column.shape) * 7 + k) % 30000
    return snow


def address(column: Any) -> int:
    return int(column.__array_interface__["data"][0])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ALL)
def test_a_column_is_a_view_of_its_shape_and_type(size: int, name: str) -> None:
    width, dtype = ALL[name]
    snow = firn.Snapshot(size, F=True, Jp=True, J=True, stress=True)
    column = getattr(snow, name)
    assert type(column) is np.ndarray and column.dtype == np.dtype(dtype) and column.flags.writeable
    assert column.shape == ((size,) if width == 1 else (width, size)) and not column.any()
    if size == 0:
        return
    assert column.strides[-1] == column.itemsize and column.strides[0] >= (1 if width == 1 else size) * column.itemsize
    assert address(column) == address(getattr(snow, name)) and column.base is snow and not column.flags.owndata
    column[..., -1] = 5
    assert np.all(getattr(snow, name)[..., -1] == 5) and np.shares_memory(column, getattr(snow, name))


def test_columns_do_not_overlap() -> None:
    snow = firn.Snapshot(17, F=True, Jp=True, J=True, stress=True)
    columns = [getattr(snow, name) for name in ALL]
    for i, one in enumerate(columns):
        for other in columns[:i]:
            assert not np.shares_memory(one, other)


@pytest.mark.parametrize("name", ALL)
def test_a_view_outlives_its_snapshot(name: str) -> None:
    snow = filled(1000, F=True, Jp=True, J=True, stress=True)
    column = getattr(snow, name)
    expected, where = column.copy(), address(column)
    part = column[..., 3:500:7]
    del snow
    gc.collect()
    others = [filled(1000, F=True, Jp=True, J=True, stress=True) for _ in range(3)]
    assert address(column) == where and np.array_equal(column, expected) and len(others) == 3
    del column
    gc.collect()
    assert np.array_equal(part, expected[..., 3:500:7])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ALL)
def test_dlpack_takes_every_column_as_it_lies(size: int, name: str) -> None:
    snow = filled(size, F=True, Jp=True, J=True, stress=True)
    column = getattr(snow, name)
    taken = np.from_dlpack(column)
    assert np.array_equal(taken, column)
    if size:
        assert address(taken) == address(column) and taken.strides == column.strides
    expected = column.copy()
    del snow, column
    gc.collect()
    assert np.array_equal(taken, expected)


@pytest.mark.parametrize("asked", [(), ("F",), ("Jp", "J"), ("stress",), ("F", "Jp", "J", "stress")])
def test_columns_of_the_state_are_there_when_they_are_asked_for(asked: tuple[str, ...]) -> None:
    simulation = firn.Simulation(make_scene())
    for snow in (simulation.snapshot(**{name: True for name in asked}), firn.Snapshot(3, **{name: True for name in asked})):
        assert [name for name in STATE if getattr(snow, name) is not None] == [name for name in STATE if name in asked]


def test_the_state_is_that_of_unstrained_snow_at_the_start() -> None:
    snow = firn.Simulation(make_scene()).snapshot(F=True, Jp=True, J=True, stress=True)
    assert snow.F is not None and snow.J is not None and snow.stress is not None and snow.Jp is not None
    assert np.allclose(snow.F.T.reshape(-1, 3, 3), np.eye(3), atol=1e-6) and np.allclose(snow.J, 1, atol=1e-5)
    assert np.abs(snow.stress).max() < 10 and np.allclose(snow.Jp, 1, atol=1e-5)


@pytest.mark.parametrize("make", [copy.copy, copy.deepcopy, lambda snow: pickle.loads(pickle.dumps(snow))])
@pytest.mark.parametrize("size", [0, 1, 100])
def test_copies_are_equal_and_independent(make: Any, size: int) -> None:
    snow = filled(size, F=True, J=True)
    snow.frame, snow.time, snow.dx, snow.origin = 7, 0.25, 0.5, np.array([1, 2, 3])
    again = make(snow)
    assert (again.frame, again.time, again.dx, again.origin.tolist()) == (7, 0.25, 0.5, [1, 2, 3])
    for name in ALL:
        one, other = getattr(snow, name), getattr(again, name)
        assert (one is None) == (other is None)
        if one is not None:
            assert np.array_equal(one, other) and not np.shares_memory(one, other)
    snow.position[...] = -1
    assert size == 0 or not np.any(again.position == -1)


def test_places_in_the_world() -> None:
    snow = firn.Snapshot(5)
    snow.origin = np.array([1e6, 0, -2])
    snow.position[...] = np.arange(15).reshape(3, 5)
    world = snow.world_positions()
    assert world.shape == (5, 3) and world.dtype == np.float64 and world.flags.owndata
    assert np.array_equal(world, snow.origin + snow.position.T.astype(np.float64))
    assert firn.Snapshot().world_positions().shape == (0, 3)
    with pytest.raises(ValueError):
        snow.origin[0] = 3
    for wrong in ((1, 2), "abc", None):
        with pytest.raises(TypeError):
            snow.origin = wrong  # type: ignore[assignment]


def test_rotations() -> None:
    snow = firn.Snapshot(2)
    assert np.array_equal(snow.rotation_matrix(0), np.eye(3))
    snow.rotation[:, 1] = np.round(np.array([0, 0, 1]) * np.tan(np.pi / 2 / 4) * 32767)
    assert np.allclose(snow.rotation_matrix(1), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-3)
    assert np.array_equal(snow.rotation_matrix(-1), snow.rotation_matrix(1))
    for wrong in (2, -3, 2**40):
        with pytest.raises(IndexError):
            snow.rotation_matrix(wrong)
    with pytest.raises(IndexError):
        firn.Snapshot().rotation_matrix(0)


def test_sizes() -> None:
    assert len(firn.Snapshot()) == firn.Snapshot(0).size == 0 and len(firn.Snapshot(3)) == 3
    assert repr(firn.Snapshot(1)) == "<firn.Snapshot of 1 particle at 0.0 s>"
    with pytest.raises(ValueError):
        firn.Snapshot(-1)
    with pytest.raises((MemoryError, ValueError, TypeError)):
        firn.Snapshot(2**62)
    with pytest.raises(AttributeError):
        firn.Snapshot(3).position = np.zeros((3, 3), np.float32)  # type: ignore[misc]
