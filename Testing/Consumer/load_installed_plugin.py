"""The plugin was loaded by ParaView itself: its proxies must be there, and run."""
from paraview import simple

if not hasattr(simple, "CoronaryPhantom"):
    raise SystemExit("ParaView did not load the plugin by itself")
# A filter asks for the tree alone; updating the source would make the image as well.
tree = simple.Calculator(Input=simple.OutputPort(simple.CoronaryPhantom(), 1))
tree.UpdatePipeline(0.35)
points = tree.GetDataInformation().GetNumberOfPoints()
print("centerline points at 35 %% of the cycle: %d" % points)
if points < 1:
    raise SystemExit("the tree is empty")
