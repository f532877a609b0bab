"""State: a coronary tree that is bent by the joints of its skeleton. Needs no files.

`paraview --plugins=DynamicCoronaryPlugin --state posing.py`, or File, Load State; the plugin has to be loaded.
"""
from paraview import simple  # with it, Python finds the modules of plugins

try:
    import coronary_examples
except ImportError:
    raise RuntimeError("The DynamicCoronary plugin is not loaded: see docs/paraview.md, The plugin.") from None

coronary_examples.posing()
