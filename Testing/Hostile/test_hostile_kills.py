"""SIGKILL while a model is made, measured and written out, and while a session is recorded.

Usage: test_hostile_kills.py --pipeline PROGRAM --simulator PROGRAM --driving SCRIPT [--preload LIBRARY] [--one]

Killed some time after the start and, with the library (KillBeforeChange.cxx), between any two files of a set: every
file that has its final name is a whole old or a whole new one, the file that describes the others stands only beside
those, and the next run works and clears away what was left.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from test_hostile_machine import Failures, contents, run

PHANTOM = ("phantom --quiet --seed 2 --fractions 0.45 0.74 --spacing 1.2 --window 0 --no-truth "
           "--origin -12 -40 -40 --dimensions 40 40 40").split()
RUN = "--quiet --scales 0.7 2.5 --time 0.74 --seed 0.638 -0.16 0.326".split()


def age(folder):
    """What was left is as old as it has to be to be removed."""
    past = time.time() - 3600
    for left in folder.rglob(".unfinished-*"):
        os.utime(left, (past, past))


class Kills:
    """Kills programs, and counts what is not as it should be."""

    def __init__(self, failures, preload):
        self.failures = failures
        self.preload = preload

    def succeed(self, command):
        """Seconds that it takes."""
        began = time.monotonic()
        result = run(command)
        self.failures.check(result.returncode == 0, f"{command}: {result.stderr[:300]}")
        return time.monotonic() - began

    def kill(self, command, moment):
        """Ends it after some seconds, or before a file of that name gets its place."""
        if isinstance(moment, str):
            environment = dict(os.environ, LD_PRELOAD=self.preload, DYNAMICCORONARY_KILL_BEFORE=moment)
            code = run(command, env=environment).returncode
            self.failures.check(code == -signal.SIGKILL, f"{command[1]} before {moment}: exit code {code}")
            return
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        time.sleep(moment)
        process.kill()
        process.wait()

    def check(self, folder, older, command, shares, names, whole, resume=()):
        """Kills a command after shares of its time, and before names of its files.

        older: a command that fills the folder first, or None
        whole(now, old, new, what): looks at the files of the folder by name
        resume: options of the last run, which is left alone, after the last kill
        """
        if older:
            self.succeed(older)
        kept = folder.with_name(folder.name + " kept")
        folder.mkdir(exist_ok=True)
        shutil.copytree(folder, kept)
        old = contents(folder)
        seconds = self.succeed(command)
        new = contents(folder)
        for moment in [share * seconds for share in shares] + (list(names) if self.preload else []):
            shutil.rmtree(folder)
            shutil.copytree(kept, folder)
            self.kill(command, moment)
            what = f"{command[1]} killed " + (f"before {moment}" if isinstance(moment, str) else f"at {moment:.2f} s")
            whole(contents(folder), old, new, what)
        age(folder)
        again = self.succeed([*command, *resume])
        print(f"{command[1]}: {seconds:.1f} s, after the last kill {again:.1f} s")
        whole(contents(folder), new, new, f"{command[1]} after a kill")
        self.failures.check(not list(folder.glob(".unfinished-*")), f"{command[1]} after a kill: {os.listdir(folder)}")

    def set_is_whole(self, last):
        """For sets that a last file describes."""

        def whole(now, old, new, what):
            for name, content in now.items():
                self.failures.check(content in (old.get(name), new.get(name)), f"{what}: {name} is neither old nor new")
            if last in now:
                self.failures.check(now in (old, new), f"{what}: {last} stands beside files of another set")

        return whole

    def run_is_whole(self, now, old, new, what):
        """The report has times in it; what it lists is there, all of one run."""
        report = "report.json"
        for name in now.keys() - {report}:
            self.failures.check(now[name] in (old.get(name), new.get(name)), f"{what}: {name} is neither old nor new")
        if report not in now:
            self.failures.check("before motion" not in what, f"{what}: the report of the stages before is lost")
            return
        said = json.loads(now[report])
        same = said["settings"]["edges"] == json.loads(new[report])["settings"]["edges"]
        for stage in said["stages"]:
            for name, size in stage["files"].items():
                good = len(now.get(name, b"")) == size and now[name] == (new if same else old)[name]
                self.failures.check(good, f"{what}: the report lists {name}")
        if old is new:
            self.failures.check(now.keys() == new.keys(), f"{what}: other files: {sorted(now.keys() ^ new.keys())}")
            starts = {stage["run"] for stage in said["stages"]}
            self.failures.check(len(starts) == 2 or not self.preload, f"{what}: nothing was resumed")


def check_session(kills, simulator, work, driving, model):
    """The simulator's files, and its recording, which has the time in its header."""
    failures = kills.failures
    folder = work / "session"

    def command(ticks):
        return [simulator, "--headless", "--quiet", "--scenario", "phantom-lca", "--vessels", str(model), "--script",
                driving, "--ticks", str(ticks), "--record", str(folder / "a.pcirec"), "--output", str(folder / "files")]

    def items(recording):
        """Exit code, and what is recorded behind the header."""
        copy = work / "copy.pcirec"
        copy.write_bytes(recording)
        result = run([simulator, "--dump", str(copy)])
        return result.returncode, result.stdout.splitlines()[1:]

    files_are_whole = kills.set_is_whole("files/statistics.json")

    def whole(now, old, new, what):
        now, old, new = dict(now), dict(old), dict(new)
        before, after = items(old.pop("a.pcirec")), items(new.pop("a.pcirec"))
        failures.check(items(now.pop("a.pcirec")) in (before, after), f"{what}: the recording is not whole")
        files_are_whole(now, old, new, what)
        # What is beside it can be read up to where it was killed.
        for torn in folder.glob(".a.*.pcirec"):
            good = items(torn.read_bytes())[1]
            failures.check(good == after[1][:len(good)], f"{what}: {torn.name} has other items")
            failures.check(good or "before" not in what, f"{what}: {torn.name} has nothing")

    kills.check(folder, command(1500), command(4000), (0.8,), ("tip.csv", "a.pcirec"), whole)


def finish(failures, began):
    """Says how it went; the exit code."""
    print(f"hostile kills: {failures.count} failed, {time.monotonic() - began:.1f} s")
    return 1 if failures.count else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pipeline", required=True)
    parser.add_argument("--simulator", required=True)
    parser.add_argument("--driving", required=True, help="script for the simulator")
    parser.add_argument("--preload", help="library that kills between files")
    parser.add_argument("--one", action="store_true", help="one kill of a run only")
    options = parser.parse_args()
    failures = Failures()
    kills = Kills(failures, options.preload)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        model = work / "model"

        def pipeline(*arguments):
            return [options.pipeline, *map(str, arguments)]

        def make(*arguments):
            return pipeline("run", work / "phantom/series.json", *RUN, "--output", model, *arguments)

        def measure(*arguments):
            return pipeline("evaluate", "--result", model, "--truth", model, "--no-pictures", "--quiet",
                            "--output", work / "evaluation", *arguments)

        def meshes(*arguments):
            return pipeline("sequence", model, "--quiet", "--output", work / "meshes", *arguments)

        kills.succeed(pipeline(*PHANTOM, "--output", work / "phantom"))
        if options.one:
            kills.check(model, None, make("--edges", "1", "2"), () if options.preload else (0.5,), ("motion/volume_01.vtu",),
                        kills.run_is_whole, ["--resume"])
            return finish(failures, began)
        kills.check(model, make("--until", "volume", "--edges", "1", "2"), make("--edges", "0.8", "1.6"), (0.5,),
                    ("mask.mha", "motion/volume_01.vtu"), kills.run_is_whole, ["--resume"])
        kills.check(work / "evaluation", measure("--name", "old"), measure("--name", "new"), (0.8,),
                    ("branches.csv", "table1.json"), kills.set_is_whole("table1.json"))
        kills.check(work / "meshes", meshes("--phases", "3"), meshes("--formats", "series,simvascular,gltf"),
                    (0.8,), ("walls_combined.vtp", "mesh_volume_002.vtu", "mesh.json"),
                    kills.set_is_whole("mesh.json"))
        check_session(kills, options.simulator, work, options.driving, model)
    return finish(failures, began)


if __name__ == "__main__":
    sys.exit(main())
