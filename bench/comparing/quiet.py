# SPDX-License-Identifier: MIT
"""What else the machine did meanwhile, from /proc: the share of the processors that other processes took, and what the
host of a virtual machine took away."""
import os
import time
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
DOUBTFUL = 0.05  # a share of all processors beyond which the figures are doubtful
BUSY = 0.2  # of one processor: a process that is named


def clock():
    """Seconds that all processors were busy, and that the host took, since the machine started; None where unknown."""
    try:
        fields = [int(word) for word in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    except (OSError, ValueError):
        return None
    user, nice, system, idle, wait, irq, softirq, stolen = (field / TICKS for field in fields)
    return {"busy": user + nice + system + irq + softirq, "stolen": stolen, "all": sum(fields) / TICKS}


def shares(before, after, wall, own, cores):
    """(share of the processors that others took, share that the host took) during `wall` seconds in which our own run
    took `own` processor seconds; None where the counts make no sense, as in some containers."""
    room = wall * cores
    if not before or not after or after["all"] - before["all"] < 0.5 * room:
        return None
    others = after["busy"] - before["busy"] - own
    return max(0.0, others / room), max(0.0, (after["stolen"] - before["stolen"]) / room)


def processes():
    """{process: (name, processor seconds so far)}."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            head, _, tail = (folder / "stat").read_text().rpartition(")")
            fields = tail.split()
            found[folder.name] = (head.partition("(")[2], (int(fields[11]) + int(fields[12])) / TICKS)
        except (OSError, ValueError, IndexError):
            continue  # it has just ended
    return found


def busy_processes(seconds=0.5):
    """Names of the processes that are at work now, with none of ours running."""
    before = processes()
    time.sleep(seconds)
    names = set()
    for process, (name, used) in processes().items():
        # One that has just begun spent all its time within these seconds.
        if process != str(os.getpid()) and used - before.get(process, (name, 0.0))[1] > BUSY * seconds:
            names.add(name)
    return sorted(names)


def load():
    try:
        return os.getloadavg()[0]
    except OSError:
        return None


def warnings(seen):
    """Sentences about a measurement that something disturbed. `seen` is what the record keeps."""
    names = f" ({', '.join(seen['busy'])})" if seen["busy"] else ""
    if seen["others"] is None:
        if seen["busy"]:
            yield f"other processes were at work{names}: the figures are doubtful"
    elif seen["others"] > DOUBTFUL:
        yield f"other processes{names} took up to {seen['others']:.0%} of the processors during a run: the figures are doubtful"
    if seen["stolen"] is not None and seen["stolen"] > DOUBTFUL:
        yield f"the host took up to {seen['stolen']:.0%} of the processors away during a run: the figures are doubtful"
