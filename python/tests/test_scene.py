# SPDX-License-Identifier: MIT
"""Scenes: values of all types, errors with their places, files."""
from __future__ import annotations

import copy
import inspect
import math
import pickle
from fractions import Fraction
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import firn
from conftest import make_scene

NUMBERS = [np.int8, np.int16, np.int32, np.int64, np.uint8, np.uint16, np.uint32, np.uint64, np.float16, np.float32, np.float64,
           np.longdouble, int, float, Fraction]


def width_of(scene: firn.Scene) -> str:
    return next(line for line in scene.toml().splitlines() if line.startswith("width"))


def here() -> int:
    frame = inspect.currentframe()
    assert frame and frame.f_back
    return frame.f_back.f_lineno


@pytest.mark.parametrize("kind", NUMBERS)
def test_a_number_of_any_type_is_that_number(scene: firn.Scene, kind: Any) -> None:
    scene.set("snow.young_modulus", kind(64)).set("camera.position", [kind(1), kind(2), kind(3)])
    text = scene.toml()
    assert "young_modulus = 64.0" in text and "position = [1.0, 2.0, 3.0]" in text


@pytest.mark.parametrize("kind", [k for k in NUMBERS if k not in (float, Fraction) and not issubclass(k, np.floating)])
def test_whole_numbers_stay_whole(scene: firn.Scene, kind: Any) -> None:
    assert width_of(scene.set("image.width", kind(64))) == "width = 64"


@pytest.mark.parametrize("dtype", ["i1", "u2", "i8", "f2", "f4", "f8", ">f4", ">i2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_are_sequences(scene: firn.Scene, dtype: str, order: Any) -> None:
    array = np.array([[1, 2, 3], [4, 5, 6]], dtype=dtype, order=order)
    scene.set("camera.position", array[1]).set("camera.target", array[:, ::-1][0])
    assert "position = [4.0, 5.0, 6.0]" in scene.toml() and "target = [3.0, 2.0, 1.0]" in scene.toml()


@pytest.mark.parametrize("value", [True, False, np.bool_(True), np.bool_(False), np.array(True)])
def test_truths(scene: firn.Scene, value: Any) -> None:
    scene.set("snow.trim", value)
    assert f"trim = {str(bool(value)).lower()}" in scene.toml()


def test_zero_dimensional_arrays_and_ranges_and_paths(scene: firn.Scene) -> None:
    scene.set("image.width", np.array(48)).set("camera.target", range(3)).set("name", np.str_("a_b"))
    assert width_of(scene) == "width = 48" and "target = [0.0, 1.0, 2.0]" in scene.toml() and 'name = "a_b"' in scene.toml()
    scene.add("collider", shape="mesh", file=Path("no such.obj"))
    with pytest.raises(firn.Error, match="no such.obj"):
        firn.Simulation(scene)


@pytest.mark.parametrize("value", [None, b"64", bytearray(b"a"), 1j, {1, 2}, object(), np.array([1j]), np.datetime64("2020-01-01"),
                                   len, (n for n in range(3)), [[None]], {"a": None}, {1: 2}, 2**63, np.uint64(2**64 - 1), -2**63 - 1,
                                   "\ud800"])
def test_what_no_key_can_have_is_refused_at_once(scene: firn.Scene, value: Any) -> None:
    before = scene.toml()
    line = here() + 2
    with pytest.raises(firn.UsageError) as raised:
        scene.set("image.width", value)
    assert raised.value.where == f"test_scene.py:{line}" and str(raised.value).startswith(raised.value.where + ": ")
    assert scene.toml() == before


def test_a_list_in_itself_is_refused(scene: firn.Scene) -> None:
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(firn.UsageError, match="deep"):
        scene.set("image.width", endless)


@pytest.mark.parametrize("path, value, what", [
    ("image.width", -5, "'width' is -5, out of range"),
    ("image.width", "wide", "width"),
    ("image.width", 1.5, "width"),
    ("camera.position", [1, 2], "position"),
    ("camera.position", math.nan, "position"),
    ("snow.radius", -1, "'radius' is -1"),
    ("snow[0].radius", math.inf, "radius"),
])
def test_wrong_values_come_out_of_check_with_the_line_that_gave_them(scene: firn.Scene, path: str, value: Any, what: str) -> None:
    scene.set(path, value); line = here()  # noqa: E702
    uses: list[Callable[[], object]] = [scene.check, scene.toml, lambda: scene.frames, lambda: firn.Simulation(scene)]
    for use in uses:
        with pytest.raises(firn.UsageError) as raised:
            use()
        assert raised.value.where == f"test_scene.py:{line}" and what in str(raised.value)


def test_wrong_keys_name_the_place_and_the_nearest_key(scene: firn.Scene) -> None:
    with pytest.raises(firn.UsageError, match=r"test_scene.py:\d+: .*imge.*image"):
        scene.set("imge.width", 1)
    with pytest.raises(firn.UsageError, match=r"test_scene.py:\d+: "):
        scene.add("snwo", shape="ball")
    scene.add("snow", shape="ball", radus=0.1, center=(0, 5, 0))
    with pytest.raises(firn.UsageError, match=r"test_scene.py:\d+: .*'radus'.*'radius'"):
        scene.check()


def test_keys_are_given_as_arguments_or_a_dict_or_both_but_once() -> None:
    texts = set()
    for way in range(3):
        scene = firn.Scene()
        if way == 0:
            scene.add("snow", shape="ball", radius=0.1, center=(0, 1, 0))
        if way == 1:
            scene.add("snow", {"shape": "ball", "radius": 0.1, "center": (0, 1, 0)})
        if way == 2:
            scene.add("snow", {"shape": "ball"}, radius=0.1, center=(0, 1, 0))
        texts.add(scene.toml())
    assert len(texts) == 1
    with pytest.raises(firn.UsageError, match="'shape' is given twice"):
        firn.Scene().add("snow", {"shape": "ball"}, shape="ball")
    with pytest.raises(firn.UsageError, match="dict"):
        firn.Scene().add("snow", [("shape", "ball")])  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        firn.Scene().add()  # type: ignore[call-arg]


def test_a_scene_reads_back_what_it_tells(scene: firn.Scene) -> None:
    assert firn.Scene.parse(scene.toml()).toml() == scene.toml()
    assert firn.Scene.parse(scene.toml()).frames == scene.frames == 3
    assert scene.frame_time(2) == pytest.approx(2 / 25)


def test_files_their_small_size_and_overrides(tmp_path: Path, scene: firn.Scene) -> None:
    file = tmp_path / "a.toml"
    file.write_text(scene.toml() + "\n[quick.image]\nwidth = 16\n")
    paths: list[Any] = [file, str(file)]
    for path in paths:
        assert width_of(firn.Scene.read(path)) == "width = 32"
        assert width_of(firn.Scene.read(path, quick=True)) == "width = 16"
        changed = firn.Scene.read(path, quick=True, overrides={
            "image.width": np.int32(8), "name": "bär", "snow.center": np.array([1, 2.5, 3]), "snow.trim": True})
        assert width_of(changed) == "width = 8"
        assert "center = [1.0, 2.5, 3.0]" in changed.toml() and "trim = true" in changed.toml()


def test_a_text_of_an_override_arrives_whatever_is_in_it(scene: firn.Scene) -> None:
    with pytest.raises(firn.UsageError, match='q"#') as raised:
        firn.Scene.parse(scene.toml(), overrides={"name": 'q"#\\ = \x01'})
    assert 'q"#\\ = \x01' in str(raised.value) or 'q"#\\ = \\' in str(raised.value)


def test_errors_of_files_and_overrides(tmp_path: Path, scene: firn.Scene) -> None:
    with pytest.raises(firn.FileError, match="none.toml") as file_error:
        firn.Scene.read(tmp_path / "none.toml")
    assert isinstance(file_error.value, OSError) and file_error.value.code == "io"
    with pytest.raises(firn.UsageError, match=r"a.toml:2:\d+"):
        firn.Scene.parse("\nsnow = = 1", "a.toml")
    line = here() + 2
    with pytest.raises(firn.UsageError, match="imag.width") as raised:
        firn.Scene.parse(scene.toml(), overrides={"imag.width": 8})
    assert raised.value.where == f"test_scene.py:{line}"
    with pytest.raises(firn.UsageError, match=r"test_scene.py:\d+: .*width.*-8"):
        firn.Scene.parse(scene.toml(), overrides={"image.width": -8})
    with pytest.raises(firn.UsageError, match="quick"):
        firn.Scene.parse(scene.toml(), quick=True)
    for path in (3, None, b"a"):
        with pytest.raises(TypeError):
            firn.Scene.read(path)  # type: ignore[arg-type]


def test_copies_are_independent_and_pickles_are_refused(scene: firn.Scene) -> None:
    for copied in (copy.copy(scene), copy.deepcopy(scene)):
        copied.set("image.width", 7)
        assert width_of(copied) == "width = 7" and width_of(scene) == "width = 32"
    with pytest.raises(TypeError, match="toml"):
        pickle.dumps(scene)


def test_an_empty_scene_is_refused_by_what_uses_it() -> None:
    for name in ("scene", "a/b", ""):
        with pytest.raises(firn.UsageError):
            firn.Simulation(firn.Scene(name))


def test_subclasses_and_functions_of_the_program_are_the_place() -> None:
    class Mine(firn.Scene):
        pass

    mine = Mine("mine")
    mine.set("image.width", -1); line = here()  # noqa: E702
    with pytest.raises(firn.UsageError, match=f"test_scene.py:{line}: "):
        mine.check()
    assert isinstance(copy.copy(Mine("a")), Mine) and make_scene().frames == 3


def test_a_scene_says_what_it_is() -> None:
    assert repr(make_scene(frames=7)) == "<firn.Scene of 7 frames>"
    assert repr(firn.Scene()) == "<firn.Scene that is not complete>"
