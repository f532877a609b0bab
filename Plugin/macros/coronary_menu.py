"""What the entries of the menu Dynamic Coronary call. One message for a fault, instead of a Python traceback."""
from paraview import print_error

import compare_series
import correct_tree
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
correct = _entry(correct_tree.start)
keep_edit = _entry(correct_tree.keep)
undo_edit = _entry(correct_tree.undo)
save_edits = _entry(correct_tree.save)
phantom = _entry(coronary_examples.phantom)
overlay_review = _entry(coronary_examples.overlay_review)
posing = _entry(coronary_examples.posing)
cfd_export = _entry(coronary_examples.cfd_export)
