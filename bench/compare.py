# SPDX-License-Identifier: MIT
"""Is this tree faster than another commit? Builds the other commit beside this one, runs both in turns and prints, figure
by figure, how many times better this tree is: the median over the pairs and the spread. Keeps a line of it in
bench/compared/MACHINE.jsonl. `./dev bench compare` builds this tree before. docs/performance.md says how to read it.

usage: compare.py COMMIT [OPTION...] -- WHAT"""
import argparse
import shlex
import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from comparing import figures, keep, quiet, sides, turns, work
from comparing.sides import Refusal, Side


def parsed(words):
    parser = argparse.ArgumentParser(prog="./dev bench compare", usage="%(prog)s COMMIT|--noise [OPTIONS] -- WHAT",
                                     description=__doc__.split("\n\n")[0], epilog=work.KINDS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", nargs="?", metavar="COMMIT", help="any name of a commit: HEAD~3, a branch, a hash")
    parser.add_argument("--noise", action="store_true", help="this tree against itself: what differs is noise")
    parser.add_argument("--pairs", type=int, default=5, metavar="N", help="runs of each side that count (5)")
    parser.add_argument("--all", action="store_true", help="every figure that the runs tell, not only the usual ones")
    parser.add_argument("--no-record", action="store_true", help="leave nothing in " + sides.RECORDS)
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help="compilers at once for the other commit (all processors)")
    options, what = (words[:words.index("--")], words[words.index("--") + 1:]) if "--" in words else (words, [])
    given = parser.parse_args(options)
    if given.pairs < 1:
        raise Refusal("--pairs: at least one")
    if given.noise == bool(given.commit):
        raise Refusal("name one commit before '--', or --noise" + (" instead of it" if given.commit else ""))
    return given, what


def both_sides(given, programs):
    commit = None if given.noise else sides.resolve(given.commit)
    this = sides.this_side(programs)
    notes = []
    if programs and sides.is_stale(this, programs):
        notes.append("build/ is older than this tree's files: './dev build' before a comparison")
    if given.noise:
        return [this, Side("the other", this.tree, this.build, this.commit, this.dirty, this.compiler, "itself")], notes
    jobs = given.jobs or turns.processors()
    other = sides.other_side(given.commit, commit, programs, this, jobs)
    if other.dirty:
        notes.append(f"the files in {other.tree.relative_to(sides.ROOT)} were changed by hand")
    return [this, other], notes


def describe(side):
    words = [side.commit[:12], f"({side.asked})" if side.asked else "", "with uncommitted changes," if side.dirty else "", side.compiler]
    return f"{side.name}: " + " ".join(word for word in words if word)


def same_work(runs):
    """Whether both sides made the same pictures, None if they made none, and what is to be said of it."""
    notes = [f"the runs of {name} differ among themselves in snow or pictures" for name, own in zip(("this tree", "the other"), runs)
             if len(own.pictures) > 1]
    if not all(own.pictures for own in runs):
        return None, notes
    same = runs[0].pictures == runs[1].pictures
    return same, notes + ([] if same else ["the pictures differ: the two sides did not make the same bits"])


def doubts(pairs, measurement):
    """What limits the figures, in sentences."""
    yield from figures.different_conditions(*(runs.conditions for runs in measurement.runs))
    if pairs == 1:
        yield "one pair only, so nothing is known of the noise"
    elif pairs < figures.FEWEST:
        yield f"{pairs} pairs only: noise alone lies on one side once in {2 ** (pairs - 1)} times"
    yield from quiet.warnings(measurement.seen)


def stamps(both, programs):
    return [Path(side.program(name)).stat().st_mtime_ns for side in both for name in programs]


def compared(given, what, folder):
    """Measures, prints and returns what is to be kept."""
    asked = work.work_of(what)
    (this, other), notes = both_sides(given, asked.programs)
    print(describe(this), describe(other), f"work: {shlex.join(what)}", sep="\n", flush=True)
    before = stamps([this, other], asked.programs)
    measurement = turns.Measurement(asked, [this, other], folder)
    for note in quiet.warnings({**measurement.seen, "others": None}):
        print(f"warning: {note}", file=sys.stderr, flush=True)
    asked.prepare([this, other], measurement.folder)
    measurement.warm_up()
    measurement.pairs(given.pairs)
    if stamps([this, other], asked.programs) != before:
        raise Refusal("a program was built anew during the comparison: nothing can be said of it", code=1)
    runs = measurement.runs
    found, lacking = figures.compare_all(asked.kind, *(own.figures for own in runs), given.all)
    same, differences = same_work(runs)
    notes += measurement.notes + differences + list(doubts(given.pairs, measurement)) + lacking
    print("", *figures.table(found), sep="\n")
    print(*(f"note: {note}" for note in notes), sep="\n", end="\n" if notes else "")
    if same:
        print("Both sides made the same snow and pictures, to the bit.")
    isa = runs[0].conditions.get("isa")
    return keep.entry(this, other, shlex.join(what), isa, given.pairs, same, measurement.seen, notes, found)


def interrupted(number, frame):
    raise KeyboardInterrupt


def main(words):
    signal.signal(signal.SIGTERM, interrupted)
    try:
        given, what = parsed(words)
        with TemporaryDirectory(prefix="firn-compare-") as folder:
            kept = compared(given, what, folder)
        if not given.no_record:
            print(f"Kept in {keep.add(kept).relative_to(sides.ROOT)}.")
    except Refusal as refusal:
        print(f"compare: {refusal}", file=sys.stderr)
        return refusal.code
    except KeyboardInterrupt:
        print("Interrupted: nothing was kept.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
