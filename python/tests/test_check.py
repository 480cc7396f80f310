# SPDX-License-Identifier: MIT
"""What a scene will take and show."""
from __future__ import annotations

import pytest

import firn
from conftest import add_blade, make_scene


@pytest.mark.parametrize("balls", [1, 3])
def test_a_report_says_what_a_simulation_has(balls: int) -> None:
    scene = add_blade(make_scene(balls=balls, frames=4))
    report = firn.check_scene(scene, threads=2)
    simulation = firn.Simulation(scene)
    assert report.particles == len(simulation) == sum(snow.particles for snow in report.snow)
    assert report.mass == pytest.approx(simulation.metrics().mass, rel=1e-6)
    assert [snow.name for snow in report.snow] == [f"snow{i}" for i in range(balls)]
    assert report.snow[0].bounds_min[1] == pytest.approx(0.1, abs=0.03) and report.snow[0].volume > 0
    assert report.step.dt == pytest.approx(simulation.step()) and report.step.cause
    assert report.frames == 4 and report.frame_seconds == pytest.approx(0.04) and not report.fixed_dt
    assert 0 < report.steps_per_frame[0] <= report.steps_per_frame[1] and report.steps[0] == 3 * report.steps_per_frame[0]
    seen = sum(s.pixel_fraction for s in report.snow) + sum(o.pixel_fraction for o in report.objects)
    assert seen + report.background_fraction == pytest.approx(1)
    assert {o.name for o in report.objects} == {"the ground", "collider 'blade'"}
    assert report.memory.peak_low <= report.memory.peak_high and report.memory.simulation > 0
    assert report.warnings == () and report.blow_up is None


def test_warnings_name_the_line() -> None:
    scene = make_scene()
    scene.add("snow", name="lost", shape="ball", radius=0.05, center=(0, 3, 0))
    kinds = {warning.kind: warning for warning in firn.check_scene(scene).warnings}
    assert set(kinds) == {"floating", "unseen"}
    assert kinds["floating"].snow == 1 and kinds["floating"].place.startswith("test_check.py:")
    assert "'lost' floats" in kinds["floating"].text


def test_what_is_refused() -> None:
    with pytest.raises(firn.UsageError, match="radius"):
        firn.check_scene(firn.Scene().add("snow", shape="ball", radius=-1, center=(0, 0, 0)))
    with pytest.raises(TypeError, match="firn.Scene"):
        firn.check_scene("scene.toml")  # type: ignore[arg-type]
