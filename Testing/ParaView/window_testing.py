"""What the tests that run inside the ParaView window share."""
import ctypes
import os
import subprocess
import time
import traceback

from paraview import simple

from coronary_testing import require, require_picture

FOLDER = os.environ["DYNAMICCORONARY_TEST_FOLDER"]


def checker(look, settle=1.0):
    """The play-back's check(step): calls look(step), and lets play-back.sh know that it was right."""
    def check(step):
        try:
            # ParaView 6 lays views out, and shows what was made, after the script that did.
            live(settle)
            look(step)
            with open(os.path.join(FOLDER, "checked"), "a", encoding="utf-8") as file:
                file.write(step + "\n")
        except BaseException:
            os.write(2, traceback.format_exc().encode())
            os._exit(1)
    return check


def photograph(step):
    """The whole window, for people to look at, where the tool for it is installed."""
    try:
        subprocess.run(["import", "-silent", "-window", "root",
                        os.path.join(FOLDER, "desktop_%s.png" % step)], check=False)
    except FileNotFoundError:
        pass


def picture(name, view, share):
    """A view in a file, which is to show something in that share of it; its path."""
    path = os.path.join(FOLDER, name + ".png")
    simple.SaveScreenshot(path, view)
    require_picture(path, share)
    return path


def near(a, b, tolerance):
    return len(a) == len(b) and all(abs(x - y) < tolerance for x, y in zip(a, b))


def live(seconds, until=lambda: False):
    """Lets the window live, which it does not while the Python shell works; the longest turn, s, and how many there were."""
    # QCoreApplication::processEvents(flags, milliseconds); with Python's lock, which what is called there takes for granted.
    with open("/proc/self/maps", encoding="utf-8") as maps:
        core = "libQt6Core.so.6" if "libQt6Core" in maps.read() else "libQt5Core.so.5"
    turn = getattr(ctypes.PyDLL(core), "_ZN16QCoreApplication13processEventsE6QFlagsIN10QEventLoop17ProcessEventsFlagEEi")
    end, longest, turns = time.monotonic() + seconds, 0.0, 0
    while time.monotonic() < end and not until():
        start = time.monotonic()
        turn(0, 50)
        longest, turns = max(longest, time.monotonic() - start), turns + 1
        time.sleep(0.01)
    return longest, turns


class Player:
    """Watches the animation from now on, and stops it after some laps."""

    def __init__(self, laps):
        self.scene = simple.GetAnimationScene()
        self.steps = list(self.scene.TimeKeeper.TimestepValues)
        self.frames = []  # of each: when, processor time, time step
        self.ended = False
        self.object = self.scene.SMProxy.GetClientSideObject()
        self.playing = False
        wanted = laps * len(self.steps)

        def frame(*_):
            if self.playing:
                self.frames.append((time.monotonic(), time.process_time(), self.scene.AnimationTime))
                if len(self.frames) >= wanted:
                    self.scene.SMProxy.InvokeCommand("Stop")

        def begin(*_):
            self.playing = True

        def end(*_):
            self.playing, self.ended = False, True
            for observer in self.observers:
                self.object.RemoveObserver(observer)

        self.observers = [self.object.AddObserver(*pair) for pair in (
            ("AnimationCueTickEvent", frame), ("StartEvent", begin), ("EndEvent", end))]

    def require_played(self, steps, seconds):
        """It played so many steps from the first on, in a loop, and half of the frames took less than `seconds` of a processor."""
        require(self.ended and len(self.steps) == steps, "ended %s, steps %s" % (self.ended, self.steps))
        times = [frame[2] for frame in self.frames]
        require(len(times) > steps + 1 and times[:steps] == self.steps and times[steps] == self.steps[0],
                "it played %s of %s" % (times, self.steps))
        took = sorted(b[1] - a[1] for a, b in zip(self.frames, self.frames[1:]))
        spent = self.frames[-1][0] - self.frames[0][0]
        os.write(1, ("%.1f frames a second, %.3f s of a processor each\n" % (
            (len(times) - 1) / spent, took[len(took) // 2])).encode())
        require(took[len(took) // 2] < seconds, "a frame takes %.2f s" % took[len(took) // 2])


class KeyEvent(ctypes.Structure):
    """XKeyEvent of Xlib."""
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
                ("display", ctypes.c_void_p), ("window", ctypes.c_ulong), ("root", ctypes.c_ulong),
                ("subwindow", ctypes.c_ulong), ("time", ctypes.c_ulong), ("x", ctypes.c_int),
                ("y", ctypes.c_int), ("x_root", ctypes.c_int), ("y_root", ctypes.c_int),
                ("state", ctypes.c_uint), ("keycode", ctypes.c_uint), ("same_screen", ctypes.c_int),
                ("room", ctypes.c_long * 24)]


class Desktop:
    """The test's own X server. The play-back's own keys start no shortcuts, and its mouse moves no pointer."""

    def __init__(self):
        self.x = ctypes.CDLL("libX11.so.6")
        self.x.XOpenDisplay.restype = ctypes.c_void_p
        self.x.XDefaultRootWindow.restype = ctypes.c_ulong
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(None))
        self.root = self.x.XDefaultRootWindow(self.display)

    def point(self, x, y):
        """The pointer to a place of the screen."""
        self.x.XWarpPointer(self.display, 0, ctypes.c_ulong(self.root), 0, 0, 0, 0, int(x), int(y))
        self.x.XSync(self.display, 0)

    def click(self, x, y):
        """A real click of the left button, as of the user's mouse."""
        tester = ctypes.CDLL("libXtst.so.6")
        tester.XTestFakeMotionEvent(self.display, -1, int(x), int(y), ctypes.c_ulong(0))
        for pressed in (1, 0):
            tester.XTestFakeButtonEvent(self.display, 1, pressed, ctypes.c_ulong(0))
        self.x.XSync(self.display, 0)
        # Until the window has it.
        time.sleep(0.2)

    def focus(self):
        """Gives the window under the pointer the focus, and returns it."""
        root, window = ctypes.c_ulong(), ctypes.c_ulong()
        numbers = [ctypes.byref(ctypes.c_int()) for _ in range(5)]
        self.x.XQueryPointer(self.display, ctypes.c_ulong(self.root), ctypes.byref(root),
                             ctypes.byref(window), *numbers)
        self.x.XSetInputFocus(self.display, window, 2, ctypes.c_ulong(0))
        self.x.XSync(self.display, 0)
        return window

    def press(self, name):
        """A key, pressed and released, for the window under the pointer."""
        window = self.focus()
        self.x.XStringToKeysym.restype = ctypes.c_ulong
        symbol = ctypes.c_ulong(self.x.XStringToKeysym(name.encode()))
        code = self.x.XKeysymToKeycode(self.display, symbol)
        for kind in (2, 3):
            event = KeyEvent(type=kind, display=self.display, window=window.value, root=self.root,
                             keycode=code, same_screen=1)
            self.x.XSendEvent(self.display, window, 1, ctypes.c_long(3), ctypes.byref(event))
        self.x.XSync(self.display, 0)
