"""What the entries of the menu Dynamic Coronary call. One message for a fault, instead of a Python traceback."""
from paraview import print_error

import compare_series
import coronary_examples
import look_along_vessel


def _entry(work):
    def call():
        try:
            work()
        except (RuntimeError, ValueError) as error:
            print_error("Dynamic Coronary: %s" % error)

    return call


compare = _entry(lambda: compare_series.compare(*compare_series.selected_series()))
look = _entry(look_along_vessel.look_at_selected)
phantom = _entry(coronary_examples.phantom)
overlay_review = _entry(coronary_examples.overlay_review)
posing = _entry(coronary_examples.posing)
cfd_export = _entry(coronary_examples.cfd_export)
