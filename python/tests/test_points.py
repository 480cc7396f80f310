# SPDX-License-Identifier: MIT
"""Points of other programs: as arrays of any type and layout, and as files."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import firn

SPACING = 0.01


def ball(radius: float = 0.05) -> npt.NDArray[np.float64]:
    axis = np.arange(-radius, radius, SPACING)
    grid: npt.NDArray[np.float64] = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    inside: npt.NDArray[np.float64] = grid[np.linalg.norm(grid, axis=1) < radius] + np.array((0, 0.2, 0))
    return inside


def bare() -> firn.Scene:
    return firn.Scene("points").set("ground.friction", 0.5).set("simulation.dx", 0.02)


def hash_of(scene: firn.Scene) -> int:
    simulation = firn.Simulation(scene)
    simulation.advance_to(0.02)
    return simulation.hash()


def test_arrays_are_the_snow_of_numpys_own_archive(tmp_path: Path) -> None:
    x = ball()
    wave = np.sin(np.arange(len(x)))
    F = np.tile(np.eye(3), (len(x), 1, 1))
    F[:, 0, 1] = np.float32(0.002 * wave)
    columns = dict(position=x, velocity=np.stack([wave, -2 + wave, 0 * wave], 1), volume=1e-6 * (1 + 0.1 * wave),
                   Jp=1 + 0.001 * wave, F=F)
    np.savez(tmp_path / "p.npz", **columns)
    of_file = bare().add("snow", shape="particles", file=tmp_path / "p.npz", offset=(0.1, 0, 0))
    assert hash_of(bare().add_points(**columns, offset=(0.1, 0, 0))) == hash_of(of_file)
    firn.write_points(tmp_path / "q.npz", **columns)
    again = firn.read_points(tmp_path / "q.npz")
    assert set(again) == set(columns)
    for name, values in columns.items():
        assert np.array_equal(again[name], values), name
        assert np.array_equal(np.load(tmp_path / "q.npz")[name], values), name
    assert hash_of(bare().add_points(**again, offset=(0.1, 0, 0))) == hash_of(of_file)


@pytest.mark.parametrize("dtype", ["f4", "f8", ">f4", ">f8", "i2", "i4", "u1"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_type_and_layout(dtype: str, order: str) -> None:
    whole = np.array([[x, y, z] for x in range(6) for y in range(6) for z in range(6)])
    given = np.array(whole, dtype=dtype, order=order)  # type: ignore[call-overload]
    expected = hash_of(bare().add_points(whole.astype(float), scale=0.01, offset=(0, 0.2, 0)))
    assert hash_of(bare().add_points(given, scale=0.01, offset=(0, 0.2, 0))) == expected
    assert hash_of(bare().add_points(given.tolist(), scale=0.01, offset=(0, 0.2, 0))) == expected
    strided = np.zeros((2 * len(given), 5), dtype=dtype)
    strided[::2, 1:4] = given
    assert hash_of(bare().add_points(strided[::2, 1:4], scale=0.01, offset=(0, 0.2, 0))) == expected


def test_a_snapshot_comes_back_as_points() -> None:
    simulation = firn.Simulation(bare().add_points(ball(), volume=SPACING**3))
    snow = simulation.snapshot()
    again = firn.Simulation(bare().add_points(snow.world_positions(), velocity=snow.velocity.T, volume=snow.volume0))
    assert len(again) == len(simulation)
    assert again.metrics().mass == pytest.approx(simulation.metrics().mass, rel=1e-5)


@pytest.mark.parametrize("columns, message", [
    (dict(position=np.zeros((0, 3))), "no points"),
    (dict(position=ball().T), "transpose"),
    (dict(position=ball()[:, :2]), r"expected \(N, 3\)"),
    (dict(position=ball().ravel()), r"expected \(N, 3\)"),
    (dict(position=ball() + np.nan), "not finite"),
    (dict(position=ball(), velocity=ball()[1:]), "'velocity' has the shape"),
    (dict(position=ball(), volume=np.ones((len(ball()), 1))), "'volume' has the shape"),
    (dict(position=ball(), volume=-1), "volume"),
    (dict(position=ball(), F=np.eye(3)), "'F' has the shape"),
    (dict(position=ball().astype(complex)), "expected numbers"),
    (dict(position=ball(), mass="heavy"), "expected numbers"),
    (dict(position=ball(), shape="ball"), "given twice"),
])
def test_points_that_cannot_be_snow_name_the_line(columns: dict[str, object], message: str) -> None:
    scene = bare()
    with pytest.raises(firn.UsageError, match=message) as raised:
        scene.add_points(**columns)  # type: ignore[arg-type]
    assert raised.value.where.startswith("test_points.py:")
    assert len(firn.Simulation(scene.add_points(ball()))) == len(ball())  # nothing was left behind


def test_points_come_into_a_simulation_that_is_under_way() -> None:
    simulation = firn.Simulation(bare().add("snow", shape="box", size=(0.2, 0.1, 0.2), center=(0, 0.05, 0)))
    simulation.advance_to(0.01)
    before = len(simulation)
    assert simulation.add_points(ball(), volume=SPACING**3, name="ball", velocity=None) == 1
    assert len(simulation) == before + len(ball())
    picture = firn.Renderer(simulation.scene.set("image.width", 16).set("image.height", 16)).render(simulation.snapshot())
    assert np.isfinite(picture.rgb).all()
    with pytest.raises(firn.UsageError, match="start inside snow"):
        simulation.add_points(ball())


def test_a_session_needs_a_file(tmp_path: Path) -> None:
    with pytest.raises(firn.UsageError, match="made of arrays"):
        firn.Session.start(bare().add_points(ball()), out=tmp_path / "run")
    with pytest.raises(firn.FileError):
        firn.read_points(tmp_path / "none.npz")
