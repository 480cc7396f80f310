# SPDX-License-Identifier: MIT
"""The record of comparisons, bench/compared/MACHINE.jsonl: one line a comparison, each a JSON object. Lines are only ever
added, so those of two branches merge without a conflict of contents."""
import json
import os
import platform
from datetime import datetime, timezone
from pathlib import Path

from comparing.sides import RECORDS, ROOT
from record import rounded

FIELDS = ["date", "machine", "this", "other", "command", "isa", "pairs", "same_work", "interference", "notes", "figures"]


def cpu_lines(text):
    """The first processor's "key : value" lines of /proc/cpuinfo."""
    pairs = (line.partition(":") for line in text.split("\n\n", 1)[0].splitlines())
    return {key.strip(): value.strip() for key, _, value in pairs}


def machine(cpuinfo=None):
    """The processor as firn-bench names it (bench/machine.cpp), how many of it, and the kernel's version."""
    lines = cpu_lines(Path("/proc/cpuinfo").read_text() if cpuinfo is None else cpuinfo)
    vendor, family, model = (lines.get(key, "") for key in ("vendor_id", "cpu family", "model"))
    return {"cpu": f"{lines.get('model name', '')} (family {family}, model {model})",
            "slug": f"{vendor}-{family}-{model}".lower(), "cores": len(os.sched_getaffinity(0)), "kernel": platform.release().partition("-")[0]}


def side_entry(side):
    named = {"asked": side.asked} if side.asked else {}
    return {"commit": side.commit[:12], **named, "dirty": side.dirty, "compiler": side.compiler}


def figure_entry(figure):
    return {"better": figure.better, "this": figure.this, "other": figure.other,
            "ratio": {"median": figure.median, "min": min(figure.ratios), "max": max(figure.ratios)}}


def entry(this, other, command, isa, pairs, same_work, interference, notes, figures):
    """What is kept of a comparison. same_work: whether both made the same pictures; None where that is not known."""
    values = [datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"), machine(), side_entry(this), side_entry(other),
              command.replace(f"{ROOT}/", ""), isa, pairs, same_work, interference, notes,
              {figure.name: figure_entry(figure) for figure in figures}]
    return rounded(dict(zip(FIELDS, values)))


def add(kept, folder=ROOT / RECORDS):
    path = folder / (kept["machine"]["slug"] + ".jsonl")
    folder.mkdir(exist_ok=True)
    with path.open("a", encoding="utf-8") as out:
        out.write(json.dumps(kept, ensure_ascii=False) + "\n")
    return path
