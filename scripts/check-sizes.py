#!/usr/bin/env python3
"""Lists C++ files above 1,200 lines and functions above 150 (signature to closing brace, lambdas inside included) in
the given folders, or in the whole project. It reads code as clang-format leaves it: a function's opening brace has a
line of its own. Exit code 1 when something is listed.
"""
import os
import re
import subprocess
import sys

MOST_FILE_LINES = 1200
MOST_FUNCTION_LINES = 150
ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ENDINGS = (".h", ".hpp", ".cxx", ".cpp", ".c")
SKIPPED = {"build", "demo-output", "validation-output", ".git"}
NOT_CODE = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"([^()\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'', re.S)
SCOPE = re.compile(r"(?:inline\s+)?(?:namespace|class|struct|union|enum|extern)\b(?!.*\)\s*(?:const)?\s*$)", re.S)


def sources(folders):
    """C++ files that git tracks, or all of a source archive."""
    try:
        names = subprocess.run(["git", "ls-files", "--", *folders], cwd=ROOT, check=True, capture_output=True,
                               text=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        names = []
        for top in folders or ["."]:
            for folder, inner, files in os.walk(os.path.join(ROOT, top)):
                inner[:] = [name for name in inner if name not in SKIPPED]
                names += [os.path.relpath(os.path.join(folder, name), ROOT) for name in files]
    return sorted(name for name in names if name.endswith(ENDINGS) and os.path.exists(os.path.join(ROOT, name)))


def blank(match):
    """Nothing of a comment or string but its line ends."""
    return "\n" * match.group().count("\n")


def functions(code):
    """Name, first and last line of each function that stands in no other."""
    inside = []  # of each open brace: whether it is a namespace or type
    head, start, line = "", 0, 1
    name, first, depth = "", 0, None
    for piece in re.findall(r"[{};]|\n|[^{};\n]+", code):
        if piece == "\n":
            line += 1
            head += " "
        elif piece == "{":
            scope = depth is None and SCOPE.match(re.sub(r"^template\s*<.*?>\s*(?=\w)", "", head.strip())) is not None
            if depth is None and not scope and "(" in head and head.endswith((" ", "\t")):
                name = (re.search(r"(?!__)\b[~\w:]+(?:\s*operator[^\w\s]+)?(?=\s*\()", head) or re.search(r"\w+", head)).group()
                first, depth = start, len(inside)
            inside.append(scope)
            head = ""
        elif piece == "}":
            if inside:
                inside.pop()
            if depth is not None and len(inside) == depth:
                yield name, first, line
                depth = None
            head = ""
        elif piece == ";":
            head = ""
        else:
            if not head.strip() and piece.strip() and not piece.lstrip().startswith("#"):
                head, start = "", line
            if not piece.lstrip().startswith("#"):
                head += piece


def main():
    found = []
    for path in sources(sys.argv[1:]):
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            text = file.read()
        lines = text.count("\n")
        if lines > MOST_FILE_LINES:
            found.append((lines, f"{path}: {lines} lines"))
        for name, first, last in functions(NOT_CODE.sub(blank, text)):
            if last - first + 1 > MOST_FUNCTION_LINES:
                found.append((last - first + 1, f"{path}:{first}: {name}: {last - first + 1} lines"))
    for _, message in sorted(found, reverse=True):
        print(message)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
