"""Executes a notebook as a reader would, and looks at what it shows: run_notebook.py NOTEBOOK PROGRAMS WORK."""

import os
import re
import sys

try:
    import ipykernel  # noqa: F401
    import matplotlib  # noqa: F401
    import nbformat
    from nbconvert.preprocessors import ExecutePreprocessor
except ImportError as error:
    print("skipped: %s (Debian: python3-nbconvert, python3-ipykernel, python3-matplotlib)" % error)
    sys.exit(125)

notebook, programs, work = sys.argv[1:]
os.environ["PATH"] = programs + os.pathsep + os.environ["PATH"]
book = nbformat.read(notebook, as_version=4)
ExecutePreprocessor(timeout=500, kernel_name="python3").preprocess(book, {"metadata": {"path": work}})
nbformat.write(book, os.path.join(work, "executed.ipynb"))

outputs = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
pictures = sum("image/png" in output.get("data", {}) for output in outputs)
text = "".join(output.get("text", "") for output in outputs if output.output_type == "stream")
print(text)
worst = re.search(r"^worst +([0-9.]+) +([0-9.]+) +([0-9.]+)", text, re.MULTILINE)
if pictures < 5 or not worst:
    sys.exit("FAILED: %d pictures; the last row of Table 1 is %s" % (pictures, worst and worst.group(0)))
# The voxels have 0.7 mm.
if float(worst.group(1)) > 1.4 or float(worst.group(2)) > 0.7:
    sys.exit("FAILED: the model is further from the truth than two voxels, or a voxel in the mean: " + worst.group(0))
