# SPDX-License-Identifier: MIT
"""The overlap figure: who ran when, with circulating slots and with one slot, from the trace.json of two runs.
Makes docs/figures/overlap.png and prints the wall times. Runs the demo scene twice (once with --no-overlap).

usage: overlap.py [RUN_WITH_OVERLAP RUN_WITHOUT]"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[2]
STAGES = ["simulate", "trace", "write"]
COLOURS = {"simulate": "#3b6fb6", "trace": "#e08e2b", "write": "#4f9d69"}


def make_run(folder, *words):
    subprocess.run([ROOT / "build/firn", "run", ROOT / "scenes/two_snowballs.toml", "--quick", "--out", folder, *words],
                   check=True, stdout=subprocess.DEVNULL)
    return folder


def intervals(run):
    events = json.loads((Path(run) / "trace.json").read_text())["traceEvents"]
    return [event for event in events if event["ph"] == "X"]


def draw(axes, events, title):
    for event in events:
        left, width = event["ts"] / 1e6, event["dur"] / 1e6
        axes.barh(2 - STAGES.index(event["cat"]), width, left=left, height=0.8, color=COLOURS[event["cat"]], edgecolor="white",
                  linewidth=0.4)
    axes.set_yticks([2, 1, 0], STAGES)
    axes.set_title(title, loc="left", fontsize=9)


def main(with_overlap, without):
    figure, rows = plt.subplots(2, 1, figsize=(9, 3.6), sharex=True)
    for axes, run, title in zip(rows, (with_overlap, without), ("three slots", "one slot (--no-overlap)")):
        events = intervals(run)
        wall = max(event["ts"] + event["dur"] for event in events) / 1e6
        draw(axes, events, f"{title}: {wall:.1f} s")
        print(f"{title}: {wall:.2f} s")
    rows[1].set_xlabel("s since the start of the run")
    figure.tight_layout()
    figure.savefig(ROOT / "docs/figures/overlap.png", dpi=160)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        main(*sys.argv[1:])
    else:
        with tempfile.TemporaryDirectory() as scratch:
            main(make_run(f"{scratch}/overlap"), make_run(f"{scratch}/sequence", "--no-overlap"))
