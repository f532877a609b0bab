#!/usr/bin/env python3
"""The worked example of docs/coordinates-and-units.md: one volume in three formats, one place in the patient.

Usage: coordinates.py COMMAND..., where COMMAND starts coronary-pipeline.
Writes a volume of 4 x 5 x 6 voxels, turned by 90 degrees about the patient's long axis, as MetaImage (LPS), NRRD and NIfTI
(RAS), and asks `coronary-pipeline inspect` what it reads. Exit code 1 when the three differ from the example.
"""
import os
import struct
import subprocess
import sys
import tempfile

SIZE = (4, 5, 6)
SPACING = (0.5, 0.5, 0.6)
ORIGIN = (10, -20, 30)  # LPS
AXES = ((0, 1, 0), (-1, 0, 0), (0, 0, 1))  # of i, j, k in LPS: the columns of the direction matrix


def world(voxel):
    """LPS position of a voxel: origin + sum of index x spacing x axis."""
    return tuple(ORIGIN[row] + sum(voxel[n] * SPACING[n] * AXES[n][row] for n in range(3)) for row in range(3))


def ras(point):
    """The same place in RAS: left becomes minus right, posterior minus anterior."""
    return (-point[0], -point[1], point[2])


def write_volumes(folder):
    """The files, with the value i + 10 j + 100 k in voxel (i, j, k)."""
    values = b"".join(struct.pack("<h", i + 10 * j + 100 * k)
                      for k in range(SIZE[2]) for j in range(SIZE[1]) for i in range(SIZE[0]))
    meta = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 -20 30\nElementSpacing = 0.5 0.5 0.6\nDimSize = 4 5 6\n"
            "ElementType = MET_SHORT\nElementDataFile = LOCAL\n")
    nrrd = ("NRRD0004\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 5 6\n"
            "space directions: (0,-0.5,0) (0.5,0,0) (0,0,0.6)\nspace origin: (-10,20,30)\nkinds: domain domain domain\n"
            "endian: little\nencoding: raw\n\n")
    nifti = bytearray(352)
    struct.pack_into("<i", nifti, 0, 348)
    struct.pack_into("<8h", nifti, 40, 3, *SIZE, 1, 1, 1, 1)
    struct.pack_into("<2h", nifti, 70, 4, 16)  # signed short, 16 bits
    struct.pack_into("<4f", nifti, 76, 1, *SPACING)
    struct.pack_into("<2f", nifti, 108, 352, 1)  # where the voxels begin; slope
    nifti[123] = 2  # millimetres
    struct.pack_into("<h", nifti, 254, 1)  # the sform counts
    struct.pack_into("<12f", nifti, 280, 0, 0.5, 0, -10, -0.5, 0, 0, 20, 0, 0, 0.6, 30)
    nifti[344:348] = b"n+1\0"
    for name, header in (("lps.mha", meta.encode()), ("ras.nrrd", nrrd.encode()), ("ras.nii", bytes(nifti))):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(header + values)
    return "lps.mha", "ras.nrrd", "ras.nii"


def main(command):
    if not command:
        sys.stderr.write(__doc__)
        return 2
    wanted = ("spacing 0.5 0.5 0.6 mm, origin 10 -20 30 mm", "Axes: (0 1 0) (-1 0 0) (0 0 1)", "0 to 543 HU")
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        for name in write_volumes(folder):
            told = " ".join(subprocess.run(command + ["inspect", os.path.join(folder, name)], capture_output=True, text=True,
                                           check=True, timeout=60).stdout.split()).replace("( ", "(")
            missing = [text for text in wanted if text not in told]
            print("%s: %s" % (name, "as in the example" if not missing else "not told: %s, but: %s" % (missing, told)))
            failed += bool(missing)
    point = world((2, 3, 4))
    print("voxel (2, 3, 4): LPS %g %g %g, RAS %g %g %g" % (point + ras(point)))
    return 1 if failed or [round(value, 9) for value in point] != [8.5, -19, 32.4] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
