# SPDX-License-Identifier: MIT
"""The overlap figure: who ran when, with circulating slots and with one slot, from the trace.json of two runs.
Makes docs/figures/overlap.svg and prints the wall times. Runs the demo scene twice (once with --no-overlap).

usage: overlap.py [RUN_WITH_OVERLAP RUN_WITHOUT]"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "svg"))
from plot import Plot  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
STAGES = ["simulate", "trace", "write"]
ROWS = {8: "3 slots", 3: "1 slot"}  # at which height


def make_run(folder, *words):
    subprocess.run([ROOT / "build/firn", "run", ROOT / "scenes/two_snowballs.toml", "--quick", "--out", folder, *words],
                   check=True, stdout=subprocess.DEVNULL)
    return folder


def intervals(run):
    events = json.loads((Path(run) / "trace.json").read_text())["traceEvents"]
    return [event for event in events if event["ph"] == "X"]


def main(with_overlap, without):
    plot = Plot("Who works when: stages of the frames of one run", "s since the start of the run", "", y_range=(0, 11))
    for (middle, name), run in zip(ROWS.items(), (with_overlap, without)):
        events = intervals(run)
        for stage in STAGES:
            ink, height = STAGES.index(stage), middle + 1 - STAGES.index(stage)
            label = stage if middle == 8 else None
            for event in (event for event in events if event["cat"] == stage):
                left = event["ts"] / 1e6
                plot.box(left, left + event["dur"] / 1e6, height - 0.4, height + 0.4, ink, label)
                label = None
        print(f"{name}: {max(event['ts'] + event['dur'] for event in events) / 1e6:.2f} s")
    plot.save(ROOT / "docs/figures/overlap.svg", ROWS)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        main(*sys.argv[1:])
    else:
        with tempfile.TemporaryDirectory() as scratch:
            main(make_run(f"{scratch}/overlap"), make_run(f"{scratch}/sequence", "--no-overlap"))
