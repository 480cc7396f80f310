# SPDX-License-Identifier: MIT
"""C++ is formatted by clang-format 14 and .clang-format. Other versions format differently, so without version 14 this
check is skipped, aloud."""
import shutil
import subprocess
import sys

import tree


def find_formatter():
    for name in ("clang-format-14", "clang-format"):
        program = shutil.which(name)
        if program and " 14." in subprocess.run([program, "--version"], capture_output=True, text=True).stdout:
            return program
    return None


def not_formatted(program, paths):
    """The paths whose text the formatter would change. One call for all: a start of the program takes as long as a
    file."""
    told = subprocess.run([program, "--dry-run", *map(str, paths)], cwd=tree.ROOT, check=True, stderr=subprocess.PIPE,
                          text=True).stderr
    warned = {line.partition(":")[0] for line in told.splitlines() if "-Wclang-format-violations" in line}
    return [path for path in paths if str(path) in warned]


if __name__ == "__main__":
    formatter = find_formatter()
    if not formatter:
        print("SKIPPED: clang-format 14 is not installed")
        sys.exit(77)
    sources = tree.files(".h", ".cpp")
    wrong = [f"{path}: not formatted; run './dev format'" for path in not_formatted(formatter, sources)]
    tree.finish(wrong, len(sources))
