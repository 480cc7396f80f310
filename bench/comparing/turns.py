# SPDX-License-Identifier: MIT
"""Runs of both sides in turns. The order changes from pair to pair (AB BA AB ...), so that a machine that grows slower
or faster meanwhile favours neither side."""
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from comparing import quiet
from comparing.sides import Refusal

KIB_A_MB = 1024


def processors():
    """Those that this process may use."""
    return len(os.sched_getaffinity(0))


def order(pairs):
    """Which side runs when: 0 is this tree, 1 the other."""
    return [(0, 1) if pair % 2 == 0 else (1, 0) for pair in range(pairs)]


@dataclass
class Runs:
    """Of each run of a side, in the order of the pairs."""
    figures: list = field(default_factory=list)
    pictures: set = field(default_factory=set)
    conditions: dict = field(default_factory=dict)


def end(process):
    """Ends a run that is no longer wanted: asks first, since firn tidies up when it is interrupted."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def timed(words, log):
    """(exit code, {wall_s, cpu_s, peak_mb}) of a program, its children included."""
    with open(log, "wb") as out:
        start = time.perf_counter()
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
        try:
            _, status, used = os.wait4(process.pid, 0)
        except BaseException:
            end(process)
            raise
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
    figures = {"wall_s": wall, "cpu_s": used.ru_utime + used.ru_stime, "peak_mb": used.ru_maxrss / KIB_A_MB}
    return process.returncode, figures


class Measurement:
    """Runs of a work by two sides, and what else was seen meanwhile."""

    def __init__(self, work, sides, folder):
        self.work, self.sides, self.folder = work, sides, Path(folder)
        self.runs = [Runs(), Runs()]
        self.notes = []
        self.cores = processors()
        self.seen = {"load": quiet.load(), "busy": quiet.busy_processes(), "others": None, "stolen": None}

    def attempt(self, at):
        """(exit code, process figures, reading, the end of what it said) of one run of a side."""
        with TemporaryDirectory(dir=self.folder) as out:
            log = Path(out, "said.txt")
            before = quiet.clock()
            try:
                code, figures = timed(self.work.words(self.sides[at], Path(out)), log)
            except OSError as error:
                raise Refusal(f"{error.filename}: {error.strerror}") from None
            self.watch(quiet.shares(before, quiet.clock(), figures["wall_s"], figures["cpu_s"], self.cores))
            said = log.read_text(errors="replace").splitlines()[-8:]
            return code, figures, self.work.read(self.sides[at], Path(out)), said

    def watch(self, shares):
        for name, share in zip(("others", "stolen"), shares or ()):
            self.seen[name] = max(self.seen[name] or 0.0, share)

    def run(self, at):
        """One run of a side, which must succeed."""
        code, figures, reading, said = self.attempt(at)
        if code:
            side = self.sides[at]
            what = "".join(f"  {line}\n" for line in said)
            raise Refusal(f"{side.name} ({side.commit[:12]}) ended with {code}:\n{what}Both sides must take these arguments.",
                          code=1)
        return {**figures, **reading.leaves}, reading

    def warm_up(self):
        """A run of each side that does not count. One that fails tries the work's other way once."""
        for at, side in enumerate(self.sides):
            code = self.attempt(at)[0]
            note = self.work.other_way(side) if code else None
            if note:
                self.notes.append(note)
            if code:
                self.run(at)
        self.seen.update(others=None, stolen=None)

    def pairs(self, count):
        for number, pair in enumerate(order(count), 1):
            for at in pair:
                figures, reading = self.run(at)
                runs = self.runs[at]
                runs.figures.append(figures)
                runs.conditions = runs.conditions or reading.leaves
                runs.pictures |= {reading.pictures} - {""}
            seconds = [runs.figures[-1]["wall_s"] for runs in self.runs]
            print(f"pair {number} of {count}: this tree {seconds[0]:.3g} s, the other {seconds[1]:.3g} s", file=sys.stderr, flush=True)
        self.seen["busy"] = sorted({*self.seen["busy"], *quiet.busy_processes()})
