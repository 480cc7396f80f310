#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Packages of firn for the Debian or Ubuntu that this runs on: what `meson install` brings, divided as PACKAGES says, with
the dependencies that dpkg-shlibdeps finds on this system. The same commit, compiler and libraries make the same bytes.

There is no debhelper: its folder debian/ would say again in five files what meson.build says, and could not package a build
folder that is there already, as the tests do.

usage: make.py [--build FOLDER] [--out FOLDER] [--quickly]
       --build     the installation of this build folder (a fresh one for /usr in build-packages/build)
       --out       where the packages go (build-packages)
       --quickly   without compression, for tests"""
import argparse
import email.utils
import gzip
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class Package:
    """Its fields, and the installed files that it holds, below the prefix ('**' for whatever is below a folder)."""
    name: str
    section: str
    summary: str
    description: str
    files: list
    depends: list = field(default_factory=list)  # beside what dpkg-shlibdeps finds
    recommends: list = field(default_factory=list)
    multi_arch: str = "same"
    needs_of_static: bool = False  # recommends what the static library is linked with
    shared_library: bool = False
    python_module: bool = False  # for the one version of Python that it was built for; left out where none was built


# A file goes to the first package that names it; each has to go somewhere.
def packages(libdir, soversion):
    library = f"libfirn{soversion}"
    return [
        Package("firn", "graphics", "snow, simulated and path traced on CPUs",
                "firn simulates elastoplastic snow with a material point method and path traces the same particles, frame by frame, "
                "on CPUs. One command goes from a scene file to frames and a movie. This package holds the program, scenes to begin "
                "with, and the documents.",
                ["bin/firn", "share/firn/**", "share/doc/firn/**", "share/man/**", "share/bash-completion/**", "share/fish/**",
                 "share/zsh/**"], recommends=["ffmpeg"], multi_arch="foreign"),
        Package(library, "libs", "snow, simulated and path traced on CPUs (shared library)",
                "firn simulates elastoplastic snow with a material point method and path traces the same particles. This package holds "
                "the library for programs that are linked with it.",
                [f"{libdir}/libfirn.so.*"], shared_library=True),
        Package("libfirn-dev", "libdevel", "snow, simulated and path traced on CPUs (for development)",
                "firn simulates elastoplastic snow with a material point method and path traces the same particles. This package holds "
                "the headers, the static library, and what pkg-config and CMake ask. The packages that it recommends are for "
                "programs that are linked with the static library.",
                ["include/firn/**", f"{libdir}/libfirn.a", f"{libdir}/libfirn.so", f"{libdir}/pkgconfig/**", f"{libdir}/cmake/firn/**"],
                depends=[f"{library} (= {{version}})"], needs_of_static=True),
        Package("python3-firn", "python", "snow, simulated and path traced on CPUs (Python 3 module)",
                "firn simulates elastoplastic snow with a material point method and path traces the same particles. This package holds "
                "the Python module: scenes, simulations with their particles as NumPy arrays, and runs.",
                ["lib/python3/dist-packages/firn/**"], depends=["python3-numpy"], recommends=["python3-tqdm"], multi_arch="",
                python_module=True),
    ]


def output(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, stdout=subprocess.PIPE, text=True, **options).stdout


def call(*words):
    """What it says goes to the error stream: the standard output holds the names of packages."""
    subprocess.run([str(word) for word in words], check=True, stdout=sys.stderr)


def commit_said(form):
    """Of the commit that is packaged, as git log has it; empty outside of git."""
    done = subprocess.run(["git", "log", "-1", f"--format={form}"], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip()


def maintainer():
    """Who packages, where the variables of Debian's tools say so, or else who made the commit."""
    name, address = os.environ.get("DEBFULLNAME"), os.environ.get("DEBEMAIL")
    return f"{name} <{address}>" if name and address else commit_said("%an <%ae>") or "The firn authors"


def build_for_packages(folder):
    if not (folder / "build.ninja").exists():
        libdir = "lib/" + output("dpkg-architecture", "-qDEB_HOST_MULTIARCH").strip()
        call("meson", "setup", folder, "--prefix=/usr", f"--libdir={libdir}", "-Dzsh_completions=share/zsh/vendor-completions",
             "-Dtests=false", "-Dbench=false", "-Dpython=enabled")
    call("ninja", "-C", folder)


class Installation:
    """What a build folder installs, in a folder of its own."""

    def __init__(self, build, root):
        options = {o["name"]: o["value"] for o in json.loads(output("meson", "introspect", "--buildoptions", build))}
        self.version = json.loads(output("meson", "introspect", "--projectinfo", build))["version"]
        self.soversion = ".".join(self.version.split(".")[:2])
        self.prefix, self.libdir = Path(options["prefix"].lstrip("/")), options["libdir"]
        call("meson", "install", "-C", build, "--no-rebuild", "--quiet", "--destdir", root)
        self.root = root
        self.paths = sorted(p.relative_to(root / self.prefix) for p in root.rglob("*") if not p.is_dir() or p.is_symlink())

    def divided(self):
        """[(package, its paths)]; complains of a path that none wants."""
        known, left = packages(self.libdir, self.soversion), list(self.paths)
        parts = []
        for package in known:
            wanted = [path for path in left if any(matches(path, pattern) for pattern in package.files)]
            left = [path for path in left if path not in wanted]
            if wanted or not package.python_module:
                parts.append((package, wanted))
        if left or not all(wanted for _, wanted in parts):
            sys.exit(f"packages/make.py: in no package: {', '.join(map(str, left)) or 'nothing'}; "
                     f"empty: {', '.join(package.name for package, wanted in parts if not wanted) or 'none'}")
        return parts


def matches(path, pattern):
    return path.as_posix().startswith(pattern[:-2]) if pattern.endswith("/**") else path.match(pattern) and path.parent == Path(pattern).parent


def binaries(stage):
    """Programs and shared libraries."""
    return [p for p in sorted(stage.rglob("*")) if p.is_file() and not p.is_symlink() and p.open("rb").read(4) == b"\x7fELF"]


def contents(stage):
    """All but what is for dpkg itself."""
    return [p for p in sorted(stage.rglob("*")) if p.relative_to(stage).parts[0] != "DEBIAN"]


def strip(stage):
    for binary in binaries(stage):
        call("strip", "--strip-unneeded", "--remove-section=.comment", "--remove-section=.note", binary)
    for archive in stage.rglob("*.a"):
        call("strip", "--strip-debug", "--enable-deterministic-archives", archive)


def compress(path):
    path.with_name(path.name + ".gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
    path.unlink()


def shared_depends(stage, before, installation):
    """What the binaries of a package need on this system, and of the packages that were made before."""
    found = binaries(stage)
    if not found:
        return []
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "debian").mkdir()
        (Path(folder) / "debian/control").write_text("Source: firn\n\nPackage: firn\nArchitecture: any\n")
        ours = [word for other in before for word in (f"-S{other}", f"-l{other / installation.prefix / installation.libdir}")]
        said = output("dpkg-shlibdeps", "-O", *ours, *[f"-e{binary}" for binary in found], cwd=folder)
    return re.search(r"^shlibs:Depends=(.*)$", said, re.M)[1].split(", ")


def needs_of_static(folder):
    """The packages of this system with what pkg-config names for the static library."""
    environment = os.environ | {"PKG_CONFIG_PATH": str(folder)}
    names = output("pkg-config", "--print-requires", "--print-requires-private", "firn-static", env=environment).split("\n")
    files = {Path(output("pkg-config", "--variable=pcfiledir", name.split()[0]).strip(), name.split()[0] + ".pc") for name in names if name}
    return sorted({output("dpkg", "-S", file.resolve()).split(":")[0] for file in files})


def copyright_text():
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8").strip().split("\n")
    holder = next(line for line in licence if line.startswith("Copyright"))
    text = "\n".join(" " + (line or ".") for line in licence[licence.index(holder) + 2:])
    return ("Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: firn\n\n"
            f"Files: *\nCopyright: {re.sub(r'^Copyright *([(]c[)])? *', '', holder)}\nLicense: Expat\n{text}\n")


def changelog_text(version):
    date = email.utils.formatdate(int(os.environ["SOURCE_DATE_EPOCH"]))
    return (f"firn ({version}) unstable; urgency=medium\n\n  * Commit {commit_said('%H') or 'unknown'}.\n  * What changed is in CHANGELOG.md.\n\n"
            f" -- {maintainer()}  {date}\n")


def wrapped(text):
    lines, words = [""], text.split()
    for word in words:
        if len(lines[-1]) + len(word) > 76:
            lines.append("")
        lines[-1] += " " + word
    return "\n".join(lines)


def control_text(package, version, stage, depends, recommends):
    size = sum(-(-p.stat().st_size // 1024) if p.is_file() and not p.is_symlink() else 1 for p in contents(stage))
    fields = {"Package": package.name, "Source": "firn", "Version": version, "Architecture": output("dpkg", "--print-architecture").strip(),
              "Multi-Arch": package.multi_arch, "Maintainer": maintainer(), "Installed-Size": size, "Depends": ", ".join(depends),
              "Recommends": ", ".join(recommends), "Section": package.section, "Priority": "optional"}
    if package.name == "firn":
        del fields["Source"]
    return ("".join(f"{name}: {value}\n" for name, value in fields.items() if value) +
            f"Description: {package.summary}\n{wrapped(package.description)}\n")


def write_control(package, version, stage, depends, recommends):
    sums = [f"{hashlib.md5(p.read_bytes()).hexdigest()}  {p.relative_to(stage)}" for p in contents(stage) if p.is_file() and not p.is_symlink()]
    folder = stage / "DEBIAN"
    (folder / "control").write_text(control_text(package, version, stage, depends, recommends), encoding="utf-8")
    (folder / "md5sums").write_text("\n".join(sums) + "\n", encoding="utf-8")
    if package.shared_library:
        minor = package.name.removeprefix("libfirn")
        (folder / "triggers").write_text("activate-noawait ldconfig\n")
        (folder / "shlibs").write_text(f"libfirn {minor} {package.name} (>= {version})\n")


def python_depends(paths):
    """The version of Python that the module is for, by its name: "_core.cpython-311-x86_64-linux-gnu.so"."""
    major, minor = next(re.match(r"(3)(\d+)", match[1]) for path in paths if (match := re.search(r"\.cpython-(\d+)-", path.name))).groups()
    return [f"python3 (>= {major}.{minor}~)", f"python3 (<< {major}.{int(minor) + 1})"]


def write_scripts_of_python(name, folder):
    """What is compiled when it is installed goes when it is removed."""
    for script, command in (("postinst", "py3compile"), ("prerm", "py3clean")):
        (folder / script).write_text(f"#!/bin/sh\nset -e\n! command -v {command} >/dev/null || {command} -p {name}\n")


def stage_files(package, paths, installation, stage):
    (stage / "DEBIAN").mkdir(parents=True)
    for path in paths:
        target = stage / installation.prefix / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(installation.root / installation.prefix / path, target, follow_symlinks=False)
    strip(stage)
    for page in (stage / installation.prefix / "share/man").rglob("*.[1-9]"):
        compress(page)
    documents = stage / installation.prefix / "share/doc" / package.name
    documents.mkdir(parents=True, exist_ok=True)
    (documents / "copyright").write_text(copyright_text(), encoding="utf-8")
    (documents / "changelog").write_text(changelog_text(installation.version), encoding="utf-8")
    compress(documents / "changelog")


def set_modes(stage):
    """Those of the person who builds are no part of a package."""
    for path in [stage, *stage.rglob("*")]:
        if not path.is_symlink():
            path.chmod(0o755 if path.is_dir() or path.parent.name == "bin" or path.name in ("postinst", "prerm") else 0o644)


def make(package, paths, installation, stage, before, out, compression):
    stage_files(package, paths, installation, stage)
    depends = shared_depends(stage, before, installation) + [word.format(version=installation.version) for word in package.depends]
    recommends = list(package.recommends)
    if package.python_module:
        depends += python_depends(paths)
        write_scripts_of_python(package.name, stage / "DEBIAN")
    if package.needs_of_static:
        recommends += needs_of_static(stage / installation.prefix / installation.libdir / "pkgconfig")
    write_control(package, installation.version, stage, depends, recommends)
    set_modes(stage)
    call("dpkg-deb", "--root-owner-group", *compression, "--build", stage, out)


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1])
    arguments.add_argument("--build", type=Path)
    arguments.add_argument("--out", type=Path, default=ROOT / "build-packages")
    arguments.add_argument("--quickly", action="store_true")
    asked = arguments.parse_args()
    os.environ.setdefault("SOURCE_DATE_EPOCH", commit_said("%ct") or "0")
    os.environ["LC_ALL"] = "C.UTF-8"
    build = asked.build or ROOT / "build-packages/build"
    if not asked.build:
        build_for_packages(build)
    asked.out.mkdir(parents=True, exist_ok=True)
    for old in asked.out.glob("*.deb"):
        old.unlink()
    compression = ["-Znone"] if asked.quickly else ["-Zxz", "--threads-max=1"]
    with tempfile.TemporaryDirectory(prefix="firn-packages-") as folder:
        installation = Installation(build, Path(folder, "root"))
        stages = []
        for package, paths in installation.divided():
            stage = Path(folder, package.name)
            make(package, paths, installation, stage, stages, asked.out, compression)
            stages.append(stage)
    for made in sorted(asked.out.glob("*.deb")):
        print(made)


if __name__ == "__main__":
    main()
