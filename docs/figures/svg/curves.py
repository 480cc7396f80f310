# SPDX-License-Identifier: MIT
"""The tables that tests write for figures (tests/curve.h)."""
import csv


def read(path):
    """{series: {column: numbers}}, in the order of the file."""
    table = {}
    with open(path, newline="") as lines:
        for row in csv.DictReader(lines):
            of_series = table.setdefault(row.pop("series"), {})
            for name, value in row.items():
                of_series.setdefault(name, []).append(float(value))
    return table
