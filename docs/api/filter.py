# SPDX-License-Identifier: MIT
"""Shows Doxygen the comments of a header as comments of the reference, line by line, and the text otherwise as it is:

- the head of the file is about the file;
- a comment stands for the declaration below it, and for those that follow without a blank line or a comment of their own;
- a comment at the end of a line stands for what the line declares;
- members that every reader of C++ knows (copies, moves, begin() ...) need no comment, and get the usual words.

In docs/library.md links to other documents lead from the reference back to the tree.

usage: filter.py FILE    (to stdout, as Doxygen asks of an INPUT_FILTER)"""
import re
import sys
from pathlib import Path

USUAL = [(re.compile(pattern), words) for pattern, words in (
    (r".*\(const (\w+)&\)( = delete)$", "It cannot be copied."),
    (r"(\w+)\(const \1& ?\w*\)$", "Copies."),
    (r"(\w+)\(\1&& ?\w*\)( noexcept)?$", "Moves: what is left may only be assigned to or destroyed."),
    (r"(\w+)& operator=\(\1( \w+)?\)( noexcept)?$", "Copies or moves."),
    (r"(\w+)& operator=\(\1&& ?\w*\)( noexcept)?$", "Moves: what is left may only be assigned to or destroyed."),
    (r"(virtual )?~\w+\(\)", "Ends it, and gives back what it holds."),
    (r"\w+\(\) = default$", "Empty."),
    (r".*\bsize\(\) const", "How many there are."),
    (r".*\bempty\(\) const", "Whether there are none."),
    (r".*\bdata\(\)", "Where the entries begin."),
    (r".*\bbegin\(\)", "The first entry."),
    (r".*\bend\(\)", "Past the last entry."),
    (r".*\boperator\[\]", "The entry with this number, which is not checked."),
    (r"operator std::span", "A view of the entries."),
    (r"friend bool operator==", "Whether all entries are equal."),
)]
COMMENT = re.compile(r"(\s*)//\s?(.*)$")
TRAILING = re.compile(r"(\s*)(\S.*?)\s+// (.*)$")


def escape(text):
    """What Markdown or Doxygen would take for something else, outside of `code`."""
    parts = text.split("`")
    parts[::2] = [re.sub(r"([@#])", r"\\\1", part).replace("<", "&lt;").replace("*", "&lowast;") for part in parts[::2]]
    return "`".join(parts)


def usual_words(code):
    declaration = re.sub(r"\s*[;{].*$", "", code)
    return next((words for pattern, words in USUAL if pattern.match(declaration)), "")


def kind_of_scope(head):
    """What a brace opens: declarations, names of an enum, or the body of something."""
    if re.search(r"\benum\b", head):
        return "enum"
    is_scope = re.search(r"\b(namespace|class|struct)\b", head) and not re.search(r"[()=]", head)
    return "declarations" if is_scope else "body"


class Filter:
    def __init__(self, lines):
        self.lines = lines
        self.scopes = ["declarations"]
        self.statement = ""  # what was begun and is not ended
        self.forget()
        self.out = []

    def forget(self):
        self.above = []     # the comment above, or that of the declarations before
        self.fresh = False  # nothing was declared below it yet

    def run(self):
        for number, line in enumerate(self.lines):
            if "body" in self.scopes:
                self.out.append(line)
                self.follow(line)
            elif not line.strip():
                self.forget()
                self.out.append(line)
            elif COMMENT.match(line) and not self.statement:
                self.comment(number, line)
            else:
                self.code(line)
        return self.out

    def comment(self, number, line):
        """A line of a block of comments, which becomes one comment."""
        indent, text = COMMENT.match(line).groups()
        if number == 0:
            self.out.append("/** @file")  # where the licence was
            return
        begins, ends = (not COMMENT.match(self.lines[other]) for other in (number - 1, number + 1))
        if begins:
            self.forget()
        self.fresh = True
        self.above.append(text)
        self.out.append(indent + ("/** " if begins else "") + escape(text) + (" */" if ends else ""))

    def code(self, line):
        begins = not self.statement
        trailing = TRAILING.match(line)
        indent, code, text = trailing.groups() if trailing else (re.match(r"\s*", line)[0], line.strip(), "")
        declares = begins and not re.match(r"[}]|#(?!define)|public:|private:|namespace\b|template class", code)
        if not declares and begins:
            self.forget()
        words = escape(text) or ("" if self.fresh else escape(usual_words(code)) or escape(" ".join(self.above)))
        if declares and words:
            self.out.append(f"{indent}/** {words} */ {code}")
        else:
            self.out.append(f"{indent}{code}" + (f"  ///< {words}" if text and words and not declares and not begins else ""))
        if declares:
            self.fresh = False
        self.follow(code)

    def follow(self, line):
        """Which scopes are open after this line of code, and whether a statement is."""
        code = re.sub(r'"(\\.|[^"\\])*"|//.*', '""', line)
        if code.lstrip().startswith("#"):
            return
        for part in re.findall(r"[{};,:]|[^{};,:]+", code):
            if part == "{":
                self.scopes.append(kind_of_scope(self.statement))
                self.statement = ""
                if self.scopes[-1] != "body":
                    self.forget()
            elif part == "}":
                self.scopes.pop()
                self.statement = ""
            elif part == ";" or part == "," and self.scopes[-1] == "enum":
                self.statement = ""
            else:
                self.statement += part.strip() and part
        if re.match(r"\s*(public|private|protected):$", code):
            self.statement = ""


def filter_document(text):
    """Links to other files of the tree, as seen from build/docs/api, where the reference lies."""
    text = re.sub(r"\[([^]]+)\]\(\.\./([^)]+)\)", r'<a href="../../../\2">\1</a>', text)
    return re.sub(r"\[([^]]+)\]\((\w+\.md[^)]*)\)", r'<a href="../../../docs/\2">\1</a>', text)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    source = path.read_text(encoding="utf-8")
    print(filter_document(source) if path.suffix == ".md" else "\n".join(Filter(source.splitlines()).run()))
