# SPDX-License-Identifier: MIT
"""The integrators at equal error: seconds x mean squared error of each on the scenes of bench/integrators, of which the
least is best. Errors come from pictures of different seeds, half of their mean squared difference, so they know nothing
of an integrator's bias; the pictures' means are printed for that. Seconds are those of a frame's tracing, the least of
the seeds', with the gridding of the snow and the choice of `auto`. What the choice costs is timed by itself too: `auto`
draws the picture of the integrator that it takes, so its time over the rest of it is its price, whatever the clock did
between two pictures. For a quiet machine; takes some minutes. --curve: a table for docs/figures/light.py.

usage: integrators.py FIRN [--curve FILE] [--threads N] [--seeds N] [--integrators A,B] [--set KEY=VALUE]... [SCENE...]"""
import argparse
import array
import itertools
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = Path(__file__).resolve().parent / "integrators"
# Each takes about as long as the others.
SAMPLES = {
    "sun_on_slab": {"path": 32, "bidirectional": 4, "light": 8},
    "ball_lit_from_behind": {"path": 64, "bidirectional": 8, "light": 32},
    "lamp_in_cave": {"path": 16, "bidirectional": 1, "light": 8},
    "snowball_in_cornell_box": {"path": 32, "bidirectional": 4, "light": 32},
    "lamp_to_ceiling": {"path": 64, "bidirectional": 32, "light": 64},
}


def picture(path):
    """All values of a PFM file."""
    return array.array("f", Path(path).read_bytes().split(b"\n", 3)[3])


def render(firn, scene, seed, settings, folder):
    """The picture, its seconds, those of the choice, and the integrator that made it."""
    words = [firn, "render", scene, "--seed", seed, "--quiet", "--overwrite", "--out", folder]
    words += [word for setting in settings for word in ("--set", setting)]
    subprocess.run(list(map(str, words)), check=True, stdout=subprocess.DEVNULL)
    frame = json.loads((Path(folder) / "frames.jsonl").read_text().splitlines()[0])
    return picture(next(Path(folder).glob("frames/*.pfm"))), frame["trace_s"], frame["choice_s"], frame["integrator"].split(":")[0]


def measure(firn, name, integrator, seeds, settings):
    samples = SAMPLES[name].get(integrator, max(SAMPLES[name].values()))
    settings = [f"image.integrator={integrator}", f"image.samples={samples}", *settings]
    with tempfile.TemporaryDirectory() as folder:
        runs = [render(firn, SCENES / f"{name}.toml", seed, settings, folder) for seed in range(1, seeds + 1)]
    pictures = [run[0] for run in runs]
    seconds = min(run[1] for run in runs)
    pairs = itertools.combinations(pictures, 2)
    square = statistics.mean(sum((x - y) ** 2 for x, y in zip(a, b)) / (2 * len(a)) for a, b in pairs)
    mean = statistics.mean(sum(values) / len(values) for values in pictures)
    price = max(run[1] / (run[1] - run[2]) for run in runs)
    return {"integrator": integrator, "took": runs[0][3], "price": price, "samples": samples, "seconds": seconds, "mean": mean,
            "rmse": square**0.5 / mean, "cost": seconds * square}


def add_curve(path, name, rows):
    """A scene's rows in place of those that the table has of it."""
    head = "series,seconds,noise"
    others = [line for line in (path.read_text().splitlines()[1:] if path.exists() else []) if not line.startswith(f"{name}:")]
    own = [f"{name}:{row['integrator']},{row['seconds']:.3f},{row['rmse']:.6f}" for row in rows]
    path.write_text("\n".join([head, *others, *own]) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("firn")
    parser.add_argument("scenes", nargs="*", default=list(SAMPLES))
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--integrators", default="path,bidirectional,light,auto")
    parser.add_argument("--curve", type=Path)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    given = parser.parse_intermixed_args()
    print("| scene | integrator | samples | s | RMSE / mean | mean | s x MSE over the best | with the choice |")
    print("|---|---|---|---|---|---|---|---|")
    for name in given.scenes:
        rows = [measure(given.firn, name, integrator, given.seeds, given.settings)
                for integrator in given.integrators.split(",")]
        best = min(row["cost"] for row in rows if row["integrator"] in ("path", "bidirectional"))
        for row in rows:
            took = f" ({row['took']})" if row["integrator"] == "auto" else ""
            print(f"| {name} | {row['integrator']}{took} | {row['samples']} | {row['seconds']:.2f} | "
                  f"{row['rmse']:.4f} | {row['mean']:.4f} | {row['cost'] / best:.2f} | {row['price']:.3f} |")
            sys.stdout.flush()
        if given.curve:
            add_curve(given.curve, name, rows)


main()
