"""What the ranks wrote together is what one process computes, to the last bit."""
import os
import re
import sys

from paraview import simple

from coronary_testing import (CENTERLINES, IMAGE, SURFACE, content, fetch, load_plugin,
                              quick_phantom, require)

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])
load_plugin(plugin)
phantom = quick_phantom()
# The tree by its only piece: ParaView 5.11 crashes on a .pvtp file with an array of strings.
for name, port in (("image.pvti", IMAGE), ("surface.pvtp", SURFACE),
                   ("tree/tree_0.vtp", CENTERLINES)):
    reader = simple.OpenDataFile(os.path.join(folder, name))
    reader.UpdatePipeline()
    written = reader.GetClientSideObject().GetOutputDataObject(0)
    require(written.GetNumberOfPoints() > 0, name + " is empty")
    require(content(written) == content(fetch(phantom, port, 0.35)),
            name + " differs from the serial one")
require(not os.path.exists(os.path.join(folder, "tree", "tree_1.vtp")),
        "the tree has a second piece")

with open(os.path.join(folder, "image.pvti")) as header:
    pieces = re.findall(r'<Piece Extent="([^"]*)"', header.read())
require(len(pieces) == ranks == len(set(pieces)), "the image was not split: %s" % pieces)
print("%d ranks: image in %s" % (ranks, "; ".join(pieces)))
