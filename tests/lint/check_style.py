# SPDX-License-Identifier: MIT
"""House rules that a machine can see: licence lines, #pragma once, file length, names that say nothing, leftovers."""
import re

import tree

LICENSE = "SPDX-License-Identifier: MIT"
LONGEST = 440  # lines; about 400 is the rule
# Words that name no thing. `firn info` is a command that users know by this name.
EMPTY_WORDS = r"manager|helper|util|utils|utility|info|data|misc|common"
EMPTY_NAME = re.compile(rf"(^|_)({EMPTY_WORDS})(_|\.|$)")
EMPTY_TYPE = re.compile(r"^\s*(?:class|struct|enum class)\s+\w*(Manager|Helper|Helpers|Util|Utils|Info|Data)\b", re.M)
ALLOWED_NAMES = {"src/app/info.cpp"}
PROGRAMS = [".ci/run", ".ci/full", ".ci/chroot"]
LEFTOVER = re.compile(r"\b(TO" r"DO|FIX" r"ME|HA" r"CK|X" r"XX)\b|/home/\w|/root/\w")


def check_license(path, lines):
    head = lines[1:2] if lines and lines[0].startswith("#!") else lines[:1]
    return None if head and LICENSE in head[0] else f"the first line is not '{LICENSE}'"


def check_text(path, text):
    lines = text.splitlines()
    yield check_license(path, lines)
    if path.suffix == ".h" and "#pragma once" not in lines:
        yield "no #pragma once"
    if path.suffix in (".h", ".cpp") and len(lines) > LONGEST:
        yield f"{len(lines)} lines: about 400 is the most"
    if match := EMPTY_TYPE.search(text):
        yield f"'{match.group(0).strip()}': a name should say what the thing is"
    for number, line in enumerate(lines, 1):
        if match := LEFTOVER.search(line):
            yield f"line {number}: '{match.group(0)}'"
        if line != line.rstrip() or "\t" in line:
            yield f"line {number}: blank at the end, or a tab"


def check_path(path):
    if EMPTY_NAME.search(path.name) and path.as_posix() not in ALLOWED_NAMES:
        yield "a file's name should say what is in it"


if __name__ == "__main__":
    sources = tree.files(".h", ".cpp", ".py", ".in", "meson.build", ".sh")
    sources += [p.relative_to(tree.ROOT) for p in tree.ROOT.glob("meson*")] + [tree.Path(name) for name in ("dev", *PROGRAMS)]
    wrong = []
    for source in sources:
        complaints = [*check_path(source), *check_text(source, tree.read(source))]
        wrong += [f"{source}: {complaint}" for complaint in complaints if complaint]
    tree.finish(wrong, len(sources))
