"""State: a model over the truth, and its distance from it, for series of your own.

`DYNAMICCORONARY_MODEL=run/motion.pvd DYNAMICCORONARY_TRUTH=phantom/truth/surface.pvd paraview --plugins=DynamicCoronaryPlugin
--state compare_series.py`; without these variables motion.pvd and surface.pvd of the current folder.
"""
import os

from paraview import simple

try:
    import compare_series
except ImportError:
    raise RuntimeError("The DynamicCoronary plugin is not loaded: see docs/paraview.md, The plugin.") from None

compare_series.compare(
    simple.PVDReader(registrationName="Model", FileName=os.environ.get("DYNAMICCORONARY_MODEL", "motion.pvd")),
    simple.PVDReader(registrationName="Truth", FileName=os.environ.get("DYNAMICCORONARY_TRUTH", "surface.pvd")))
