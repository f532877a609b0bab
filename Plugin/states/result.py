"""State: the result of a `coronary-pipeline run` beside its images.

`DYNAMICCORONARY_RESULT=RUN DYNAMICCORONARY_SERIES=series.json paraview --plugins=DynamicCoronaryPlugin --state result.py`;
without these variables what scripts/demo.sh leaves in the current folder.
"""
import os

from paraview import simple  # with it, Python finds the modules of plugins

try:
    import build_from_4d_ct
except ImportError:
    raise RuntimeError("The DynamicCoronary plugin is not loaded: see docs/paraview.md, The plugin.") from None

build_from_4d_ct.open_result(os.environ.get("DYNAMICCORONARY_RESULT", "demo-output/run"),
                             os.environ.get("DYNAMICCORONARY_SERIES", "demo-output/phantom/series.json"))
