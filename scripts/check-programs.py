#!/usr/bin/env python3
"""Whether the documentation and the programs' own --help say the same.

Usage: check-programs.py BIN_DIRECTORY

- every option is explained by --help, which the pages do not repeat;
- every command of coronary-pipeline has its section in the page of the programs, and is in its table of commands;
- every option that the section or page of a program names exists, and where a table there gives a default, it is the
  program's;
- every command line in any page, in a code block or in backticks, names a program, command and options that exist.
Exit code 1 when one does not.
"""
import glob
import os
import re
import shlex
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# The page of a program; the commands of coronary-pipeline have a section each.
PAGES = {"coronary-simulator": "docs/simulator-files.md", "coronary-posing": "docs/deformation.md",
         "coronary-device-emulator": "docs/device-protocol.md"}
COMMANDS_PAGE = "docs/programs.md"
KNOWN = ("coronary-pipeline", *PAGES)
OPTION = re.compile(r"(?<![\w/-])--[a-z][\w-]*")


class Programs:
    """The programs of a build tree, by their --help, in the forms of CLI11 2.3 and of 2.5."""

    def __init__(self, folder):
        self.folder = folder
        self.texts = {}

    def exists(self, program):
        return os.access(os.path.join(self.folder, program), os.X_OK)

    def help(self, program, command=""):
        """What --help prints; empty when there is no such command."""
        if (program, command) not in self.texts:
            line = [os.path.join(self.folder, program)] + ([command] if command else []) + ["--help"]
            done = subprocess.run(line, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False)
            self.texts[program, command] = done.stdout if done.returncode == 0 else ""
        return self.texts[program, command]

    def commands(self, program):
        """Names of the subcommands."""
        part = re.split(r"^subcommands:", self.help(program), maxsplit=1, flags=re.M | re.I)[1:]
        return re.findall(r"^  ([a-z][\w-]*)", part[0] if part else "", re.M)

    def options(self, program, command=""):
        """{option: default or None} without --help and --version."""
        found = re.findall(r"^\s+(?:-\w,\s*)?(--[a-z][\w-]*)([^\n]*)", self.help(program, command), re.M)
        result = {}
        for name, rest in found:
            head = rest.split("  ")[0]
            default = re.search(r"^[^\n]*?\S=(\[[^\]]*\]|[^\s,]+)", head) or re.search(r" \[(\[[^\]]*\]|[^\]]*)\]", head)
            if name not in ("--help", "--help-all", "--version"):
                result[name] = default.group(1) if default else None
        return result

    def unexplained(self, program, command=""):
        """Options without a text behind them: from column 30 on, or in the next line."""
        found = re.findall(r"^(\s+(?:-\w,\s*)?(--[a-z][\w-]*)[^\n]*)\n(?=([^\n]*))", self.help(program, command), re.M)
        return [name for line, name, below in found
                if not re.match(r".{29} \S", line) and not re.match(r"\s{20,}\S", below)]

    def every_option(self, program):
        """Options of a program and of all its commands."""
        names = set(OPTION.findall(self.help(program)))
        return names.union(*[OPTION.findall(self.help(program, command)) for command in self.commands(program)])


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def sections(text):
    """{title: text} of the ### sections of a page."""
    parts = re.split(r"^###? (.*)$", text, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2]))


def rows_with(option, text):
    """Rows of tables whose first cell names the option."""
    return [line for line in text.splitlines()
            if line.startswith("|") and re.search(r"%s(?![\w-])" % option, line.split("|")[1])]


def number_or_text(word):
    """1.0 and 1 are one number; an address of a machine is none."""
    try:
        return float(word)
    except ValueError:
        return word


def check_command(programs, program, command, text, page, complaints):
    """The options of a command against its text, and whether --help explains them."""
    where = "%s: %s" % (page, " ".join(filter(None, [program, command])))
    options = programs.options(program, command)
    for option in programs.unexplained(program, command):
        complaints.append("%s --help: %s is not explained" % (" ".join(filter(None, [program, command])), option))
    for option, default in options.items():
        rows = rows_with(option, text)
        cells = rows[0].split("|") if rows else []
        alone = rows and len(OPTION.findall(cells[1])) == 1
        if default and alone and re.fullmatch(r"[-+.\de\[\],]+", default):
            # In the column of defaults, where the table has one.
            text_of_default = cells[3] if len(cells) >= 6 else rows[0]
            written = [number_or_text(word) for word in re.findall(r"-?\d+(?:\.\d+)*(?:e[-+]?\d+)?", text_of_default)]
            for value in default.strip("[]").split(","):
                if number_or_text(value) not in written:
                    complaints.append("%s: the default %s of %s is not there" % (where, value, option))
    for line in text.splitlines():
        if line.startswith("| `--"):
            for option in OPTION.findall(line.split("|")[1]):
                if option not in options:
                    complaints.append("%s: %s does not exist" % (where, option))
    # In prose, options alone in backticks: of this command, or of another one that the section speaks of.
    for span in re.findall(r"`(--[a-z][^`\n]*)`", text):
        for option in OPTION.findall(span):
            if option not in options and not any(option in programs.every_option(known) for known in KNOWN):
                complaints.append("%s: %s does not exist" % (where, option))


def command_lines(text):
    """Command lines in code blocks and in backticks."""
    for kind, block in re.findall(r"^```([^`\n]*)\n(.*?)^```", text, re.M | re.S):
        if kind in ("", "sh", "bash", "console"):
            yield from re.sub(r"\\\n\s*", " ", block).splitlines()
    yield from (line.strip() for line in re.findall(r"^    (?:\S.*)$", text, re.M))
    for span in re.findall(r"(?<!`)`([^`]+)`(?!`)", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)):
        yield " ".join(span.split())


def only_at_night(program):
    """Whether the program holds results or times against others: a tree of the day does not build most of these."""
    source = "".join(word.capitalize() for word in program.split("-")) + ".cxx"
    return any(os.path.exists(os.path.join(ROOT, "Testing", folder, source)) for folder in ("Validation", "Benchmarks"))


def check_line(programs, line, page, complaints):
    """Programs, commands and options of a command line."""
    try:
        words = shlex.split(line, comments=True)
    except ValueError:
        return
    names = [(index, os.path.basename(word)) for index, word in enumerate(words)]
    for index, name in names:
        if not re.fullmatch(r"coronary-(pipeline|simulator|posing|device-emulator)|validate-[\w-]+|[\w-]+-benchmark", name):
            continue
        if words[index].startswith("scripts/") or not programs.exists(name):
            if words[index] == name and index == 0 and not only_at_night(name):
                complaints.append("%s: there is no program %s" % (page, name))
            return
        rest = words[index + 1:]
        command = ""
        if programs.commands(name) and rest and re.fullmatch(r"[a-z-]+", rest[0]) and not rest[0].startswith("-"):
            command = rest[0]
            if command not in programs.commands(name):
                complaints.append("%s: %s has no command %s" % (page, name, command))
                return
        for option in [word.split("=")[0] for word in rest if OPTION.fullmatch(word.split("=")[0])]:
            if not re.search(r"%s(?![\w-])" % option, programs.help(name, command)) and "benchmark_" not in option:
                complaints.append("%s: %s has no option %s: %s" % (page, name, option, line))
        return


def main(arguments):
    if len(arguments) != 1 or not os.path.isdir(arguments[0]):
        sys.stderr.write(__doc__)
        return 2
    programs = Programs(arguments[0])
    complaints = []
    parts = sections(read(COMMANDS_PAGE))
    for command in programs.commands("coronary-pipeline"):
        if command not in parts:
            complaints.append("%s: %s has no section" % (COMMANDS_PAGE, command))
        check_command(programs, "coronary-pipeline", command, parts.get(command, ""), COMMANDS_PAGE, complaints)
        if not re.search(r"^\| `%s` \|" % command, parts["coronary-pipeline"], re.M):
            complaints.append("%s: %s is not in the table of commands" % (COMMANDS_PAGE, command))
    for program, page in PAGES.items():
        if programs.exists(program):
            check_command(programs, program, "", read(page), page, complaints)
    pages = ["README.md"] + sorted(os.path.relpath(path, ROOT) for path in glob.glob(os.path.join(ROOT, "docs", "*.md")))
    lines = 0
    for page in pages:
        for line in command_lines(read(page)):
            check_line(programs, line, page, complaints)
            lines += 1
    print("\n".join(complaints) if complaints
          else "ok: options of the programs; %d lines of code on %d pages" % (lines, len(pages)))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
