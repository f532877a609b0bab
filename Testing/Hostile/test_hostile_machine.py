"""Machines that fail while the programs write: full disks, folders that can not be written to, SIGKILL.

Usage: test_hostile_machine.py --pipeline PROGRAM [--simulator PROGRAM]

Expected each time: exit code 1 and one line that says why, nothing half written, older results untouched; after SIGKILL
every file is a whole old or a whole new one, and the next run works and clears away what was left.
"""

import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SECONDS = 300
# Images without the truth: as quick as it gets.
PHANTOM = "phantom --quiet --no-truth --phases 6 --spacing 2 --window 0 --origin -40 -40 -40 --dimensions 40 40 40".split()
KILLS = 3


class Failures:
    """Counts what is not as it should be."""

    def __init__(self):
        self.count = 0

    def check(self, holds, what):
        if not holds:
            self.count += 1
            print(f"FAILED: {what}", flush=True)


def contents(folder):
    """Bytes of every file below the folder, by name; without what is hidden."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    }


def run(command, **options):
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS,
                          check=False, **options)


def refused(failures, result, what, part=""):
    """Exit code 1, and one line."""
    failures.check(result.returncode == 1, f"{what}: exit code {result.returncode}: {result.stderr[:300]}")
    failures.check(result.stderr.count("\n") == 1, f"{what}: not one line: {result.stderr[:300]!r}")
    failures.check(part in result.stderr, f"{what}: no '{part}' in: {result.stderr[:300]}")


def small_files():
    """Writing beyond some bytes fails, as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))


def check_full_disk(failures, program, work, made):
    """A limit on the size of files, then a real file system without room."""
    folder = work / "limited"
    shutil.copytree(made, folder)
    before = contents(folder)
    result = run([program, *PHANTOM, "--seed", "2", "--output", str(folder)], preexec_fn=small_files)
    refused(failures, result, "no room for a file", str(folder))
    failures.check(contents(folder) == before, "no room for a file: the older result is changed")
    failures.check(not list(folder.glob(".*")), "no room for a file: something is left")

    surface = work / "input.off"
    surface.write_text("OFF\n1000 1 0\n" + "0.125 0.25 0.5\n" * 1000 + "3 0 1 2\n")
    result = run([program, "convert", str(surface), str(work / "surface.obj")], preexec_fn=small_files)
    refused(failures, result, "no room for a mesh", "surface.obj")
    failures.check(not list(work.glob("*surface.obj")), "no room for a mesh: something is left")

    with open("/dev/full", "w", encoding="ascii") as full:
        result = subprocess.run([program, "inspect", str(made / "series.json")], stdin=subprocess.DEVNULL, stdout=full,
                                stderr=subprocess.PIPE, text=True, timeout=SECONDS, check=False)
    refused(failures, result, "a full standard output", "standard output")

    # Mounting takes rights that not everybody has.
    disk = work / "disk"
    disk.mkdir()
    if run(["unshare", "-m", "mount", "-t", "tmpfs", "none", str(disk)]).returncode != 0:
        print("skipped: a real full disk and a read-only one (no right to mount)")
        return
    mounted = 'mount -t tmpfs -o size="$1" none "$2" && shift 2 && "$@"; code=$?; ls -A "$DISK" >&2; exit $code'
    command = [program, *PHANTOM, "--seed", "2", "--output", str(disk)]
    environment = dict(os.environ, DISK=str(disk))
    result = run(["unshare", "-m", "sh", "-c", mounted, "sh", "16k", str(disk), *command], env=environment)
    refused(failures, result, "a full disk, with nothing left on it", str(disk))
    read_only = mounted.replace("&& shift", '&& mount -o remount,ro "$2" && shift')
    result = run(["unshare", "-m", "sh", "-c", read_only, "sh", "1m", str(disk), *command], env=environment)
    refused(failures, result, "a read-only disk", str(disk))


def check_in_the_way(failures, program, work):
    """Files where folders should be, and the other way round."""
    file = work / "file"
    file.write_text("mine")
    for output in (file, file / "below"):
        result = run([program, *PHANTOM, "--output", str(output)])
        refused(failures, result, "a file in the way", str(file))
    failures.check(file.read_text() == "mine", "a file in the way: it is changed")
    taken = work / "taken"
    (taken / "series.json").mkdir(parents=True)
    result = run([program, *PHANTOM, "--output", str(taken)])
    refused(failures, result, "a folder in the way", "series.json")
    failures.check(sorted(os.listdir(taken)) == ["series.json"], "a folder in the way: something is left")
    result = run([program, "convert", str(work / "input.off"), str(taken) + "/none/a.obj"])
    refused(failures, result, "no folder", "a.obj")


def check_killed(failures, program, work, made, other, seconds):
    """SIGKILL at any moment: whole files, and the next run is as if nothing had been."""
    folder = work / "killed"
    shutil.copytree(made, folder)
    old, new = contents(made), contents(other)
    generator = random.Random(7)
    killed = 0
    for _ in range(KILLS):
        process = subprocess.Popen([program, *PHANTOM, "--seed", "2", "--output", str(folder)],
                                   stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(generator.uniform(0.2, 1.0) * seconds)
        process.kill()
        killed += process.wait() == -signal.SIGKILL
        for name, content in contents(folder).items():
            failures.check(content in (old.get(name), new.get(name)), f"killed: {name} is neither old nor new")
        if (folder / "series.json").exists():
            failures.check(contents(folder) in (old, new), "killed: series.json stands beside files of another set")
    failures.check(killed > 0, "nothing was killed: the moments are chosen badly")
    past = time.time() - 3600
    for left in folder.glob(".unfinished-*"):
        os.utime(left, (past, past))
    result = run([program, *PHANTOM, "--seed", "2", "--output", str(folder)])
    failures.check(result.returncode == 0, f"after a kill: {result.stderr[:300]}")
    failures.check(contents(folder) == new, "after a kill: the result is another one")
    failures.check(not list(folder.glob(".*")), f"after a kill: left {os.listdir(folder)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pipeline", required=True)
    parser.add_argument("--simulator", help="not used: for the same command line as the other test")
    options = parser.parse_args()
    failures = Failures()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        made, other = work / "made", work / "other"
        began = time.monotonic()
        for seed, folder in (("1", made), ("2", other)):
            result = run([options.pipeline, *PHANTOM, "--seed", seed, "--output", str(folder)])
            failures.check(result.returncode == 0, result.stderr)
        seconds = 0.5 * (time.monotonic() - began)
        if failures.count == 0:
            check_full_disk(failures, options.pipeline, work, made)
            check_in_the_way(failures, options.pipeline, work)
            check_killed(failures, options.pipeline, work, made, other, seconds)
    print(f"hostile machine: {failures.count} failed, {seconds:.1f} s for one run")
    return 1 if failures.count else 0


if __name__ == "__main__":
    sys.exit(main())
