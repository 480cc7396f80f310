# SPDX-License-Identifier: MIT
"""Sessions: a scene run as the program `firn` runs it."""
from __future__ import annotations

import operator
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from . import _core as library
from ._driver import Driver, asking
from ._errors import place, usage_error
from ._observer import Forward, Observer
from ._progress import SessionProgress, wanted
from ._scene import Scene
from ._simulation import Stop, watch_of
from ._values import Value, overrides_text, path_text, small


@dataclass(frozen=True)
class StageInterval:
    """What a thread of a session did, when: a `stage` ("simulate", "trace", "write") of a `frame`, from `begin` to `end`
    (s since the start of the session), in `thread`."""

    stage: str
    frame: int
    begin: float
    end: float
    thread: int


@dataclass(frozen=True, repr=False)
class SessionResult:
    """How a session ended.

    interrupted     it was stopped; Session.resume() goes on
    nothing_to_do   the run was complete already
    kept            finished frames of the run, where it was interrupted
    left            and those that are still to be made, ascending
    intervals       what its threads did, as StageInterval
    """

    interrupted: bool
    nothing_to_do: bool
    kept: int
    left: tuple[int, ...]
    intervals: tuple[StageInterval, ...]

    def __repr__(self) -> str:
        if self.nothing_to_do:
            return "<firn.SessionResult: the run was complete>"
        if self.interrupted:
            return f"<firn.SessionResult: interrupted, {self.kept} frames kept, {len(self.left)} left>"
        return "<firn.SessionResult: complete>"


class Session:
    """A scene run as the program `firn` runs it: frames simulated and traced at the same time, checkpoints, a manifest,
    and a run folder that can be gone on with after any interruption (docs/runs.md).

    start(), resume() and render() begin one: each checks everything first, takes the run folder, and leaves nothing
    behind when it refuses. run() does the work. These arguments are common to them:

    out         the run folder; None: out/NAME of the scene
    frames      (first, last), both included, or one number; None: all
    threads     0: as many as the machine has
    isa         "base", "x86-64-v3", "x86-64-v4", or "auto": the best that the CPU has
    overlap     False: simulates no frame while another is traced; the bits are the same
    force       takes whatever the solver was not made for
    overwrite   takes a folder that holds a run already, or pictures
    observer    an Observer
    progress    True, False, or "auto": a bar in a terminal or in a notebook

    A session may be begun in one thread and run in another. Sessions of different folders may run at the same time.
    Sessions are neither copied nor pickled.
    """

    __slots__ = ("_core", "_drivers", "_observers", "__weakref__")
    _core: library.Session
    _drivers: dict[str, Driver]
    _observers: list[Observer]

    def __init__(self) -> None:
        raise TypeError("a session begins with Session.start(), Session.resume() or Session.render()")

    @classmethod
    def start(
        cls,
        scene: Scene,
        out: str | os.PathLike[str] | None = None,
        frames: int | Sequence[int] | None = None,
        pictures: bool = True,
        particles: bool = False,
        movie: bool = True,
        threads: int = 0,
        isa: str = "auto",
        overlap: bool = True,
        force: bool = False,
        overwrite: bool = False,
        observer: Observer | None = None,
        progress: bool | str | None = "auto",
    ) -> Session:
        """A new run of a scene.

        pictures    False: only the snow
        particles   True: keeps the particles of each frame whatever the scene says
        movie       False: makes none whatever the scene says

        Errors: UsageError for a scene or options that no run can be made of, FileError.
        """
        if not isinstance(scene, Scene):
            raise TypeError(f"a run is made of a firn.Scene, not of {type(scene).__name__}")
        options = _options(out, frames, threads, isa, overlap, force, overwrite)
        options.update(pictures=pictures, particles=particles, movie=movie)
        return cls._begin(observer, progress, lambda told: library.Session.start(scene._core, options, told))

    @classmethod
    def resume(
        cls,
        run: str | os.PathLike[str],
        frames: int | Sequence[int] | None = None,
        threads: int = 0,
        isa: str = "auto",
        overlap: bool = True,
        force: bool = False,
        observer: Observer | None = None,
        progress: bool | str | None = "auto",
    ) -> Session:
        """Goes on with a run where it stopped, whatever stopped it, to the same bits: finished frames are kept, the
        simulation goes on from a checkpoint, or from the start if none fits.

        Errors: UsageError, FileError.
        """
        options = _options(None, frames, threads, isa, overlap, force, False)
        return cls._begin(observer, progress, lambda told: library.Session.resume(path_text(run), options, told))

    @classmethod
    def render(
        cls,
        run: str | os.PathLike[str],
        out: str | os.PathLike[str] | None = None,
        frames: int | Sequence[int] | None = None,
        movie: bool = True,
        threads: int = 0,
        isa: str = "auto",
        overlap: bool = True,
        force: bool = False,
        overwrite: bool = False,
        quick: bool = False,
        overrides: Mapping[str, Value] | None = None,
        observer: Observer | None = None,
        progress: bool | str | None = "auto",
    ) -> Session:
        """Pictures of the particles that a run kept: into its own folder, which several sessions may do at the same time,
        or, with `out`, as a run of its own, for which `quick` and `overrides` may give other values of the scene.

        Errors: UsageError, FileError.
        """
        options = _options(out, frames, threads, isa, overlap, force, overwrite)
        options.update(movie=movie)
        changes = overrides_text(overrides, place())
        return cls._begin(observer, progress, lambda told: library.Session.render(path_text(run), options, quick, changes, told))

    def drive(self, collider: str, driver: Driver) -> None:
        """The named collider moves as `driver` says, from the start of the simulation: as Simulation.drive(), before run().

        The run remembers which colliders are driven: resume() goes on only when they are driven again, by drivers that do
        the same, from the time of the checkpoint that it goes on from, which their first call tells.

        Errors: UsageError for a name that no collider has, one with a `motion` of the scene, one that was not driven when
        the run began, and after run().
        """
        self._core.drive(collider, asking(self, collider, driver))
        self._drivers[collider] = driver

    def run(self, stop: Stop | None = None) -> SessionResult:
        """Makes the frames, then the movie of all; once.

        stop   a threading.Event, or whatever has is_set(): looked at ten times a second

        After a stop the finished frames are kept, a checkpoint is written, and the result says so. Ctrl-C does the same,
        and then KeyboardInterrupt comes out, within two seconds; resume() goes on.

        Errors: FileError, UnstableError, or whatever the observer or a driver raises, after the manifest has recorded it;
        UsageError for a second time, and, before anything is done, for a collider that was driven and is not.
        """
        told = self._core.run(watch_of(stop))
        return SessionResult(
            interrupted=told["interrupted"],
            nothing_to_do=told["nothing_to_do"],
            kept=told["kept"],
            left=tuple(told["left"]),
            intervals=tuple(StageInterval(*interval) for interval in told["intervals"]),
        )

    @property
    def folder(self) -> str:
        """The folder of the run."""
        return self._core.folder()

    @property
    def shares(self) -> bool:
        """Whether other sessions may add pictures to the folder at the same time."""
        return self._core.shares()

    def tell(self, line: str) -> None:
        """A line to the observer. Errors: UsageError once run() has ended, which lets go of the folder."""
        self._core.tell(line)

    def __repr__(self) -> str:
        return f"<firn.Session in {self.folder!r}>"

    def __reduce__(self) -> str:
        raise TypeError("a firn.Session is neither copied nor pickled; Session.resume() goes on with its run")

    @classmethod
    def _begin(cls, observer: Observer | None, progress: bool | str | None, begin: Callable[[Forward], library.Session]) -> Session:
        if observer is not None and not isinstance(observer, Observer):
            raise TypeError(f"an observer is a firn.Observer, not of the type {type(observer).__name__}")
        made = cls.__new__(cls)
        made._drivers = {}
        made._observers = [SessionProgress("firn")] if wanted(progress) else []
        made._observers += [observer] if observer is not None else []
        made._core = begin(Forward(made))
        return made


def _options(
    out: str | os.PathLike[str] | None,
    frames: int | Sequence[int] | None,
    threads: int,
    isa: str,
    overlap: bool,
    force: bool,
    overwrite: bool,
) -> dict[str, Any]:
    """Those of the library, by their names."""
    return {
        "out": None if out is None else path_text(out),
        "frames": _frames(frames),
        "threads": small("threads", threads),
        "isa": isa,
        "overlap": overlap,
        "force": force,
        "overwrite": overwrite,
        "command": f"Python, {place()}",
    }


def _frames(frames: int | Sequence[int] | None) -> tuple[int, int] | None:
    if frames is None:
        return None
    try:
        if isinstance(frames, Sequence) and not isinstance(frames, str):
            first, last = frames
        else:
            first = last = frames
        pair = operator.index(first), operator.index(last)
    except (TypeError, ValueError):
        raise usage_error("frames", f"a number, or a pair of the first and the last, not {frames!r}") from None
    return small("frames", pair[0]), small("frames", pair[1])
