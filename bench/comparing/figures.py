# SPDX-License-Identifier: MIT
"""Figures of two sides, pair by pair. A report of firn-bench is flattened into named leaves; a leaf of which more or less
is better is a figure, any other is a condition, which should be the same on both sides. All ratios say how many times
better this tree is: above 1 it is faster, or takes less memory."""
import re
import statistics
from dataclasses import dataclass
from fnmatch import fnmatchcase

# What names an entry of a list in firn-bench's reports.
LABELS = ["name", "kernel", "snow", "rays", "footprint", "mean_free_paths_a_cell"]
# What is of the machine or the moment, and so neither figure nor condition.
IGNORED = re.compile(r"^(machine\..*|compiler|fma_peak|memory_bandwidth|(.*\.)?(bound|floor_ns|eigen_ns))$")
LOWER = re.compile(r"(^|[._])(ns|ms|s|mb)$|^ms\.|^stages\w*\.|^ns_|(^|\.)bytes_per_particle$|(^|\.)loss$")
HIGHER = re.compile(r"_per_second(_\w+)?$|(^|[._])(mrays|gflops|gbytes)$|floor_share$|(^|\.)ratio(_\w+)?$|^ratios\.")
FEWEST = 5  # pairs; of fewer, noise alone often lies on one side
PROCESS = ["wall_s", "cpu_s", "peak_mb"]
# What is shown without --all; of commands that are not listed everything is.
SHOWN = {
    "sim": ["particle_steps_per_second", "stages.*", "bytes_per_particle"],
    "kernels": ["kernels.*.ns", "svd.*.ns"],
    "resting": ["ns_with_sleep", "ns_without", "ratio"],
    "trace": ["tracers.firn.*"],
    "preview": ["ms.*", "frames_per_second_*"],
    "sphere": ["paths_per_second"],
    "mesh": ["build_ms", "*_mrays"],
    "medium": ["flights.*"],
    "rule": ["rule.*.rule_mrays"],
    "frame": ["trace_s", "rays_per_second", "choice_s"],
    "movie": ["simulate_s", "trace_s", "write_s", "particle_steps_per_second", "rays_per_second", "bytes_per_particle"],
}


def label_of(item, index):
    if isinstance(item, dict):
        words = [f"{item[key]:g}" if isinstance(item[key], float) else str(item[key]) for key in LABELS if key in item]
        return " ".join(words) or str(index)
    return str(index)


def flat(value, name=""):
    """{"a.b": leaf} of nested objects and lists; an entry of a list is called by what names it, or by its place."""
    if isinstance(value, dict):
        items = [(key, inner) for key, inner in value.items()]
    elif isinstance(value, list):
        items = [(label_of(inner, index), inner) for index, inner in enumerate(value)]
    else:
        return {name: value}
    leaves = {}
    for key, inner in items:
        leaves.update(flat(inner, f"{name}.{key}" if name else str(key)))
    return leaves


def better(name):
    """"lower", "higher", or None of a condition."""
    if IGNORED.match(name):
        return None
    return "lower" if LOWER.search(name) else "higher" if HIGHER.search(name) else None


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def shown(command, names, everything):
    """The figures to print, those of the process first, in the order of the report."""
    patterns = ["*"] if everything or command not in SHOWN else SHOWN[command]
    rest = [name for name in names
            if name not in PROCESS and better(name) and any(fnmatchcase(name, pattern) for pattern in patterns)]
    return [name for name in PROCESS if name in names] + rest


@dataclass
class Figure:
    name: str
    better: str
    this: list
    other: list
    ratios: list  # one a pair: how many times better this tree is

    @property
    def median(self):
        return statistics.median(self.ratios)

    @property
    def verdict(self):
        """A difference is one that every pair shows, in the digits that are printed; of few pairs it is doubtful."""
        least, most = (round(bound(self.ratios), 3) for bound in (min, max))
        if least <= 1 <= most:
            return "no difference seen"
        return ("better" if least > 1 else "worse") + ("?" if len(self.ratios) < FEWEST else "")


def ratio(name, this, other):
    return this / other if better(name) == "higher" else other / this


def compare(name, this, other):
    """A figure of the values of both sides, pair by pair, or why there is none."""
    if not any(this) and not any(other):
        return None, None
    lacking = [side for side, values in (("this tree", this), ("the other", other)) if not all(map(is_number, values))]
    if lacking:
        return None, f"{name}: missing in {' and '.join(lacking)}"
    if not all(value > 0 for value in this + other):
        return None, f"{name}: not above zero, so without a ratio"
    return Figure(name, better(name), this, other, [ratio(name, a, b) for a, b in zip(this, other)]), None


def compare_all(command, this, other, everything):
    """Figures of the runs of both sides (a list of {name: value} each), and what could not be compared."""
    names = list(dict.fromkeys(name for run in [*this, *other] for name in run))
    figures, lacking = [], []
    for name in shown(command, names, everything):
        figure, why = compare(name, [run.get(name) for run in this], [run.get(name) for run in other])
        figures += [figure] if figure else []
        lacking += [why] if why else []
    return figures, lacking


def different_conditions(this, other):
    """What should be the same on both sides and is not: the two did not do the same work."""
    names = [name for name in this if name in other and not better(name) and not IGNORED.match(name)]
    return [f"{name} is {this[name]} in this tree, {other[name]} in the other" for name in names if this[name] != other[name]]


def number(value):
    for size, letter in ((1e9, " G"), (1e6, " M")):
        if value >= size:
            return f"{value / size:.4g}{letter}"
    return f"{value:.4g}"


def table(figures):
    """Rows with aligned columns."""
    rows = [["figure", "this tree", "the other", "times better: median [min … max]", ""]]
    for f in figures:
        spread = f"{f.median:.3f} [{min(f.ratios):.3f} … {max(f.ratios):.3f}]"
        sides = [number(statistics.median(values)) for values in (f.this, f.other)]
        rows.append([f"{f.name} ({f.better} is better)", *sides, spread, f.verdict])
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:4], widths[1:4])), row[4]]
        yield "  ".join(cells).rstrip()
