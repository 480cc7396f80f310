# SPDX-License-Identifier: MIT
"""The program is hardened as meson.build asks: position independent, its tables read-only before main, returns guarded,
known buffers checked. Skipped for builds with a sanitizer or without optimisation, which do without.

usage: check_hardening.py PROGRAM COMPILER    (COMPILER: gcc or clang, whose checks of buffers leave no trace here)"""
import re
import subprocess
import sys

import tree


def output(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True, env={"LC_ALL": "C", "PATH": "/usr/bin:/bin"}).stdout


if __name__ == "__main__":
    program, compiler = sys.argv[1:]
    symbols = output("nm", "--dynamic", "--undefined-only", program)
    if re.search(r"\b__(asan|tsan|ubsan)_", symbols):
        print("SKIPPED: this build has a sanitizer")
        sys.exit(77)
    header, segments, dynamic = (output("readelf", "--wide", what, program)
                                 for what in ("--file-header", "--program-headers", "--dynamic"))
    held = {
        "it is no position-independent executable (b_pie)": re.search(r"Type:\s+DYN", header),
        "its relocations stay writable (-Wl,-z,relro)": "GNU_RELRO" in segments,
        "its functions are bound late (-Wl,-z,now)": re.search(r"BIND_NOW|FLAGS_1\).*\bNOW\b", dynamic),
        "its stack may hold code": not re.search(r"GNU_STACK.*RWE", segments),
        "no return is guarded (-fstack-protector-strong)": "__stack_chk_fail" in symbols,
        "no buffer is checked (_FORTIFY_SOURCE)": compiler == "clang" or re.search(r"\b__\w+_chk\b", symbols),
    }
    tree.finish([f"{program}: {complaint}" for complaint, good in held.items() if not good], len(held))
