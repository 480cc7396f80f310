#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A wheel of firn that holds the libraries it is linked with, so that `pip install` of it needs no package of the system
beside glibc, libstdc++ and libgcc. What goes in is what `pip wheel` made; the libraries are those of this system, under names
of their own, since other packages may bring their own oneTBB.

usage: wheel.py WHEEL OUT      needs patchelf"""
import base64
import hashlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

# What every Linux for which there are wheels has.
OF_THE_SYSTEM = re.compile(r"^(ld-linux-x86-64|libc|libm|libdl|libpthread|librt|libstdc\+\+|libgcc_s)\.so")


def output(*words):
    return subprocess.run([str(word) for word in words], check=True, stdout=subprocess.PIPE, text=True).stdout


def needed(binary):
    """The names in its dynamic section."""
    return re.findall(r"\(NEEDED\).*\[(.+)\]", output("readelf", "-d", "-W", binary))


def found(binary):
    """Where the loader of this system finds them, by name, with those of all of them."""
    paths = dict(re.findall(r"^\s*(\S+) => (/\S+)", output("ldd", binary), re.M))
    missing = re.findall(r"^\s*(\S+) => not found", output("ldd", binary), re.M)
    if missing:
        sys.exit(f"wheel.py: {binary.name} needs {', '.join(missing)}, which is not found")
    return {name: Path(path) for name, path in paths.items() if not OF_THE_SYSTEM.match(name)}


def bring_in(module, folder):
    """Copies what the module needs into the folder, and makes all of it look there."""
    libraries = found(module)
    if not libraries:
        return []
    folder.mkdir()
    names = {}
    for name, path in libraries.items():
        mark = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        names[name] = f"{name.split('.so')[0]}-{mark}.so{name.split('.so', 1)[1]}"
        shutil.copyfile(path, folder / names[name])
    for new in names.values():
        patch(folder / new, names, "$ORIGIN", "--set-soname", new)
    patch(module, names, f"$ORIGIN/../{folder.name}")
    return list(libraries.values())


def patch(binary, names, where, *more):
    # One name at a time: patchelf 0.14 mixes up the versions of symbols when it is told several.
    for name in needed(binary):
        if name in names:
            subprocess.run(["patchelf", "--replace-needed", name, names[name], binary], check=True)
    subprocess.run(["patchelf", "--set-rpath", where, *more, binary], check=True)


def oldest_glibc(binaries):
    """The version of glibc that all of them can do with."""
    versions = [tuple(map(int, found)) for binary in binaries
                for found in re.findall(r"GLIBC_(\d+)\.(\d+)", output("readelf", "-V", "-W", binary))]
    return max(versions)


def licences(libraries, folder):
    """What the system's packages say of the libraries that come along."""
    folder.mkdir(exist_ok=True)
    for library in libraries:
        done = subprocess.run(["dpkg", "-S", library.resolve()], capture_output=True, text=True)
        package = done.stdout.split(":")[0]
        text = Path("/usr/share/doc", package, "copyright")
        if package and text.exists():
            shutil.copyfile(text, folder / f"{package}.txt")


def write_record(root, folder):
    rows = []
    for path in sorted(p for p in root.rglob("*") if p.is_file() and p.name != "RECORD"):
        digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()
        rows.append(f"{path.relative_to(root).as_posix()},sha256={digest},{path.stat().st_size}")
    rows.append(f"{(folder / 'RECORD').relative_to(root).as_posix()},,")
    (folder / "RECORD").write_text("\n".join(rows) + "\n")


def pack(root, out):
    """The same bytes for the same files."""
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path in sorted(p for p in root.rglob("*") if p.is_file()):
            entry = zipfile.ZipInfo(path.relative_to(root).as_posix(), (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (0o755 if path.suffix == ".so" or ".so." in path.name else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, path.read_bytes())


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    wheel, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="firn-wheel-") as folder:
        root = Path(folder)
        with zipfile.ZipFile(wheel) as packed:
            packed.extractall(root)
        for rest in root.glob("*.data"):  # version 0.12 of meson-python packs the program and the headers too
            shutil.rmtree(rest)
        module = next(root.glob("firn/_core*.so"))
        facts = next(root.glob("*.dist-info"))
        subprocess.run(["strip", "--strip-unneeded", module], check=True)
        libraries = bring_in(module, root / "firn.libs")
        licences(libraries, facts / "licenses-of-libraries")
        tag = "manylinux_{}_{}_x86_64".format(*oldest_glibc(root.rglob("*.so*")))
        told = (facts / "WHEEL").read_text()
        (facts / "WHEEL").write_text(told.replace("linux_x86_64", tag))
        write_record(root, facts)
        made = out / wheel.name.replace("linux_x86_64", tag)
        pack(root, made)
    print(made)


if __name__ == "__main__":
    main()
