# SPDX-License-Identifier: MIT
"""Slow: every scene that moves, at its --quick size, simulated for some seconds. All numbers stay finite, no particle is
lost, and no lone particle hangs still in the air at the end. As many scenes run side by side as there are cores, each on
one thread: small scenes leave two threads idle for a third of the time.

usage: test_scenes.py FIRN [SECONDS]      5 if not said"""
import array
import concurrent.futures
import csv
import math
import os
import resource
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "scenes"
# The longest first, so that the cores end together.
SCENES = ["boot_print", "powder_and_crust", "two_snowballs", "snowball_drop", "plough", "broken_snowball_2d", "slab_release",
          "rolling_ball", "snowball_vs_sheet", "avalanche", "snowfall", "snowball_into_sheet", "column_collapse", "falling_sheet"]
FPS = 4
STILL = 0.01  # m/s: free fall passes it in a millisecond
EMPTY_CELLS = 3  # a particle is in the air if its column of cells is empty that far below and around


def columns(path):
    """World positions (m), speeds and dx of a particle file; the format stands in src/io/particle_file.h."""
    raw = path.read_bytes()
    ox, oy, oz, dx, count = struct.unpack_from("<4dQ", raw, 24)
    floats = array.array("f")
    floats.frombytes(raw[72:72 + 6 * 4 * count])
    x, y, z, u, v, w = (floats[k * count:(k + 1) * count] for k in range(6))
    return [(ox + a, oy + b, oz + c) for a, b, c in zip(x, y, z)], [math.hypot(*velocity) for velocity in zip(u, v, w)], dx


def hanging(path, rest_height):
    """Still particles without neighbours, higher than any that rests on something near them."""
    places, speeds, dx = columns(path)
    cells = {}
    for index, place in enumerate(places):
        cells.setdefault(tuple(math.floor(c / dx) for c in place), []).append(index)
    near = range(-EMPTY_CELLS, EMPTY_CELLS + 1)
    found = 0
    for (i, j, k), inside in cells.items():
        if len(inside) > 1 or speeds[inside[0]] > STILL or places[inside[0]][1] < rest_height:
            continue
        around = ((i + a, j + b, k + c) for a in near for b in near for c in near)
        found += sum(cell in cells for cell in around) == 1
    return found


def failure(firn, scene, seconds, out):
    """What is wrong with this scene, or None."""
    last = round(seconds * FPS)
    words = [firn, "simulate", FOLDER / f"{scene}.toml", "--quick", "--quiet", "--threads", "1", "--out", out, "--set", "time.speed=1",
             "--set", f"time.fps={FPS}", "--set", f"time.frames={last + 1}"]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        return f"exit code {done.returncode}: {done.stderr.strip()}"
    with open(out / "metrics.csv", newline="") as lines:
        rows = list(csv.DictReader(lines))
    for row in rows:
        if not all(math.isfinite(float(value)) for name, value in row.items() if name != "dt_cause"):
            return f"frame {row['frame']}: a number is not finite"
        if int(row["particles"]) + int(row["particles_left"]) != int(rows[0]["particles"]):
            return f"frame {row['frame']}: particles are lost"
    # Colliders may carry still particles up to where the snow stood first; above the middle of that nothing may rest.
    rest = (float(rows[0]["min_y_m"]) + float(rows[0]["max_y_m"])) / 2
    still = hanging(out / "particles" / f"{last:04}.firn", rest)
    return f"{still} particles hang in the air" if still else None


def processor_seconds():
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def result(firn, scene, seconds):
    """(what is wrong or None, seconds, seconds of the processor). A worker does one scene at a time."""
    begin, begin_processor = time.monotonic(), processor_seconds()
    with tempfile.TemporaryDirectory() as scratch:
        wrong = failure(firn, scene, seconds, Path(scratch, "run"))
    return wrong, time.monotonic() - begin, processor_seconds() - begin_processor


if __name__ == "__main__":
    failed, program, length = 0, sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 5
    with concurrent.futures.ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        results = {pool.submit(result, program, scene, length): scene for scene in SCENES}
        for done in concurrent.futures.as_completed(results):
            wrong, seconds, processor = done.result()
            print(f"{results[done]}: {wrong or 'ok'} ({seconds:.0f} s, {processor:.0f} of a core)", flush=True)
            failed += bool(wrong)
    print(f"{len(SCENES) - failed} passed, {failed} failed")
    sys.exit(1 if failed else 0)
