"""The plugin was loaded by ParaView itself: its proxies must be there, and run."""
from paraview import simple

if not hasattr(simple, "CoronaryPhantom"):
    raise SystemExit("ParaView did not load the plugin by itself")
phantom = simple.CoronaryPhantom()
tree = simple.OutputPort(phantom, 1)
phantom.SMProxy.UpdatePipelineInformation()
simple.UpdatePipeline(time=0.35, proxy=tree)
points = tree.GetDataInformation().GetNumberOfPoints()
print("centerline points at 35 %% of the cycle: %d" % points)
if points < 1:
    raise SystemExit("the tree is empty")
