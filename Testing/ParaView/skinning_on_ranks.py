"""Weights, pose and moved mesh on two ranks are those on one; a mesh in pieces is moved in pieces."""
import json
import os
import sys

from paraview import servermanager, simple

import coronary_testing
from coronary_testing import digest, fetch, load_plugin, skinning_pipeline, write_skeleton

# `require` by its full name: ParaView runs the script of a programmable filter among ours, with all of NumPy's.
plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])


load_plugin(plugin)
coronary_testing.require_ranks(ranks)
os.makedirs(folder, exist_ok=True)
weights, pose, moved = skinning_pipeline(write_skeleton(folder))
found = []
for name, source in (("weights", weights), ("pose", pose), ("moved", moved)):
    found += [name] + digest(coronary_testing.fetch_whole(source, 0, 0.0))
# A mesh whose pieces are on all ranks, with weights that follow from the place: each rank moves its own.
BIND = """
import numpy
points = inputs[0].Points
at = numpy.clip((points[:, 2] + 10.0) / 5.0, 0.0, 3.999)
bone = numpy.floor(at).astype(numpy.int32)
other = numpy.where(at - bone < 0.5, bone - 1, bone + 1)
exists = (other >= 0) & (other < 4)
share = numpy.where(exists, abs(at - bone - 0.5), 0.0)
output.PointData.append(numpy.stack([bone, numpy.where(exists, other, -1)], 1), "BoneIndices")
output.PointData.append(numpy.stack([1.0 - share, share], 1).astype(numpy.float32),
                        "BoneWeightsCompact")
"""
bound = simple.ProgrammableFilter(simple.FindSource("Mesh"), Script=BIND, CopyArrays=1)
skeleton = simple.FindSource("Skeleton")
apart = simple.SkinDeformation(bound, SkeletonAtRest=skeleton, PosedSkeleton=pose,
                               Blend="Dual Quaternion", InvertedTetrahedra="Report")
apart.UpdatePipeline()
cells = apart.GetDataInformation(0).GetNumberOfCells()
own = fetch(apart, 0, 0.0).GetNumberOfCells()
coronary_testing.require(own == cells if ranks == 1 else 0 < own < cells,
                         "%d of %d cells on the first rank" % (own, cells))
gathered = servermanager.filters.ReductionFilter(
    Input=apart, PostGatherHelperName="vtkAppendFilter")
gathered.UpdatePipeline()
data = gathered.GetClientSideObject().GetOutputDataObject(0)
wanted = fetch(moved, 0, 0.0).GetNumberOfCells()
coronary_testing.require(cells == data.GetNumberOfCells() == wanted,
                         "%d cells on all ranks, not %d" % (cells, wanted))
here = coronary_testing.places(data)

coronary_testing.compare_with_one_rank(folder, ranks, found)
places_path = os.path.join(folder, "one-rank.json")
if ranks == 1:
    with open(places_path, "w") as file:
        json.dump(here, file)
else:
    # Single precision is centred on the piece: equal to its rounding.
    with open(places_path) as file:
        there = json.load(file)
    coronary_testing.require([tuple(rest) for rest, _ in there] == [rest for rest, _ in here],
                             "other points")
    step = coronary_testing.largest_difference(there, here)
    coronary_testing.require(step < 1e-5, "a point is %g mm elsewhere" % step)
