# SPDX-License-Identifier: MIT
"""Scenes: read from files, made in Python, or both."""
from __future__ import annotations

import os
from collections.abc import Mapping

import numpy.typing as npt

from . import _core as library
from ._errors import Error, place
from ._points import MaybeArray, columns
from ._values import Value, merged, overrides_text, path_text, plain


class Scene:
    """A scene: read from a file, made in Python, or both.

    Tables and keys are those of scene files (docs/scene_format.md, `firn params`), in SI units with +Y up, and a value
    meets the same checks wherever it comes from. A value is a bool, a number, a text, a path, or a sequence or dict of
    these; NumPy's scalars and arrays count as what they hold.

    What is wrong with a value comes out of check(), and of whatever uses the scene, as a UsageError that names the line
    of the program that gave it: "script.py:6: 'radius' is -0.05, out of range: it must be above 0 m".

    copy.copy() makes an independent scene. One scene is not to be changed while another thread uses it. Scenes are not
    pickled: their text, toml(), can be.
    """

    __slots__ = ("_core", "__weakref__")
    _core: library.Scene

    def __init__(self, name: str = "scene") -> None:
        """A scene of this name without snow or anything else, which add() and set() bring."""
        where = place()
        self._core = library.Scene(plain(name, "name", where), where)

    @classmethod
    def read(cls, path: str | os.PathLike[str], quick: bool = False, overrides: Mapping[str, Value] | None = None) -> Scene:
        """The scene of a file; "-" is the standard input.

        quick       the small size: the values of the scene's [quick] table
        overrides   values that replace those of the file, by their paths: {"image.width": 320}. They come after [quick]

        Errors: UsageError ("scene.toml:12:3: ...") for syntax, an unknown key, a wrong type, a value out of range, a
        contradiction; FileError when a file cannot be read.
        """
        where = place()
        return cls._of(library.Scene.read(path_text(path), quick, overrides_text(overrides, where), where))

    @classmethod
    def parse(cls, text: str, file: str = "scene", quick: bool = False, overrides: Mapping[str, Value] | None = None) -> Scene:
        """The scene of a text of TOML. `file` is what errors call it; paths in it are relative to that file's folder.

        Errors and the other arguments: as read().
        """
        where = place()
        return cls._of(library.Scene.parse(text, file, quick, overrides_text(overrides, where), where))

    def set(self, path: str, value: Value) -> Scene:
        """Gives a key a value, and returns the scene.

        `path` is "image.width"; "snow.radius" (of every [[snow]]), "snow[0].radius", "snow.left.radius" (by name).

        Errors: UsageError at once for a path that leads nowhere and for what no key can have.
        """
        where = place()
        self._core.set(path, plain(value, path, where), where)
        return self

    def add(self, table: str, keys: Mapping[str, Value] | None = None, /, **more: Value) -> Scene:
        """One more table of a list, and returns the scene.

        add("snow", shape="ball", radius=0.1, center=(0, 1, 0)) is one more [[snow]]; keys may be given as a dict too.

        Errors: UsageError at once for an unknown list and for a key that is given twice.
        """
        where = place()
        self._core.add(table, merged(keys, more, where), where)
        return self

    def add_points(
        self,
        position: npt.ArrayLike,
        velocity: MaybeArray = None,
        volume: MaybeArray = None,
        mass: MaybeArray = None,
        radius: MaybeArray = None,
        density: MaybeArray = None,
        Jp: MaybeArray = None,
        F: MaybeArray = None,
        **keys: Value,
    ) -> Scene:
        """Points of another program as one more [[snow]], and returns the scene. Arrays are copied, to double precision.

        position   (N, 3), m (or what the key `scale` makes of them)
        velocity   (N, 3), m/s
        volume     (N,) or one number, m^3, without strain
        mass       (N,) or one number, kg
        radius     (N,) or one number, m: half the edge of the cube that a point stands for
        density    (N,) or one number, kg/m^3, now
        Jp         (N,) or one number: plastic volume ratio
        F          (N, 3, 3): elastic deformation gradient, kept in single precision
        keys       other keys of the [[snow]]: preset="fresh", offset=(0, 1, 0), spacing=0.01

        How much snow a point is comes from `spacing`, else the volume, else the mass, else the radius, else from how
        densely the points lie (docs/points.md). A session needs a file in the place of arrays: write_points().

        Errors: UsageError at once for arrays of other shapes, values that no point may have, and as add().
        """
        where = place()
        given = {"position": position, "velocity": velocity, "volume": volume, "mass": mass, "radius": radius,
                 "density": density, "Jp": Jp, "F": F}
        self._core.add_points(columns(where, given), merged(None, keys, where), where)
        return self

    def check(self) -> None:
        """Checks everything that was said up to now, as whatever uses the scene does. Errors: as read()."""
        self._core.check()

    def toml(self) -> str:
        """The scene with every default written out, which parse() reads back. Errors: as check()."""
        return self._core.toml()

    @property
    def frames(self) -> int:
        """Number of frames. Errors: as check()."""
        return self._core.frames()

    def frame_time(self, frame: int) -> float:
        """Time of the simulation at a frame, s. Errors: as check()."""
        return self._core.frame_time(frame)

    def __repr__(self) -> str:
        try:
            return f"<firn.Scene of {self.frames} frames>"
        except Error:  # it is still being made
            return "<firn.Scene that is not complete>"

    def __copy__(self) -> Scene:
        return self._of(self._core.copy())

    def __deepcopy__(self, memo: object) -> Scene:
        return self.__copy__()

    def __reduce__(self) -> str:
        raise TypeError("a firn.Scene is not pickled; its text is: Scene.parse(scene.toml())")

    @classmethod
    def _of(cls, core: library.Scene) -> Scene:
        made = cls.__new__(cls)
        made._core = core
        return made
