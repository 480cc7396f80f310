# SPDX-License-Identifier: MIT
"""The floors of the house: a room includes only rooms below it, kernels/ includes only kernels/, include/ and examples/
only the public headers, and the libraries that
decide about time (flow graph, parallel loops) or cost compile time stay behind one door each."""
import re

import tree

BELOW = {
    "core": [],
    "geometry": ["core"],
    "particles": ["core"],
    "mpm": ["core", "geometry", "particles"],
    "render": ["core", "geometry", "particles"],
    "scene": ["core", "geometry", "particles", "mpm", "render", "io"],
    "io": ["core", "geometry", "particles", "mpm", "render"],
    "graph": ["core", "geometry", "particles", "mpm", "render", "scene", "io"],
    "session": ["core", "geometry", "particles", "mpm", "render", "scene", "io", "graph"],
    "app": ["core", "geometry", "particles", "mpm", "render", "scene", "io", "graph", "session"],
}
PUBLIC = ["include", "examples"]  # what others see: nothing of src/ or of the libraries that it uses
KERNEL_SYSTEM_HEADERS = {"bit", "cmath", "cstddef", "cstdint", "cstring", "immintrin.h", "limits", "type_traits"}
ONE_FILE_LIBRARIES = ["toml++/", "CLI/", "nlohmann/", "tiny_obj_loader.h", "png.h", "xxhash.h", "webp/", "zlib.h"]
INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]', re.M)


def room_of(path):
    return path.parts[1] if path.parts[0] == "src" else path.parts[0]


def own_header(path):
    header = path.with_suffix(".h")
    return header.as_posix() if path.suffix == ".cpp" and (tree.ROOT / header).exists() else None


def check_kernel_include(kind, name):
    if kind == "<" and name not in KERNEL_SYSTEM_HEADERS:
        return f"kernels are pure functions on plain arrays and do not need <{name}>"
    if kind == '"' and not name.startswith("kernels/"):
        return f'kernels include only kernels/, not "{name}"'
    return None


def check_room_include(path, name):
    room = room_of(path)
    if name.startswith("firn/"):
        return None
    if room in PUBLIC:
        return f'{room}/ includes only firn/ and the standard library, not "{name}"'
    if name.startswith("kernels/reference/"):
        return "the reference kernels are for tests and benches"
    if name.startswith("src/"):
        other = name.split("/")[1]
        if other != room and other not in BELOW.get(room, []):
            return f'src/{room} may not include "{name}": it may use {", ".join(BELOW.get(room, [])) or "nothing"}'
    elif not name.startswith("kernels/") and "/" in name:
        return f'"{name}" is not included from the repository root'
    return None


def check_tbb(path, text):
    inside = path.as_posix()
    complaints = []
    if re.search(r"\btbb::flow\b|tbb/flow_graph\.h", text) and not inside.startswith("src/graph/"):
        complaints.append("the flow graph is known only to src/graph")
    loops = r"\btbb::parallel_\w+|tbb/(parallel_\w+|blocked_range\w*)\.h|std::execution|#pragma omp"
    if re.search(loops, text) and inside != "src/core/parallel.h":
        complaints.append("parallel loops go through src/core/parallel.h")
    return complaints


def check_file(path):
    text = tree.read(path)
    includes = INCLUDE.findall(text)
    complaints = check_tbb(path, text)
    for kind, name in includes:
        if kind == "<" and path.parts[0] in PUBLIC and "/" in name and not name.startswith("firn/"):
            complaints.append(f"{path.parts[0]}/ includes only firn/ and the standard library, not <{name}>")
        if path.parts[0] == "kernels":
            complaints.append(check_kernel_include(kind, name))
        elif kind == '"':
            complaints.append(check_room_include(path, name))
    own = own_header(path)
    if own and (not includes or includes[0][1] != own):
        complaints.append(f'its own header "{own}" does not come first')
    return [f"{path}: {complaint}" for complaint in complaints if complaint]


def check_one_door(sources):
    complaints = []
    for library in ONE_FILE_LIBRARIES:
        users = [p.as_posix() for p in sources if any(n.startswith(library) for _, n in INCLUDE.findall(tree.read(p)))]
        if len(users) > 1:
            complaints.append(f"{library} is included by {', '.join(users)}: a library has one translation unit")
    return complaints


def check_rooms():
    rooms = {path.parts[1] for path in tree.files(".h", ".cpp", under=["src"])}
    return [f"src/{room} has no floor in this check" for room in sorted(rooms - BELOW.keys())]


if __name__ == "__main__":
    sources = tree.files(".h", ".cpp", under=["include", "examples", "src", "kernels"])
    wrong = check_rooms() + check_one_door([p for p in sources if p.parts[0] == "src"])
    for source in sources:
        wrong += check_file(source)
    tree.finish(wrong, len(sources))
