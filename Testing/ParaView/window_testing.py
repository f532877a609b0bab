"""What the tests that run inside the ParaView window share."""
import os
import subprocess
import traceback


def check_step(step, look):
    """Calls look(step). The window's Python shell would print an exception and go on."""
    try:
        look(step)
        os.write(1, ("window: %s is right\n" % step).encode())
    except BaseException:
        os.write(2, traceback.format_exc().encode())
        os._exit(1)


def photograph_desktop(folder, step):
    """The whole window, for people to look at, where the tool for it is installed."""
    try:
        subprocess.run(["import", "-silent", "-window", "root",
                        os.path.join(folder, "desktop_%s.png" % step)], check=False)
    except FileNotFoundError:
        pass
