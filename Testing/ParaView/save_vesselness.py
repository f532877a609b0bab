"""Writes vesselness and segmentation of a phantom, each MPI rank its part."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (CENTERLINES, IMAGE, fetch, load_plugin, quick_phantom, require)

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])
load_plugin(plugin)
process = servermanager.vtkProcessModule.GetProcessModule()
require(process.GetNumberOfLocalPartitions() == ranks, "%d ranks, not %d"
        % (process.GetNumberOfLocalPartitions(), ranks))
phantom = quick_phantom()
phantom.AutomaticGrid = 0
phantom.Origin = [-40.0, -40.0, -60.0]
phantom.Dimensions = [48, 45, 50]
phase = simple.ReferencePhase(simple.OutputPort(phantom, IMAGE))
images = {"series": simple.OutputPort(phantom, IMAGE), "phase": phase}
for name, image in images.items():
    vesselness = simple.FrangiVesselness(image)
    vesselness.SigmaMin = 0.8
    vesselness.GenerateScale = 1
    vesselness.GenerateDirection = 1
    simple.UpdatePipeline(0.35, vesselness)
    # Not the default, appended data: Debian 12's expat keeps this VTK from reading that back.
    path = os.path.join(folder, "%s_%d.pvti" % (name, ranks))
    simple.SaveData(path, proxy=vesselness, DataMode="Binary")

# A place in a vessel well inside of the image.
still = simple.ReferencePhase(simple.OutputPort(phantom, IMAGE), Automatic=0, Time=0.35)
still.UpdatePipeline(0.35)
bounds = still.GetDataInformation(0).GetBounds()
tree = fetch(phantom, CENTERLINES, 0.35)
inside = [point for point in map(tree.GetPoint, range(tree.GetNumberOfPoints()))
          if all(bounds[2 * axis] + 8.0 < point[axis] < bounds[2 * axis + 1] - 8.0
                 for axis in range(3))]
require(inside, "no vessel in the image")
mask = simple.VesselSegmentation(still, AutomaticOstia=0, SeedPoints=list(inside[0]))
simple.UpdatePipeline(0.35, mask)
simple.SaveData(os.path.join(folder, "mask_%d.pvti" % ranks), proxy=simple.OutputPort(mask, 0),
                DataMode="Binary")
