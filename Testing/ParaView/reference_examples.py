"""The Python examples of README and all reference pages: as they stand there, and in ReferenceExamplesDistracted once more
with another source active before every statement, which may change nothing. The plugin is found as README says."""
import ast
import contextlib
import glob
import io
import os
import re
import sys

from paraview import simple

from coronary_testing import require, write_series, write_tree

folder, sources, test = sys.argv[1:4]


def prepare():
    """The files that the examples name as the user's own."""
    os.chdir(folder)
    for name in glob.glob("*"):
        if os.path.isfile(name) and name != "server.log":
            os.remove(name)
    write_tree("tree.tgf", 8.0)
    write_series("series.json", [0.1, 0.6], 850)
    with open("mask.mha", "wb") as file:
        file.write(b"ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\n"
                   b"ElementType = MET_UCHAR\nBinaryData = True\nElementDataFile = LOCAL\n")
        file.write(bytes(n % 2 for n in range(24)))


def examples():
    """The code of each page."""
    found = {}
    for path in [os.path.join(sources, "README.md")] + sorted(glob.glob(os.path.join(sources, "docs/reference/vtk*.md"))):
        with open(path, encoding="utf-8") as file:
            blocks = re.findall(r"^```python\n(.*?)^```", file.read(), re.S | re.M)
        require(len(blocks) == 1, "%s has %d examples" % (path, len(blocks)))
        found[os.path.basename(path)[:-3]] = blocks[0]
    return found


def printed(name, code):
    """What the code prints, in a session of its own."""
    simple.ResetSession()
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out):
            exec(compile(code, name, "exec"), {"__name__": "__main__"})
    except Exception as error:
        sys.exit("FAILED: %s: %s: %s" % (name, type(error).__name__, error))
    require(out.getvalue().strip() or name == "README", "%s prints nothing" % name)
    return out.getvalue()


def distracted(code):
    """The code with a source of other arrays active before each statement."""
    statements = ["import paraview.simple as other\ndecoy = other.Wavelet(WholeExtent=[0, 4, 0, 4, 0, 4])\n"
                  "decoy.UpdatePipeline()\nother_lines = other.Line()\nother_lines.UpdatePipeline()\n"]
    for number, statement in enumerate(ast.parse(code).body):
        statements.append("other.SetActiveSource(%s)\n" % ("decoy" if number % 2 else "other_lines"))
        statements.append(ast.unparse(statement) + "\n")
    return "".join(statements)


prepare()
for page, text in examples().items():
    first = printed(page, text)
    print("%s: %s" % (page, " ".join(first.split())), flush=True)
    if test == "ReferenceExamples":
        continue
    second = printed(page, distracted(text))
    require(first == second, "%s prints %r, with other sources active %r" % (page, first, second))
