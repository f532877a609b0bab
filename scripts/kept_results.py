"""What long validations share: programs that are run and measured, and results that survive an interruption."""
import fnmatch
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time


class Failed(Exception):
    """A program failed, or can not be started; the text is one line."""


def run(words, log=None, environment=None):
    """Runs a program to its end. Returns seconds, cpu_seconds and peak_mb of it and its children.

    What it prints goes to the file `log`, to be looked at after a failure; Failed has its last line.
    """
    sink = open(log, "w+", encoding="utf-8", errors="replace") if log else open(os.devnull, "w+", encoding="utf-8")
    start = time.monotonic()
    with sink:
        try:
            child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT, env=environment)
        except OSError as error:
            raise Failed("%s: %s" % (words[0], error.strerror)) from error
        try:
            _, status, usage = os.wait4(child.pid, 0)
        except BaseException:
            child.kill()
            raise
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            sink.seek(0)
            lines = [line.strip() for line in sink if line.strip()]
            raise Failed("%s: %s" % (os.path.basename(words[0]), lines[-1] if lines else "exit code %d" % child.returncode))
    return {"seconds": time.monotonic() - start, "cpu_seconds": usage.ru_utime + usage.ru_stime,
            "peak_mb": usage.ru_maxrss / 1024.0}


def as_program(main, name):
    """Runs main; a failure is one line and exit code 1, an interruption 130."""
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that the program that runs is ended, too
        main()
    except Failed as failure:
        sys.exit("%s: %s" % (name, failure))
    except KeyboardInterrupt:
        sys.exit(130)


def digest(*parts):
    """Of texts, numbers, lists and so on."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def digest_of_files(paths):
    total = hashlib.sha256()
    for path in paths:
        with open(path, "rb") as file:
            total.update(hashlib.sha256(file.read()).digest())
    return total.hexdigest()


def digest_of_program(program, build):
    """Of a program and the libraries of its build tree."""
    told = subprocess.run(["ldd", program], capture_output=True, text=True, check=False).stdout
    libraries = [path for path in re.findall(r"=> (\S+)", told) if os.path.realpath(path).startswith(os.path.realpath(build))]
    return digest_of_files([program] + sorted(libraries))


def kept(folder, key, make, goes_on=False):
    """The result of make(folder), from the last time when that was with the same key.

    `make` fills a folder of another name, which takes its place when all is there. An interrupted one is made anew, unless
    `make` says that it goes on with what it finds.
    """
    result = finished(folder, key)
    if result is not None:
        return result
    partial = folder + ".partial"
    if not goes_on:
        shutil.rmtree(partial, ignore_errors=True)
    os.makedirs(partial, exist_ok=True)
    result = make(partial)
    with open(os.path.join(partial, "kept.json"), "w", encoding="utf-8") as file:
        json.dump({"key": key, "result": result}, file, indent=1)
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(partial, folder)
    return result


def finished(folder, key):
    """What `kept` would give without making anything; None when it is not there."""
    try:
        with open(os.path.join(folder, "kept.json"), encoding="utf-8") as file:
            old = json.load(file)
        if old["key"] == key:
            return old["result"]
    except (OSError, ValueError, KeyError):
        pass
    return None


def keep_only(folder, patterns):
    """Removes all files of a folder but those whose path in it is like one of the patterns."""
    for place, _, files in os.walk(folder, topdown=False):
        for file in files:
            path = os.path.join(place, file)
            if not any(fnmatch.fnmatch(os.path.relpath(path, folder), pattern) for pattern in patterns):
                os.remove(path)
        if not os.listdir(place):
            os.rmdir(place)
