# SPDX-License-Identifier: MIT
"""The name guard: an archive of kernels that was compiled for one instruction set may define no global or weak symbol
outside its own namespace. A leaked inline function (a std:: template, say) is merged by the linker with other copies of
it, and the copy that wins may hold instructions that this CPU does not have.

usage: check_names.py ISA ARCHIVE [ISA ARCHIVE ...]"""
import re
import subprocess
import sys

import tree


def symbols(archive):
    """Demangled names that other object files could link to."""
    words = ["nm", "--demangle", "--defined-only", "--extern-only", archive]
    listing = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    for line in listing.splitlines():
        fields = line.split(maxsplit=2)
        if len(fields) == 3:
            yield fields[2]


def belongs(name, isa):
    for prefix in ("guard variable for ", "vtable for ", "typeinfo for ", "typeinfo name for "):
        name = name.removeprefix(prefix)
    # A template instance is demangled with its return type in front; its own name follows the last blank before "(".
    # That of a vector, "float __vector(8)", has brackets of its own.
    own = f"firn::kernels::isa_{isa}::"
    return own in re.sub(r"__vector\(\d+\)", "__vector", name).split("(")[0]


if __name__ == "__main__":
    wrong, checked = [], 0
    for isa, archive in zip(sys.argv[1::2], sys.argv[2::2]):
        for symbol in symbols(archive):
            checked += 1
            if not belongs(symbol, isa):
                wrong.append(f"{archive}: {symbol} is outside firn::kernels::isa_{isa}")
    tree.finish(wrong, checked)
