# SPDX-License-Identifier: MIT
"""Sessions: the command line's bits, stops and resumption, observers, pictures of kept particles."""
from __future__ import annotations

import copy
import gc
import json
import pickle
import subprocess
import threading
import weakref
from pathlib import Path
from typing import Any

import pytest

import firn
from conftest import make_scene


def hashes(run: Path) -> list[tuple[int, str, str]]:
    frames = [json.loads(line.rpartition("}")[0] + "}" if not line.endswith("}") else line)
              for line in (run / "frames.jsonl").read_text().splitlines() if line.startswith("{")]
    return sorted((f["frame"], f["particles_hash"], f.get("picture_hash", "")) for f in frames if "frame" in f)


def told_hashes(program: str, run: Path) -> list[tuple[int, str, str]]:
    done = subprocess.run([program, "info", str(run), "--json"], capture_output=True, text=True, check=True)
    return [(f["frame"], f["particles_hash"], f["picture_hash"]) for f in json.loads(done.stdout)["frames"]]


class Record(firn.Observer):
    """All that it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.stages: list[tuple[str, str, int]] = []
        self.frames: list[Any] = []
        self.folders: list[list[str]] = []

    def message(self, line: str) -> None:
        self.lines.append(line)

    def made_folders(self, folders: list[str]) -> None:
        self.folders.append(folders)

    def frames_begin(self, count: int, seconds: float) -> None:
        self.frames.append(count)

    def frames_end(self) -> None:
        self.frames.append("end")

    def stage_begins(self, stage: str, frame: int) -> None:
        self.stages.append(("begin", stage, frame))

    def stage_ends(self, stage: str, frame: int) -> None:
        self.stages.append(("end", stage, frame))


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("balls", [1, 2])
def test_a_run_is_that_of_the_command_line(tmp_path: Path, program: str, threads: int, balls: int) -> None:
    scene = make_scene(balls=balls).set("output.formats", ["png", "pfm"])
    (tmp_path / "scene.toml").write_text(scene.toml())
    subprocess.run([program, "run", "scene.toml", "--out", "command", "--quiet"], cwd=tmp_path, check=True, capture_output=True)
    session = firn.Session.start(scene, out=tmp_path / "python", threads=threads, overlap=threads != 2)
    result = session.run()
    assert not result.interrupted and not result.nothing_to_do and session.folder == str(tmp_path / "python")
    assert len(told_hashes(program, tmp_path / "python")) == 3
    assert told_hashes(program, tmp_path / "python") == told_hashes(program, tmp_path / "command")
    for frame in range(3):
        for kind in ("png", "pfm"):
            name = f"frames/{frame:04}.{kind}"
            assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "command" / name).read_bytes()
    assert {interval.stage for interval in result.intervals} == {"simulate", "trace", "write"}
    assert all(0 <= interval.begin <= interval.end for interval in result.intervals)


def test_an_observer_is_told_everything(tmp_path: Path, scene: firn.Scene) -> None:
    record = Record()
    firn.Session.start(scene, out=tmp_path / "a/b", observer=record).run()
    assert record.frames == [3, "end"] and record.folders[-1] == [] and record.folders[0][-1].endswith("a/b")
    wanted = {(what, stage, frame) for what in ("begin", "end") for stage in ("simulate", "trace", "write") for frame in range(3)}
    assert set(record.stages) == wanted and len(record.stages) == len(wanted)


@pytest.mark.parametrize("method", ["message", "frames_begin", "stage_begins", "stage_ends", "frames_end"])
def test_what_an_observer_raises_comes_out(tmp_path: Path, scene: firn.Scene, method: str) -> None:
    error = LookupError("mine")

    def fail(*arguments: object) -> None:
        raise error

    observer = firn.Observer()
    setattr(observer, method, fail)
    with pytest.raises(LookupError) as raised:
        firn.Session.start(scene.set("output.formats", ["png"]), out=tmp_path / "run", observer=observer).run()
    assert raised.value is error


@pytest.mark.parametrize("written", [1, 2, 4])
def test_a_stop_leaves_a_run_that_goes_on_to_the_same_bits(tmp_path: Path, program: str, written: int) -> None:
    scene = make_scene(frames=5).set("image.samples", 16)
    firn.Session.start(scene, out=tmp_path / "whole").run()
    stop = threading.Event()

    class StopAfter(firn.Observer):
        left = written

        def stage_ends(self, stage: str, frame: int) -> None:
            self.left -= stage == "write"
            if self.left == 0:
                stop.set()

    result = firn.Session.start(scene, out=tmp_path / "run", observer=StopAfter()).run(stop)
    if result.interrupted:
        assert result.kept >= written - 1 and len(result.left) == 5 - result.kept
        assert not firn.Session.resume(tmp_path / "run").run().interrupted
    assert told_hashes(program, tmp_path / "run") == told_hashes(program, tmp_path / "whole")
    assert firn.Session.resume(str(tmp_path / "run")).run().nothing_to_do


@pytest.mark.parametrize("frames, made", [(None, 3), (1, 1), ((0, 1), 2), ([1, 2], 2), (range(0, 2), 2)])
def test_frames(tmp_path: Path, scene: firn.Scene, frames: Any, made: int) -> None:
    firn.Session.start(scene, out=tmp_path / "run", frames=frames).run()
    assert len(list((tmp_path / "run/frames").glob("*.png"))) == made


def test_particles_alone_and_their_pictures_later(tmp_path: Path, program: str, scene: firn.Scene) -> None:
    firn.Session.start(scene, out=tmp_path / "whole", movie=False).run()
    firn.Session.start(scene, out=tmp_path / "run", pictures=False, particles=True).run()
    assert len(list((tmp_path / "run/particles").iterdir())) == 3 and not list((tmp_path / "run/frames").glob("*.png"))
    session = firn.Session.render(tmp_path / "run")
    assert session.shares
    session.run()
    assert told_hashes(program, tmp_path / "run") == told_hashes(program, tmp_path / "whole")
    firn.Session.render(tmp_path / "run", out=tmp_path / "small", frames=(0, 1), overrides={"image.width": 16}).run()
    assert len(list((tmp_path / "small/frames").glob("*.png"))) == 2
    with pytest.raises(firn.UsageError, match="imag.width"):
        firn.Session.render(tmp_path / "run", out=tmp_path / "other", overrides={"imag.width": 16})


def test_mistakes_leave_nothing_behind(tmp_path: Path, scene: firn.Scene) -> None:
    attempts: list[Any] = [
        (firn.UsageError, lambda: firn.Session.start(scene, out=tmp_path / "run", frames=(5, 9))),
        (firn.UsageError, lambda: firn.Session.start(scene, out=tmp_path / "run", frames="all")),  # type: ignore[arg-type]
        (firn.UsageError, lambda: firn.Session.start(scene, out=tmp_path / "run", frames=(1, 2, 3))),
        (firn.Error, lambda: firn.Session.start(scene, out=tmp_path / "run", isa="sse9")),
        (firn.UsageError, lambda: firn.Session.start(firn.Scene(), out=tmp_path / "run")),
        (firn.Error, lambda: firn.Session.resume(tmp_path / "none")),
        (firn.Error, lambda: firn.Session.render(tmp_path / "none")),
        (TypeError, lambda: firn.Session.start("scene", out=tmp_path / "run")),  # type: ignore[arg-type]
        (TypeError, lambda: firn.Session.start(scene, out=tmp_path / "run", observer=3)),  # type: ignore[arg-type]
        (TypeError, lambda: firn.Session.start(scene, out=tmp_path / "run", progress="no")),
        (TypeError, lambda: firn.Session()),
    ]
    for kind, attempt in attempts:
        with pytest.raises(kind):
            attempt()
        assert list(tmp_path.iterdir()) == []


def test_a_run_is_not_overwritten_silently_and_a_session_runs_once(tmp_path: Path, scene: firn.Scene) -> None:
    session = firn.Session.start(scene, out=tmp_path / "run")
    session.run()
    with pytest.raises(firn.UsageError, match="run already"):
        session.run()
    with pytest.raises(firn.UsageError, match="run already"):
        session.tell("a line of mine")
    assert session.folder == str(tmp_path / "run") and not session.shares
    with pytest.raises(firn.Error):
        firn.Session.start(scene, out=tmp_path / "run")
    firn.Session.start(scene, out=tmp_path / "run", overwrite=True).run()


def test_a_session_tells_lines_of_the_program(tmp_path: Path, scene: firn.Scene) -> None:
    record = Record()
    session = firn.Session.start(scene, out=tmp_path / "run", observer=record)
    session.tell("a line of mine")
    assert record.lines[-1] == "a line of mine"


def test_a_session_that_never_ran_leaves_nothing(tmp_path: Path, scene: firn.Scene) -> None:
    session = firn.Session.start(scene, out=tmp_path / "deep/run")
    del session
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def test_an_observer_that_holds_its_session_is_collected(tmp_path: Path, scene: firn.Scene) -> None:
    record = Record()
    session = firn.Session.start(scene, out=tmp_path / "run", observer=record)
    record.session = session  # type: ignore[attr-defined]
    gone = weakref.ref(session)
    session.run()
    del session, record
    gc.collect()
    assert gone() is None


def test_the_manifest_tells_the_line_of_the_program(tmp_path: Path, scene: firn.Scene) -> None:
    firn.Session.start(scene, out=tmp_path / "run").run()
    assert "test_session.py:" in (tmp_path / "run/run.json").read_text()


def test_sessions_are_not_copied(tmp_path: Path, scene: firn.Scene) -> None:
    session = firn.Session.start(scene, out=tmp_path / "run")
    for way in (copy.copy, pickle.dumps):
        with pytest.raises(TypeError, match="resume"):
            way(session)  # type: ignore[operator]


def test_a_bar_is_drawn_when_it_is_wanted(tmp_path: Path, scene: firn.Scene, capsys: pytest.CaptureFixture[str]) -> None:
    firn.Session.start(scene, out=tmp_path / "silent").run()
    assert capsys.readouterr() == ("", "")
    firn.Session.start(scene, out=tmp_path / "bar", progress=True).run()
    assert "100" in capsys.readouterr().err


def test_results_are_told_in_a_line() -> None:
    def told(interrupted: bool, nothing_to_do: bool) -> str:
        return repr(firn.SessionResult(interrupted, nothing_to_do, 3, (3, 4), ()))

    assert told(False, False) == "<firn.SessionResult: complete>"
    assert told(False, True) == "<firn.SessionResult: the run was complete>"
    assert told(True, False) == "<firn.SessionResult: interrupted, 3 frames kept, 2 left>"
