"""State: a model over the truth, and its distance from it, phase by phase. Needs no files.

`paraview --plugins=DynamicCoronaryPlugin --state overlay_review.py`, or File, Load State; the plugin has to be loaded.
"""
from paraview import simple  # with it, Python finds the modules of plugins

try:
    import coronary_examples
except ImportError:
    raise RuntimeError("The DynamicCoronary plugin is not loaded: see docs/paraview.md, The plugin.") from None

coronary_examples.overlay_review()
