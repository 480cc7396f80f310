# SPDX-License-Identifier: MIT
"""Simulations: the snow of a scene, stepped by a program."""
from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from typing import BinaryIO, Protocol

import numpy as np
import numpy.typing as npt

from . import _core as library
from ._core import Snapshot
from ._driver import Driver, asking
from ._errors import error_of, place, usage_error
from ._metrics import Metrics, metrics_of
from ._points import MaybeArray, columns
from ._progress import Bar, bar, wanted
from ._scene import Scene
from ._values import Value, merged, path_text


class Stop(Protocol):
    """What can ask for a stop, such as threading.Event."""

    def is_set(self) -> bool:
        """Whether to stop."""


def watch_of(stop: Stop | None) -> Callable[[], bool] | None:
    if stop is None:
        return None
    asked = stop.is_set
    return lambda: bool(asked())


class Simulation:
    """The snow of a scene, stepped by a program; `time`, `camera`, `image`, lights and `output` mean nothing to it.

    The bits depend on the scene and on what is asked for, not on threads. While firn computes other Python threads run,
    but one simulation is used by one thread at a time: another one gets a UsageError. Ctrl-C raises KeyboardInterrupt
    between two steps; the simulation goes on from there.

    len(simulation) is the number of particles. Simulations are not pickled and not copied: save() and load() do that.
    """

    __slots__ = ("_core", "_drivers", "__weakref__")
    _core: library.Simulation
    _drivers: dict[str, Driver]

    def __init__(self, scene: Scene, threads: int = 0, isa: str = "auto", force: bool = False) -> None:
        """Places the snow of a scene.

        threads   0: as many as the machine has
        isa       "base", "x86-64-v3", "x86-64-v4", or "auto": the best that the CPU has
        force     takes a fixed dt above the stable bound

        Errors: UsageError for a scene or options that no simulation can be made of, FileError. Ctrl-C comes out at once.
        """
        if not isinstance(scene, Scene):
            raise TypeError(f"a simulation is made of a firn.Scene, not of {type(scene).__name__}")
        self._drivers = {}
        self._core = library.Simulation(scene._core, threads, isa, force)

    def advance_to(
        self,
        time: float,
        progress: bool | str | Callable[[float], object] | None = None,
        stop: Stop | None = None,
    ) -> bool:
        """Steps until `time` (s) is reached exactly; does nothing if it has passed.

        progress   True, or "auto" (in a terminal or a notebook): a bar. A function: it is called with the simulation's
                   time (s) ten times a second, in the calling thread; what it raises stops the simulation and comes out
        stop       a threading.Event, or whatever has is_set(): looked at ten times a second

        Returns whether the time was reached: False after a stop. The state is then between two steps, as good as any, and
        the next call goes on to the same bits.

        Errors: UnstableError that names step, particle and likely cause; UsageError for a time that is not finite, in a
        driver, and after load() while a collider that was driven has no driver; whatever a driver raises, unchanged.
        KeyboardInterrupt within two seconds of Ctrl-C, or after one step where that takes longer.
        """
        if callable(progress):
            return self._core.advance_to(time, self._watch(stop, progress))
        if not wanted(progress):
            return self._core.advance_to(time, self._watch(stop, None))
        begin = self.time
        line = bar("firn", time - begin, "s")
        try:
            reached = self._core.advance_to(time, self._watch(stop, lambda now: line.show(now - begin)))
            self._finish(line, begin)
            return reached
        finally:
            line.close()

    def step(self) -> float:
        """One step of the longest stable length, or of the scene's fixed one. Returns it, s. Errors: as advance_to()."""
        return self._core.step()

    @property
    def time(self) -> float:
        """Where the simulation is, s."""
        return self._core.time()

    @property
    def scene(self) -> Scene:
        """A copy of its scene, with the snow that was added: for a Renderer."""
        return Scene._of(self._core.scene())

    def __len__(self) -> int:
        return self._core.size()

    def metrics(self) -> Metrics:
        """Mass, momentum, energies, forces of colliders, and more, now."""
        return metrics_of(self._core.metrics())

    def snapshot(self, F: bool = False, Jp: bool = False, J: bool = False, stress: bool = False) -> Snapshot:
        """A copy of the particles now, with the columns of the state that are asked for."""
        return self._core.snapshot(F, Jp, J, stress)

    def hash(self) -> int:
        """64 bits of every bit of every particle, in whatever order these are kept."""
        return self._core.hash()

    def add_snow(self, keys: Mapping[str, Value] | None = None, /, **more: Value) -> int:
        """More snow, now, as one more [[snow]] of the scene would have it at its start: add_snow(shape="ball", radius=0.1,
        center=(0, 1, 0)), or a dict.

        Returns its number, which is Snapshot.object of its particles; their ids go on from the last.

        Errors: UsageError for keys that the scene would refuse, for snow in a collider, outside the domain or closer than
        half its spacing to other snow (unless `trim` or `allow_overlap` say otherwise); then nothing has changed.
        """
        where = place()
        return self._core.add_snow(merged(keys, more, where), where)

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
    ) -> int:
        """Points of another program as more snow, now: the columns of Scene.add_points(), and as add_snow() for the rest."""
        where = place()
        given = {"position": position, "velocity": velocity, "volume": volume, "mass": mass, "radius": radius,
                 "density": density, "Jp": Jp, "F": F}
        return self._core.add_points(columns(where, given), merged(None, keys, where), where)

    def remove_snow(self, ids: npt.ArrayLike) -> int:
        """Takes out the particles with these ids: whole numbers of any type and order, (N,). Returns how many there were.

        Errors: UsageError for what is no id; UnstableError for a state that has blown up.
        """
        return self._core.remove_snow(_ids(ids))

    def drive(self, collider: str, driver: Driver) -> None:
        """The named collider moves as `driver` says, from now on and from where it is.

        driver(state) is called once before each step, before its length is chosen, with a DrivenCollider; it returns a
        ColliderVelocity, or three numbers: the linear velocity (m/s). It may look at the simulation (metrics, snapshot,
        save), but not step or change it. advance_to() calls it in a thread of its own; what it raises comes out of there.

        Errors: UsageError for a name that no collider has, or one that has a `motion` of the scene.
        """
        self._core.drive(collider, asking(self, collider, driver))
        self._drivers[collider] = driver

    def save(self, file: str | os.PathLike[str] | BinaryIO) -> None:
        """Writes the whole state with its scene to a path, whole or not at all, or to a binary file that is open.

        What load() makes goes on as this would have, bit for bit. Drivers are not saved: drive() gives them again. Files
        that the scene names are read again by load().

        Errors: FileError for a path that cannot be written; whatever the file raises.
        """
        state = self._core.save()
        if isinstance(file, (str, os.PathLike)):
            _write(path_text(file), state)
        else:
            _write_all(file, state)

    @classmethod
    def load(cls, file: str | os.PathLike[str] | BinaryIO, threads: int = 0, isa: str = "auto", force: bool = False) -> Simulation:
        """The simulation that save() wrote to this path or binary file. Arguments as for a new one.

        Errors: FileError if the file cannot be read or holds something else; those of a new simulation.
        """
        made = cls.__new__(cls)
        made._drivers = {}
        state = _read(path_text(file)) if isinstance(file, (str, os.PathLike)) else _read_all(file)
        made._core = library.Simulation(state, threads, isa, force)
        return made

    def __repr__(self) -> str:
        return f"<firn.Simulation of {len(self)} particles at {self.time!r} s>"

    def __reduce__(self) -> str:
        raise TypeError("a firn.Simulation is neither copied nor pickled; save() and load() do that")

    def _watch(self, stop: Stop | None, show: Callable[[float], object] | None) -> Callable[[], bool] | None:
        """What is called now and then while the simulation is at work; returns whether to stop."""
        if stop is None and show is None:
            return None

        def look() -> bool:
            if show is not None:
                show(self._core.reached())
            return stop is not None and bool(stop.is_set())

        return look

    def _finish(self, line: Bar, begin: float) -> None:
        line.show(self.time - begin)


def _ids(ids: npt.ArrayLike) -> npt.NDArray[np.uint32]:
    array = np.atleast_1d(np.asarray(ids))
    if array.size == 0:
        return np.empty(0, np.uint32)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        raise usage_error("", f"ids are whole numbers of the shape (N,), not {array.dtype} of {array.shape}")
    if array.min() < 0 or array.max() > np.iinfo(np.uint32).max:
        raise usage_error("", f"ids are between 0 and 2^32 - 1, not {array.min()} to {array.max()}")
    return np.ascontiguousarray(array, np.uint32)


def _write_all(file: BinaryIO, state: bytes) -> None:
    """All of it: a raw file takes as much as it can at a time."""
    left = memoryview(state)
    while left:
        took = file.write(left)
        if took is None or took <= 0:
            raise error_of("io", "save", f"save: the file takes no more than {len(state) - len(left)} of {len(state)} bytes")
        left = left[took:]


def _read_all(file: BinaryIO) -> bytes:
    parts = []
    while part := file.read():
        if not isinstance(part, bytes):
            raise TypeError("load() wants a file that is open in binary mode")
        parts.append(part)
    return b"".join(parts)


def _write(path: str, state: bytes) -> None:
    path = os.path.realpath(path)
    if os.path.exists(path) and not os.path.isfile(path):
        raise error_of("io", path, f"{path}: is no regular file, and a file is replaced as a whole")
    part = f"{path}.{os.getpid()}.part"
    try:
        with io.open(part, "wb") as out:
            out.write(state)
        os.replace(part, path)
    except OSError as error:
        if os.path.exists(part):
            os.unlink(part)
        raise error_of("io", path, f"{path}: cannot be written: {error.strerror}") from error


def _read(path: str) -> bytes:
    try:
        with io.open(path, "rb") as file:
            return file.read()
    except OSError as error:
        raise error_of("io", path, f"{path}: cannot be read: {error.strerror}") from error
