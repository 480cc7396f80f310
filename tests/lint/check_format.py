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


def is_formatted(program, path):
    formatted = subprocess.run([program, str(path)], cwd=tree.ROOT, check=True, capture_output=True, text=True).stdout
    return formatted == tree.read(path)


if __name__ == "__main__":
    formatter = find_formatter()
    if not formatter:
        print("SKIPPED: clang-format 14 is not installed")
        sys.exit(77)
    sources = tree.files(".h", ".cpp")
    wrong = [f"{path}: not formatted; run './dev format'" for path in sources if not is_formatted(formatter, path)]
    tree.finish(wrong, len(sources))
