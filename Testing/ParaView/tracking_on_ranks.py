"""A tree tracked, regularised and interpolated on two ranks is that on one."""
import sys

from paraview import servermanager

from coronary_testing import (TRACKED_LINES, TRACKED_SKELETON, compare_with_one_rank, digest,
                              fetch_whole, load_plugin, require, require_ranks, tracking_pipeline)

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])

load_plugin(plugin)
require_ranks(ranks)
_, tracker, regularized, moment = tracking_pipeline()
found = []
for name, source, port, time in (("lines", tracker, TRACKED_LINES, 0.35),
                                 ("skeleton", tracker, TRACKED_SKELETON, 0.2),
                                 ("lines", tracker, TRACKED_LINES, 0.75),
                                 ("regularized", regularized, 0, 0.35),
                                 ("moment", moment, 0, 0.41)):
    found += [name] + digest(fetch_whole(source, port, time))
compare_with_one_rank(folder, ranks, found)
require(servermanager.ActiveConnection is not None, "the session is gone")
