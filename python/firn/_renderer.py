# SPDX-License-Identifier: MIT
"""Pictures of snapshots."""
from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from types import MappingProxyType
from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _core as library
from ._core import Snapshot
from ._scene import Scene
from ._simulation import Stop, watch_of
from ._values import path_text

Pixels = npt.NDArray[np.float32]


class Picture:
    """A rendered frame: linear light and layers, as views of the picture's memory that keep it alive.

    rgb       float32, (height, width, 3): radiance, linear RGB (primaries of sRGB), without exposure; the top row first
    layers    the layers that the scene's output.layers names, float32: "albedo", "normal" (unit, world axes), "sparkle"
              and "subsurface" (height, width, 3); "depth" (m), "samples" (a pixel) and "variance" (height, width)
    exposure, tone_map   how srgb() and write() show it, as the scene says: stops, and "soft", "srgb" or "filmic"

    Picture(width, height) is black. The arrays may be written to. copy.copy() makes an independent picture; pickle works.
    A notebook shows a picture that ends a cell.
    """

    __slots__ = ("_core", "exposure", "tone_map", "__weakref__")
    _core: library.Picture
    exposure: float
    tone_map: str

    def __init__(self, width: int, height: int, exposure: float = 0.0, tone_map: str = "soft") -> None:
        """Black. Errors: ValueError for a picture without pixels."""
        if width < 1 or height < 1:
            raise ValueError(f"a picture has pixels, not {width} x {height}")
        self._core = library.Picture(width, height)
        self.exposure, self.tone_map = exposure, tone_map

    @property
    def width(self) -> int:
        """Pixels across."""
        return self._core.width()

    @property
    def height(self) -> int:
        """Pixels from top to bottom."""
        return self._core.height()

    @property
    def rgb(self) -> Pixels:
        """float32, (height, width, 3): radiance, linear RGB."""
        return self._core.rgb()

    @property
    def layers(self) -> Mapping[str, Pixels]:
        """The layers by their names."""
        return MappingProxyType(self._core.layers())

    def srgb(self, exposure: Optional[float] = None, tone_map: Optional[str] = None) -> npt.NDArray[np.uint8]:
        """A copy as a screen shows it: uint8, (height, width, 3), sRGB. None: as the scene says.

        Errors: UsageError for an unknown tone map or an exposure that is not finite.
        """
        return self._core.tone_mapped(*self._tone(exposure, tone_map))

    def write(self, path: str | os.PathLike[str], exposure: Optional[float] = None, tone_map: Optional[str] = None) -> list[str]:
        """Writes a file as its name ends: .png or .ppm as srgb() shows it; .pfm or .exr in linear float32 with the layers
        (.pfm: a file each). Returns the files that were written.

        Errors: UsageError for another ending, or .exr where firn was built without OpenEXR; FileError.
        """
        return self._core.write(path_text(path), *self._tone(exposure, tone_map))

    def _tone(self, exposure: Optional[float], tone_map: Optional[str]) -> tuple[float, str]:
        return self.exposure if exposure is None else exposure, self.tone_map if tone_map is None else tone_map

    def _repr_png_(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            (path,) = self.write(os.path.join(folder, "picture.png"))
            with open(path, "rb") as file:
                return file.read()

    def __repr__(self) -> str:
        return f"<firn.Picture of {self.width} x {self.height} pixels>"

    def __copy__(self) -> Picture:
        return self._of(self._core.copy(), self.exposure, self.tone_map)

    def __deepcopy__(self, memo: object) -> Picture:
        return self.__copy__()

    def __reduce__(self) -> tuple[object, ...]:
        layers = {name: values.copy() for name, values in self.layers.items()}
        return _restored, (self.rgb.copy(), layers, self.exposure, self.tone_map)

    @classmethod
    def _of(cls, core: library.Picture, exposure: float, tone_map: str) -> Picture:
        made = cls.__new__(cls)
        made._core, made.exposure, made.tone_map = core, exposure, tone_map
        return made


def _restored(rgb: Pixels, layers: dict[str, Pixels], exposure: float, tone_map: str) -> Picture:
    height, width, _ = rgb.shape
    picture = Picture(width, height, exposure, tone_map)
    picture.rgb[...] = rgb
    for name, values in layers.items():
        picture._core.add_layer(name)
        picture.layers[name][...] = values
    return picture


class Renderer:
    """The camera, lights, surfaces and objects of a scene and the look of its snow, to take pictures of snapshots with.

    The same snapshot and scene give the same bits on any number of threads. While firn computes other Python threads run,
    but one renderer is used by one thread at a time. Renderers are neither copied nor pickled.
    """

    __slots__ = ("_core", "__weakref__")
    _core: library.Renderer

    def __init__(self, scene: Scene, threads: int = 0, isa: str = "auto") -> None:
        """threads   0: as many as the machine has
        isa       "base", "x86-64-v3", "x86-64-v4", or "auto": the best that the CPU has

        Errors: UsageError for a scene or options that no picture can be made of, FileError.
        """
        if not isinstance(scene, Scene):
            raise TypeError(f"a renderer is made of a firn.Scene, not of {type(scene).__name__}")
        self._core = library.Renderer(scene._core, threads, isa)

    def render(self, snapshot: Snapshot, stop: Optional[Stop] = None) -> Picture:
        """The snow at its time, which decides too where what moves is; `snapshot.frame` decides the noise.

        stop   a threading.Event, or whatever has is_set(): looked at ten times a second

        KeyboardInterrupt comes out within two seconds of Ctrl-C; the renderer may be used again.

        Errors: UsageError for snow of an object, or a driven collider, that the scene does not have; UnstableError for
        values that are not finite, and for volumes or densities that are not above 0; Error with the code "interrupted"
        after a stop.
        """
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"a picture is taken of a firn.Snapshot, not of {type(snapshot).__name__}")
        core = self._core.render(snapshot, watch_of(stop))
        return Picture._of(core, *self._core.tone_mapping())

    def __repr__(self) -> str:
        return "<firn.Renderer>"

    def __reduce__(self) -> str:
        raise TypeError("a firn.Renderer is neither copied nor pickled; its scene makes another")
