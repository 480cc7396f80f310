# SPDX-License-Identifier: MIT
"""The reference of the library (docs/api) is whole: Doxygen finds nothing without a comment, every class of include/firn has
its page, every public function is on the page of its class or of the namespace. Skipped, aloud, where there is no Doxygen."""
import html
import re
import shutil
import sys
import tempfile
from pathlib import Path

import tree

sys.path.insert(0, str(tree.ROOT / "docs/api"))
import filter as comments  # noqa: E402
import make  # noqa: E402

SCOPE = re.compile(r"\b(namespace|class|struct|enum(?: class)?)\s+(?:FIRN_API\s+)?(\w+)(?:\s*:[^:{][^{]*)?$")
FUNCTION = re.compile(r"(operator\s*(?:\[\]|\W{1,3}|[\w:<> ]+)|~?\b\w+)\s*\(")
ACCESS = r"\b(?:public|private|protected)\s*:(?!:)"
PART = re.compile(rf"{ACCESS}|[{{}};]|(?:(?!{ACCESS})[^{{}};])+")
CLASSES = ("class", "struct")


def plain(text):
    """A header without comments, texts and lines of the preprocessor."""
    text = re.sub(r"//.*", "", text)
    text = re.sub(r'"(\\.|[^"\\])*"', '""', text)
    return re.sub(r"^#.*$", "", text, flags=re.M)


def function_in(head):
    """The name of the function that is declared, or ""."""
    if re.search(r"\b(friend|using)\b", head):
        return ""
    head = re.sub(r"template\s*<[^>]*>|\s=\s.*", "", head, flags=re.S)
    found = FUNCTION.search(head)
    return found[1] if found and not head[:found.start()].endswith("::") else ""


def declared(text):
    """(class or "", function or "") of all that a header declares in public; a class itself has no function."""
    scopes, found, head = [], [], ""  # of scopes: kind, name, whether what follows is public
    for part in PART.findall(plain(text)):
        named = SCOPE.search(head.strip())
        if re.match(ACCESS, part):
            scopes[-1][2] = part.startswith("public")
        elif part in "{;":
            owner = "::".join(name for kind, name, _ in scopes if kind in CLASSES)
            if all(public and kind in ("namespace", *CLASSES) for kind, _, public in scopes):
                if named and part == "{" and named[1] in CLASSES:
                    found.append((f"{owner}::{named[2]}".strip(":"), ""))
                elif not named and function_in(head):
                    found.append((owner, function_in(head)))
            if part == "{":
                scopes.append([named[1] if named else "body", named[2] if named else "", not named or named[1] != "class"])
        elif part == "}":
            scopes.pop()
        else:
            head += part
            continue
        head = ""
    return found


def page_of(folder, owner):
    if not owner:
        return folder / "namespacefirn.html"
    pages = [folder / (kind + "firn_1_1" + owner.replace("::", "_1_1") + ".html") for kind in CLASSES]
    return next((page for page in pages if page.exists()), pages[0])


def names_on(page, function):
    text = html.unescape(re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8")))
    spelled = r"\s*".join(map(re.escape, re.findall(r"\w+|\S", function)))
    return re.search(rf"(?<!\w){spelled}\s*\(", text) is not None


def missing(folder, names):
    for owner, function in sorted(names):
        page = page_of(folder, owner)
        if not page.exists():
            yield f"'{owner or 'namespace firn'}' has no page in the reference"
        elif function and not names_on(page, function):
            yield f"'{owner}::{function}' is not on the page of '{owner or 'firn'}'"


def changed(path):
    """Whether Doxygen is shown other code than the compiler, or other lines."""
    code = tree.read(path)
    shown = "\n".join(comments.Filter(code.splitlines()).run()) + "\n"
    bare = re.sub(r"/\*.*?\*/|//.*", "", shown, flags=re.S)
    same = re.sub(r"\s+", "", bare) == re.sub(r"\s+", "", re.sub(r"/\*.*?\*/|//.*", "", code))
    return not same or shown.count("\n") != code.count("\n")


if __name__ == "__main__":
    if not shutil.which("doxygen"):
        print("SKIPPED: doxygen is not installed")
        sys.exit(77)
    headers = tree.files(".h", under=["include"])
    names = {name for path in headers for name in declared(tree.read(path))}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary, "api")
        wrong = make.make(folder)
        wrong += [f"{path}: docs/api/filter.py changes more than comments" for path in headers if changed(path)]
        wrong += missing(folder, names)
        if not (folder / "index.html").exists():
            wrong.append("the reference has no first page")
    tree.finish(wrong, len(names))
