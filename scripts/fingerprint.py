#!/usr/bin/env python3
"""What must not change in a refactoring: hashes of what the programs write, and which of them differ from a list made before.

Makes a small healthy and a diseased phantom, runs every stage on both, writes the moving mesh in all formats, a scene of 3D Slicer,
conversions, an evaluation, a cohort, review pages and sessions of the simulator, and prints a line 'hash name' for each
file. What says when, where and how fast a file was made does not count.

    scripts/fingerprint.py --output before.txt
    scripts/fingerprint.py --against before.txt        # exit code 1 and the names of what differs
"""
import argparse
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Keys of JSON whose values tell of the run, not of its result.
VOLATILE = {"seconds", "cpu_seconds", "peak_memory_mb", "run", "started", "start", "finished", "date", "host", "machine", "command", "threads",
            "memory_mb", "version", "created", "when", "wall_seconds", "processor_seconds", "arguments", "modified", "digest"}
TIME = re.compile(rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?Z?")
DURATION = re.compile(rb"\b\d+(\.\d+)? ?(s|ms|MB|GB)\b")


def without_volatile(value):
    if isinstance(value, dict):
        return {key: without_volatile(item) for key, item in value.items() if key not in VOLATILE}
    if isinstance(value, list):
        return [without_volatile(item) for item in value]
    return value


def content(path, work):
    """The bytes of a file that have to stay."""
    data = path.read_bytes().replace(os.fsencode(str(work)), b"WORK")
    if path.suffix == ".json":
        return json.dumps(without_volatile(json.loads(data)), sort_keys=True).encode()
    if path.suffix in {".html", ".txt", ".csv", ".tex", ".pcirec"}:
        data = TIME.sub(b"TIME", data)
        if path.suffix in {".html", ".txt"}:
            data = DURATION.sub(b"DURATION", re.sub(rb'"(%s)":[^,}]*' % b"|".join(key.encode() for key in sorted(VOLATILE)), b"", data))
    return data


def make(build, work):
    """Everything that is hashed."""
    def run(program, *arguments):
        command = [str(build / "bin" / program), *map(str, arguments)]
        print("+", program, *arguments, file=sys.stderr)
        done = subprocess.run(command, cwd=work, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        name = re.sub(r"\W+", "-", " ".join(map(str, (program, *arguments))).replace(str(ROOT), ""))[:120]
        (work / "said").mkdir(exist_ok=True)
        (work / "said" / (name + ".txt")).write_bytes(b"exit %d\n" % done.returncode + done.stdout.replace(os.fsencode(str(ROOT)), b"ROOT"))

    def pipeline(*arguments):
        run("coronary-pipeline", *arguments)

    for name, options in (("healthy", ["--seed", 1]), ("diseased", ["--seed", 3, "--stenoses", 3, "--calcified-plaques", 8])):
        pipeline("phantom", *options, "--phases", 6, "--spacing", 0.8, "--output", name, "--quiet")
        pipeline("run", name + "/series.json", "--output", name + "-run", "--quiet")
        pipeline("review", name + "-run", "--quiet")
        pipeline("evaluate", "--result", name + "-run", "--truth", name, "--no-pictures", "--output", name + "-evaluation", "--quiet")
    pipeline("phantom-motion", "--seed", 1)
    pipeline("inspect", "healthy/series.json")
    pipeline("sequence", "healthy-run", "--formats", "series,simvascular,vmtk,obj,ply,stl,gltf,gltf-json", "--velocity", "--phases", 4,
             "--output", "sequence", "--quiet")
    pipeline("sequence", "healthy-run", "--mode", "low-noise", "--blend", "dual-quaternion", "--volume-conservation", 1, "--times", "0.1,0.35",
             "--output", "sequence-low-noise", "--quiet")
    pipeline("slicer", "healthy-run", "--output", "slicer", "--quiet")
    (work / "convert").mkdir()
    for name in ("vmtk.vtp", "skeleton.tgf", "markups.mrk.json"):
        pipeline("convert", "healthy-run/centerline.vtp", "convert/" + name)
    pipeline("convert", "healthy-run/mask.mha", "convert/mask.vtp")
    pipeline("metrics", "healthy-run/surface.vtp", "healthy/truth/surface_00.vtp", "--json")
    (work / "cohort.json").write_text(json.dumps({"cases": [
        {"name": "one", "input": "healthy/series.json", "truth": "healthy"}, {"name": "two", "input": "diseased/series.json", "truth": "diseased"}]}))
    pipeline("cohort", "cohort.json", "--no-pictures", "--output", "cohort", "--quiet")
    driving = ROOT / "Testing/Data/Driving"
    for recording in sorted(driving.glob("*.pcirec")):
        run("coronary-simulator", "--headless", "--replay", recording, "--verify", "--quiet")
    run("coronary-simulator", "--headless", "--scenario", "phantom-lca", "--vessels", "healthy-run", "--script", driving / "lad-apex.json",
        "--ticks", 4000, "--output", "session", "--output-rate", 2, "--write-wall", "--record", "session.pcirec", "--quiet")
    run("coronary-simulator", "--headless", "--scenario", "phantom-lca", "--script", driving / "lca-angiogram.json", "--ticks", 3000, "--xray",
        "--output", "angiogram", "--output-rate", 5, "--quiet")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/paraview", help="build tree with the programs")
    parser.add_argument("--output", type=pathlib.Path, help="file for the list; default: standard output")
    parser.add_argument("--against", type=pathlib.Path, help="list that was made before")
    parser.add_argument("--keep", action="store_true", help="leave the files in build/fingerprint, to be looked at")
    arguments = parser.parse_args()
    # One place for all runs: packed recordings hold it.
    work = ROOT / "build/fingerprint"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    make(arguments.build.resolve(), work)
    found = {}
    for path in sorted(work.rglob("*")):
        if path.is_file() and not path.is_symlink():
            code = hashlib.sha256(content(path, work)).hexdigest()[:16]
            # A cohort's kept measures are called by a digest of their inputs' times.
            found[str(path.relative_to(work).with_stem(code) if path.parent.name == "measures" else path.relative_to(work))] = code
    if not arguments.keep:
        shutil.rmtree(work)
    text = "".join(f"{code} {name}\n" for name, code in found.items())
    if arguments.output:
        arguments.output.write_text(text)
    elif not arguments.against:
        print(text, end="")
    if arguments.against:
        before = dict(reversed(line.split(" ", 1)) for line in arguments.against.read_text().splitlines())
        differ = sorted(name for name in before.keys() | found.keys() if before.get(name) != found.get(name))
        for name in differ:
            print("gone" if name not in found else "new" if name not in before else "differs", name)
        print(f"{len(found) - len([n for n in differ if n in found])} of {len(before)} files are the same")
        return 1 if differ else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
