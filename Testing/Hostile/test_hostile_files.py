"""Files that mean harm, and machines that fail, before the programs as a user runs them.

Usage: test_hostile_files.py --pipeline PROGRAM --simulator PROGRAM [--only TEXT]

Each file is given to the command that reads it, with little memory. Expected: exit code 1, one line on the standard
error that names the file, nothing left in the output folder, and no more memory than the file is worth.
"""

import argparse
import base64
import concurrent.futures
import gzip
import json
import os
import resource
import struct
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

MEMORY = 4 << 30  # address space in bytes; a claim of 10 GB that is believed fails
RESIDENT = 400 << 10  # kilobytes
SECONDS = 30


@dataclass
class Case:
    """One file, and the command that is to refuse it; FILE, OUT and WORK in the command are replaced."""

    name: str
    content: bytes
    command: list
    program: str = "pipeline"
    says: str = ""
    taken: bool = False  # harmless after all: exit code 0 is as good


# Volumes --------------------------------------------------------------------------------------------------------------
MHA = (
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 1 1\n"
    "DimSize = {}\nElementType = MET_SHORT\nCompressedData = {}\nElementDataFile = LOCAL\n"
)
NRRD = (
    "NRRD0004\ntype: short\nendian: little\nencoding: {}\ndimension: 3\nsizes: {}\n"
    "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\n"
)


def nifti(sizes):
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *sizes, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 4, 16)
    struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)
    header[344:348] = b"n+1\0"
    return bytes(header)


def volumes():
    """Images: empty, of another kind, and of 10 or 20 GB that are not there."""
    huge = "2000 2000 2500"
    voxels = bytes(48)
    files = {
        "huge.mha": MHA.format(huge, "False").encode() + voxels,
        "huge-packed.mha": MHA.format(huge, "True").encode() + zlib.compress(voxels),
        "overflow.mha": MHA.format("2147483647 2147483647 2147483647", "False").encode() + voxels,
        "huge.nrrd": NRRD.format("raw", huge).encode() + voxels,
        "huge-packed.nrrd": NRRD.format("gzip", huge).encode() + gzip.compress(voxels),
        "huge.nii": nifti((2000, 2000, 2500)) + voxels,
        "huge-packed.nii.gz": gzip.compress(nifti((2000, 2000, 2500)) + voxels),
        "bomb.nii.gz": gzip.compress(nifti((32767, 32767, 32767)) + bytes(20 << 20)),
        "huge.vti": vti(2000, 2000, 2500),
        "deep.json": b"[" * 100000 + b"]" * 100000,
        "deep-object.json": b'{"phases":' * 100000 + b"1" + b"}" * 100000,
        "types.json": b'{"phases":{"fraction":[],"image":3}}',
        "infinite.json": b'{"cycle_ms":1e308,"phases":[{"fraction":1e999,"image":"a.mha"}]}',
        "utf8.json": b'{"phases":[{"fraction":0,"image":"\xff\xfe.mha"}]}',
        "itself.json": b'{"phases":[{"fraction":0,"image":"itself.json"}]}',
    }
    for name, content in files.items():
        yield Case(name, content, ["inspect", "--all", "FILE"])
    for end in ("mha", "mhd", "nrrd", "nhdr", "nii", "nii.gz", "vti", "json"):
        yield Case(f"empty.{end}", b"", ["inspect", "FILE"])
        yield Case(f"random.{end}", bytes(range(256)) * 4, ["inspect", "FILE"])
    yield Case("empty-run.nrrd", b"", ["run", "FILE", "--output", "OUT"])


# VTK's XML --------------------------------------------------------------------------------------------------------------
def array(name, kind, values, components=1, form="ascii", extra=""):
    text = " ".join(str(v) for v in values) if form == "ascii" else values
    return (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="{form}" {extra}>'
        f"{text}</DataArray>"
    )


def vtp(points="3", polys="1", coordinates=None, corners=(0, 1, 2), ends=(3,), head="", arrays=None):
    """Poly data of one triangle, with whatever is wrong about it."""
    if arrays is None:
        arrays = (
            "<Points>" + array("Points", "Float64", coordinates or (0, 0, 0, 1, 0, 0, 0, 1, 0), 3) + "</Points><Polys>"
            + array("connectivity", "Int64", corners) + array("offsets", "Int64", ends) + "</Polys>"
        )
    return (
        f'<?xml version="1.0"?>{head}<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
        f'header_type="UInt64"><PolyData><Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="0" '
        f'NumberOfStrips="0" NumberOfPolys="{polys}">{arrays}</Piece></PolyData></VTKFile>'
    ).encode()


def vtu(points="4", cells="1", corners=(0, 1, 2, 3), ends=(4,), types=(10,)):
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
        f'<UnstructuredGrid><Piece NumberOfPoints="{points}" NumberOfCells="{cells}"><Points>'
        + array("Points", "Float64", (0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1), 3) + "</Points><Cells>"
        + array("connectivity", "Int64", corners) + array("offsets", "Int64", ends) + array("types", "UInt8", types)
        + "</Cells></Piece></UnstructuredGrid></VTKFile>"
    ).encode()


def vti(x, y, z):
    extent = f"0 {x - 1} 0 {y - 1} 0 {z - 1}"
    return (
        f'<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
        f'<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="{extent}"><PointData>'
        + array("HU", "Int16", base64.b64encode(struct.pack("<Q", 8) + bytes(8)).decode(), 1, "binary")
        + "</PointData></Piece></ImageData></VTKFile>"
    ).encode()


BOMB = (
    '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {chr(98 + n)} "{("&" + chr(97 + n) + ";") * 10}">' for n in range(9))
    + "]>"
)


def surfaces():
    """Surfaces to `metrics`: claims, corners that do not exist, offsets that go back, entities that multiply."""
    block = base64.b64encode(struct.pack("<Q", 1 << 40) + bytes(16)).decode()
    packed = base64.b64encode(struct.pack("<4Q", 1 << 20, 1 << 30, 1 << 30, 8)).decode()
    bad_length = "<Points>" + array("Points", "Float64", block, 3, "binary") + "</Points>"
    files = {
        "claim-points.vtp": vtp(points="1000000000"),
        "claim-huge-points.vtp": vtp(points="9000000000000000000"),
        "claim-negative.vtp": vtp(points="-5"),
        "claim-polys.vtp": vtp(polys="1000000000"),
        "corner-outside.vtp": vtp(corners=(0, 1, 1000000000)),
        "corner-negative.vtp": vtp(corners=(0, 1, -7)),
        "offset-outside.vtp": vtp(ends=(3000000,)),
        "offset-negative.vtp": vtp(ends=(-3,)),
        "offset-back.vtp": vtp(polys="2", corners=(0, 1, 2, 2, 1, 0), ends=(6, 3)),
        "short-array.vtp": vtp(coordinates=(0, 0, 0)),
        "no-arrays.vtp": vtp(arrays=""),
        "no-cells.vtp": vtp(arrays="<Points>" + array("Points", "Float64", range(9), 3) + "</Points>"),
        "block-length.vtp": vtp(arrays=bad_length),
        "entities.vtp": vtp(head=BOMB, arrays="&j;"),
        "compressor.vtp": vtp(
            arrays="<Points>" + array("Points", "Float64", packed, 3, "binary") + "</Points>"
        ).replace(b'header_type="UInt64"', b'header_type="UInt64" compressor="vtkZLibDataCompressor"'),
        "appended.vtp": vtp(
            arrays='<Points><DataArray type="Float64" NumberOfComponents="3" format="appended" '
            'offset="9999999999"/></Points>'
        ).replace(b"</VTKFile>", b'<AppendedData encoding="raw">_1234</AppendedData></VTKFile>'),
        "cut.vtp": vtp()[:300],
        "deep.vtp": vtp(arrays="<A>" * 20000 + "</A>" * 20000),
        "nan.vtp": vtp(coordinates=("nan", 0, 0, 1, 0, 0, 0, 1, 0)),
        "type.vtp": vtp().replace(b"Float64", b"Float128"),
        "string.vtp": vtp().replace(b"Float64", b"String"),
        "components.vtp": vtp().replace(b'NumberOfComponents="3"', b'NumberOfComponents="-3"'),
        "huge-components.vtp": vtp().replace(b'NumberOfComponents="3"', b'NumberOfComponents="2000000000"'),
        "corner-outside.vtu": vtu(corners=(0, 1, 2, 400000)),
        "corner-negative.vtu": vtu(corners=(0, 1, 2, -4)),
        "offset-outside.vtu": vtu(ends=(4000000,)),
        "offset-negative.vtu": vtu(ends=(-4,)),
        "claim-points.vtu": vtu(points="1000000000"),
        "claim-cells.vtu": vtu(cells="1000000000"),
        "type.vtu": vtu(types=(255,)),
        "hexahedron-of-four.vtu": vtu(types=(12,)),
        "quadratic-of-four.vtu": vtu(types=(24,)),
        "polyhedron.vtu": vtu(types=(42,)),
        "corner.obj": b"v 0 0 0\nf 1 2 3\n",
        "corner-huge.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n",
        "nan.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "claim.off": b"OFF\n1000000000 1000000000 0\n0 0 0\n",
        "claim-huge.off": b"OFF\n9223372036854775807 1 0\n0 0 0\n",
        "claim.mesh": b"MeshVersionFormatted 2\nDimension 3\nVertices 1000000000\n0 0 0 0\n",
        "claim.stl": bytes(80) + struct.pack("<I", 0xFFFFFFFF) + bytes(50),
        "cut.stl": bytes(80) + struct.pack("<I", 100) + bytes(70),
        "text.stl": b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n",
        "claim.ply": ply(1000000000, 1000000000),
        "claim-negative.ply": ply(-5, 1),
        "corner.ply": ply(3, 1, "0 0 0\n1 0 0\n0 1 0\n3 0 1 77777777\n"),
        "list.ply": ply(3, 1, "0 0 0\n1 0 0\n0 1 0\n2000000000 0 1 2\n"),
        "binary-list.ply": ply(3, 1, None),
        "cut.ply": b"ply\nformat ascii 1.0\nelement vertex",
        "long-word.ply": b"ply\nformat " + b"a" * 100000 + b"\n",
    }
    for name, content in files.items():
        yield Case(name, content, ["metrics", "FILE", "FILE"])
    for end in ("vtp", "vtu", "obj", "off", "mesh", "stl", "ply"):
        yield Case(f"empty.{end}", b"", ["metrics", "FILE", "FILE"])
        yield Case(f"random.{end}", bytes(range(256)) * 4, ["metrics", "FILE", "FILE"])


def ply(points, faces, body=""):
    form = "ascii" if body is not None else "binary_little_endian"
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {points}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if body is None:
        return head + struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<B3i", 255, 0, 1, 2)
    return head + body.encode()


# Lines, lists, settings ---------------------------------------------------------------------------------------------------
def others():
    """Skeletons, matrices, lists of files, settings, what a session reads."""
    convert = ["convert", "FILE", "WORK/made.vtp"]
    yield Case("empty.tgf", b"", convert)
    yield Case("loop.tgf", b"1 0 0 0\n2 1 0 0\n#\n1 2\n2 1\n", convert)
    yield Case("number.tgf", b"1 0 0 1e999\n2 1 0 0\n#\n1 2\n", convert)
    yield Case("cut.tgf", b"1 0 0", convert)
    for name in ("corner-outside", "offset-negative", "claim-points"):
        wrong = {
            "corner-outside": vtp(corners=(0, 1, 2222222)),
            "offset-negative": vtp(ends=(-3,)),
            "claim-points": vtp(points="1000000000"),
        }[name]
        lines = wrong.replace(b'NumberOfLines="0"', b'NumberOfLines="1"').replace(b"Polys>", b"Lines>")
        lines = lines.replace(b'NumberOfPolys="1"', b'NumberOfPolys="0"')
        yield Case(f"{name}-lines.vtp", lines, ["convert", "FILE", "WORK/made.tgf"])
    matrix = ["convert", "FILE", "WORK/made.dmat"]
    yield Case("empty.dmat", b"", matrix)
    yield Case("claim.dmat", b"100000 100000\n1 2 3\n", matrix)
    yield Case("claim-binary.dmat", b"0 0\n100000 100000\n12345678", matrix)
    yield Case("overflow.dmat", b"0 0\n4294967296 4294967296\n12345678", matrix)

    evaluate = ["evaluate", "--result", "FILE", "--truth", "FILE", "--output", "OUT", "--no-pictures"]
    yield Case("empty.pvd", b"", evaluate)
    yield Case("entities.pvd", (BOMB + "<VTKFile type='Collection'><Collection>&j;</Collection></VTKFile>").encode(),
               evaluate)
    yield Case("missing.pvd", b'<VTKFile type="Collection"><Collection><DataSet timestep="0" file="no.vtp"/>'
               b"</Collection></VTKFile>", evaluate)
    yield Case("infinite.pvd", b'<VTKFile type="Collection"><Collection><DataSet timestep="1e999" file="no.vtp"/>'
               b"</Collection></VTKFile>", evaluate)
    yield Case("deep.vtp.series", b'{"files":' * 100000 + b"1" + b"}" * 100000, evaluate)
    yield Case("types.vtp.series", b'{"files":[{"name":{},"time":"a"}]}', evaluate)

    settings = ["run", "--settings", "FILE", "--output", "OUT", "nothing.mha"]
    yield from json_cases("settings", settings, "pipeline", b'{"largest_radius":')
    scenario = ["--headless", "--ticks", "10", "--output", "OUT", "--scenario", "FILE"]
    yield from json_cases("scenario", scenario, "simulator", b'{"format":"dynamiccoronary scenario","version":')
    script = ["--headless", "--scenario", "phantom-lca", "--ticks", "10", "--output", "OUT", "--script", "FILE"]
    yield from json_cases("script", script, "simulator", b'{"format":"dynamiccoronary script","version":1,"pieces":')
    replay = ["--headless", "--output", "OUT", "--replay", "FILE"]
    yield Case("empty.pcirec", b"", replay, "simulator")
    yield Case("random.pcirec", bytes(range(256)), replay, "simulator")
    yield Case("claim.pcirec", b"PCIREC\0\2" + struct.pack("<I", 0xFFFFFFFF), replay, "simulator")
    deep = b"[" * 100000
    yield Case("deep.pcirec", b"PCIREC\0\2" + struct.pack("<I", len(deep)) + deep, replay, "simulator")


def json_cases(kind, command, program, start):
    """What a file of settings must not get through with."""
    files = {
        "empty": b"",
        "cut": start,
        "deep": b"[" * 100000 + b"]" * 100000,
        "deep-object": start + b'{"a":' * 100000 + b"1" + b"}" * 100000 + b"}",
        "not-an-object": b"[1,2,3]",
        "infinite": start + b"1e999}",
        "large": start + b"1e308}",
        "types": start + b'{"a":[null]}}',
        "utf8": start + b'"\xff\xfe"}',
        "unknown": start[:1] + b'"no such member":1}',
        "zeros": bytes(1000),
        "long-name": b'{"' + b"x" * 100000 + b'":1}',
        "newline-name": b'{"a\\nb\\u001b[31m":1}',
    }
    for name, content in files.items():
        yield Case(f"{kind}-{name}.json", content, command, program)


# The runs -----------------------------------------------------------------------------------------------------------------
def limited(limit_memory):
    if limit_memory:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(case, programs, work, limit_memory):
    """None when the case is as it should be, else what is wrong."""
    folder = work / case.name.replace(".", "-")
    folder.mkdir()
    path = folder / case.name
    path.write_bytes(case.content)
    out = folder / "out"
    names = {"FILE": str(path), "OUT": str(out)}
    command = [programs[case.program]]
    command += [names.get(word, word.replace("WORK", str(folder))) for word in case.command]
    with open(folder / "stderr", "w+b") as errors:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors,
                                   preexec_fn=lambda: limited(limit_memory), cwd=folder)
        timer = concurrent.futures.ThreadPoolExecutor(1)
        ended = timer.submit(os.wait4, process.pid, 0)
        try:
            _, status, usage = ended.result(SECONDS)
        except concurrent.futures.TimeoutError:
            process.kill()
            ended.result()
            return f"not over after {SECONDS} s"
        finally:
            timer.shutdown()
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        text = errors.read().decode(errors="replace")
    shown = text[:300] + ("..." if len(text) > 300 else "")
    left = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p not in (path, folder / "stderr"))
    if case.taken and process.returncode == 0:
        return None
    if process.returncode != 1:
        return f"exit code {process.returncode}: {shown}"
    if text.count("\n") != 1 or not text.endswith("\n"):
        return f"not one line: {shown}"
    if len(text) > 1000 + 2 * len(str(path)):
        return f"a line of {len(text)} bytes: {shown}"
    if case.name not in text or case.says not in text:
        return f"does not name the file: {shown}"
    if any(ord(c) < 32 for c in text[:-1]):
        return f"prints control characters: {shown!r}"
    if left:
        return f"leaves {left}"
    if limit_memory and usage.ru_maxrss > RESIDENT:
        return f"took {usage.ru_maxrss >> 10} MB"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pipeline", required=True)
    parser.add_argument("--simulator", required=True)
    parser.add_argument("--only", default="", help="cases whose name has this text")
    parser.add_argument("--any-memory", action="store_true", help="no limits of memory: sanitizers need a lot themselves")
    options = parser.parse_args()
    programs = {"pipeline": options.pipeline, "simulator": options.simulator}
    cases = [c for group in (volumes, surfaces, others) for c in group() if options.only in c.name]
    failed = 0
    with tempfile.TemporaryDirectory() as name, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for case, wrong in zip(cases, pool.map(lambda c: run(c, programs, Path(name), not options.any_memory), cases)):
            if wrong:
                failed += 1
                print(f"FAILED: {case.name}: {wrong}")
    print(f"{len(cases)} hostile files, {failed} failed")
    return 1 if failed or not cases else 0


if __name__ == "__main__":
    sys.exit(main())
