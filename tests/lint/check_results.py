# SPDX-License-Identifier: MIT
"""The tables of docs/kernels.md are those that bench/table.py makes of bench/results, and every command of a run is one
that firn-bench would take today."""
import json
import sys

import tree

sys.path.insert(0, str(tree.ROOT / "bench"))
import record  # noqa: E402
import table  # noqa: E402

if __name__ == "__main__":
    wrong, checked = [], 1
    page = tree.read("docs/kernels.md")
    if table.with_tables(page) != page:
        wrong.append("docs/kernels.md: its tables are not those of bench/results; run 'python3 bench/table.py'")
    for path in tree.files(".json", under=["bench"]):
        checked += 1
        results = json.loads(tree.read(path))
        if path.stem != results["machine"]["slug"]:
            wrong.append(f"{path}: holds the figures of {results['machine']['slug']}")
        for name, run in results["runs"].items():
            command = "build/bench/firn-bench " + " ".join(record.RUNS.get(name, ["?"]))
            if run["command"] != command:
                wrong.append(f"{path}: '{name}' was run as '{run['command']}', not as bench/record.py has it")
    tree.finish(wrong, checked)
