# SPDX-License-Identifier: MIT
"""Pictures: the bits of the command line, views without a copy, errors and stops."""
from __future__ import annotations

import copy
import gc
import pickle
import threading
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import firn
from conftest import Script, add_blade, make_scene

LAYERS = ["albedo", "normal", "depth", "sparkle", "subsurface", "samples", "variance"]


def pfm(path: Path) -> npt.NDArray[np.float32]:
    head, size, _, body = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    shape = (height, width, 3) if head == b"PF" else (height, width)
    return np.frombuffer(body, np.float32).reshape(shape)[::-1]


@pytest.mark.parametrize("integrator", ["path", "bidirectional", "preview"])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_pictures_are_those_of_a_session(tmp_path: Path, integrator: str, threads: int) -> None:
    scene = make_scene(balls=2).set("image.integrator", integrator).set("output.formats", ["pfm"]).set("output.movie", False)
    firn.Session.start(scene, out=tmp_path / "run").run()
    simulation, renderer = firn.Simulation(scene, threads=threads), firn.Renderer(scene, threads=threads)
    for frame in range(scene.frames):
        simulation.advance_to(scene.frame_time(frame))
        snow = simulation.snapshot()
        snow.frame = frame
        picture = renderer.render(snow)
        assert (picture.width, picture.height) == (32, 24)
        assert np.array_equal(picture.rgb, pfm(tmp_path / f"run/frames/000{frame}.pfm"))


def test_arrays_are_views_that_outlive_picture_and_renderer() -> None:
    scene = make_scene().set("output.layers", LAYERS)
    picture = firn.Renderer(scene).render(firn.Simulation(scene).snapshot())
    rgb, layers = picture.rgb, dict(picture.layers)
    assert set(layers) == set(LAYERS)
    address = rgb.__array_interface__["data"][0]
    assert address == picture.rgb.__array_interface__["data"][0] and rgb.flags.c_contiguous
    for name, layer in layers.items():
        assert layer.__array_interface__["data"][0] == picture.layers[name].__array_interface__["data"][0]
        assert layer.shape == ((24, 32, 3) if name in ("albedo", "normal", "sparkle", "subsurface") else (24, 32))
        assert layer.dtype == np.float32
    assert np.from_dlpack(rgb).__array_interface__["data"][0] == address
    kept = {name: layer.copy() for name, layer in layers.items()}
    kept_rgb = rgb.copy()
    del picture
    gc.collect()
    np.ones((200, 200))
    assert np.array_equal(rgb, kept_rgb)
    for name, layer in layers.items():
        assert np.array_equal(layer, kept[name])
    rgb[0, 0] = 7  # may be written to


def test_copies_and_pickles_are_independent() -> None:
    scene = make_scene().set("output.layers", ["depth", "albedo"]).set("output.exposure", -1).set("output.tone_map", "filmic")
    picture = firn.Renderer(scene).render(firn.Simulation(scene).snapshot())
    assert (picture.exposure, picture.tone_map) == (-1, "filmic")
    for other in (copy.copy(picture), copy.deepcopy(picture), pickle.loads(pickle.dumps(picture))):
        assert np.array_equal(other.rgb, picture.rgb)
        assert {name: values.tolist() for name, values in other.layers.items()} == {
            name: values.tolist() for name, values in picture.layers.items()}
        assert (other.exposure, other.tone_map) == (-1, "filmic")
        other.rgb[:] = -1
        assert picture.rgb.min() >= 0


def test_tone_mapping_and_files(tmp_path: Path) -> None:
    scene = make_scene().set("output.layers", ["depth"])
    picture = firn.Renderer(scene).render(firn.Simulation(scene).snapshot())
    srgb = picture.srgb()
    assert srgb.shape == (24, 32, 3) and srgb.dtype == np.uint8
    assert (picture.srgb(exposure=1) >= srgb).all() and (picture.srgb(exposure=1) > srgb).any()
    assert picture.write(tmp_path / "a.ppm") == [str(tmp_path / "a.ppm")]
    assert np.array_equal(np.frombuffer((tmp_path / "a.ppm").read_bytes()[-24 * 32 * 3 :], np.uint8).reshape(24, 32, 3), srgb)
    assert picture.write(str(tmp_path / "a.pfm")) == [str(tmp_path / "a.pfm"), str(tmp_path / "a.depth.pfm")]
    assert np.array_equal(pfm(tmp_path / "a.depth.pfm"), picture.layers["depth"])
    assert picture._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    with pytest.raises(firn.UsageError, match="ends in .png"):
        picture.write(tmp_path / "a.jpg")
    with pytest.raises(firn.UsageError, match="soft, srgb, filmic"):
        picture.srgb(tone_map="reinhard")
    with pytest.raises(firn.UsageError, match="exposure"):
        picture.srgb(exposure=float("nan"))
    with pytest.raises(firn.FileError):
        picture.write(tmp_path / "none/a.png")


def test_black_pictures() -> None:
    assert not firn.Picture(3, 2).rgb.any() and firn.Picture(3, 2).rgb.shape == (2, 3, 3)
    for width, height in ((0, 1), (1, 0), (-1, 2)):
        with pytest.raises(ValueError, match="pixels"):
            firn.Picture(width, height)


def test_snow_and_colliders_that_the_scene_does_not_have() -> None:
    scene = add_blade(make_scene())
    simulation = firn.Simulation(scene)
    simulation.drive("blade", lambda now: (-1, 0, 0))
    simulation.add_snow(shape="ball", radius=0.05, center=(0, 0.6, 0))
    simulation.advance_to(0.02)
    snow = simulation.snapshot()
    with pytest.raises(firn.UsageError, match="snow number 1"):
        firn.Renderer(scene).render(snow)
    with_blade = firn.Renderer(simulation.scene).render(snow)
    assert [c.name for c in snow.driven] == ["blade"]
    assert snow.driven[0].position[0] == pytest.approx(-0.27)
    assert np.array_equal(firn.Renderer(simulation.scene).render(pickle.loads(pickle.dumps(snow))).rgb, with_blade.rgb)
    still = copy.copy(snow)
    still.driven = ()
    assert not np.array_equal(firn.Renderer(simulation.scene).render(still).rgb, with_blade.rgb)
    bare = make_scene()
    bare.add("snow", shape="ball", radius=0.05, center=(0, 0.6, 0))
    with pytest.raises(firn.UsageError, match="'blade'"):
        firn.Renderer(bare).render(snow)


@pytest.mark.parametrize("column, bad", [("density", np.nan), ("volume0", 0), ("velocity", np.inf), ("position", np.nan)])
def test_values_that_no_snow_has(column: str, bad: float) -> None:
    scene = make_scene()
    snow = firn.Simulation(scene).snapshot()
    getattr(snow, column)[..., 5] = bad
    with pytest.raises(firn.UnstableError):
        firn.Renderer(scene).render(snow)


def test_a_stop_ends_a_picture_and_the_next_one_is_whole() -> None:
    scene = make_scene().set("image.samples", 100000).set("image.width", 300).set("image.height", 300)
    renderer, snow = firn.Renderer(scene), firn.Simulation(scene).snapshot()
    stop = threading.Event()
    threading.Timer(0.3, stop.set).start()
    began = time.monotonic()
    with pytest.raises(firn.Error, match="stopped") as raised:
        renderer.render(snow, stop=stop)
    assert raised.value.code == "interrupted" and time.monotonic() - began < 3


def test_ctrl_c_ends_a_picture(script: Script) -> None:
    done = script("""
import os, signal, threading, time
import firn
scene = firn.Scene().set("simulation.dx", 0.03).set("image.samples", 100000)
scene.add("snow", shape="ball", radius=0.1, center=(0, 1, 0))
renderer, snow = firn.Renderer(scene), firn.Simulation(scene).snapshot()
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
began = time.monotonic()
try:
    renderer.render(snow)
except KeyboardInterrupt:
    print("stopped", time.monotonic() - began < 2.5)
""")
    assert done.stdout == "stopped True\n"


def test_other_threads_run_while_a_picture_is_made() -> None:
    scene = make_scene().set("image.samples", 3000)
    renderer, snow = firn.Renderer(scene), firn.Simulation(scene).snapshot()
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    renderer.render(snow)
    done.set()
    thread.join()
    assert counted > 20


def test_what_is_no_scene_and_no_snapshot() -> None:
    with pytest.raises(TypeError, match="firn.Scene"):
        firn.Renderer("scene")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="firn.Snapshot"):
        firn.Renderer(make_scene()).render(None)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="neither copied nor pickled"):
        copy.copy(firn.Renderer(make_scene()))
