"""Under MPI: writes image, surface and tree of a phantom, each rank its part."""
import os
import sys

from paraview import servermanager, simple

from coronary_testing import CENTERLINES, IMAGE, SURFACE, load_plugin, quick_phantom, require

plugin, folder, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])
load_plugin(plugin)
options = servermanager.vtkProcessModule.GetProcessModule()
require(options.GetNumberOfLocalPartitions() == ranks, "%d ranks, not %d"
        % (options.GetNumberOfLocalPartitions(), ranks))
phantom = quick_phantom()
simple.GetAnimationScene().AnimationTime = 0.35
for name, port in (("image.pvti", IMAGE), ("surface.pvtp", SURFACE), ("tree.pvtp", CENTERLINES)):
    output = simple.OutputPort(phantom, port)
    simple.UpdatePipeline(0.35, output)
    # Not the default, appended data: Debian 12's expat keeps this VTK from reading that back.
    simple.SaveData(os.path.join(folder, name), proxy=output, DataMode="Binary")
