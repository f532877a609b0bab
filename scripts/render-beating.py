#!/usr/bin/env pvpython
"""A moving picture of a run's beating arteries, as an animated PNG at the speed of the heart.

  xvfb-run -a pvpython scripts/render-beating.py RUN --output docs/pictures/beating.png

RUN is a folder of coronary-pipeline run; README shows the demo's (demo-output/run). Branches have colours by artery.
"""
import argparse
import os
import struct
import xml.etree.ElementTree as ElementTree
import zlib

from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

import pictures

SLOWEST = 100  # ms a frame


def chunk(kind, data):
    """A chunk of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def chunks(png):
    """(kind, data) of each chunk of a PNG file."""
    at = 8
    while at < len(png):
        length, = struct.unpack(">I", png[at:at + 4])
        yield png[at + 4:at + 8], png[at + 8:at + 8 + length]
        at += 12 + length


def animated(frames, delays):
    """One PNG of several of equal size, which loops (APNG 1.0); delays in ms."""
    head = dict(chunks(frames[0]))[b"IHDR"]
    out = [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), chunk(b"acTL", struct.pack(">II", len(frames), 0))]
    number = 0
    for index, (frame, delay) in enumerate(zip(frames, delays)):
        out.append(chunk(b"fcTL", struct.pack(">I", number) + head[:8] + struct.pack(">IIHHBB", 0, 0, delay, 1000, 0, 0)))
        number += 1
        data = b"".join(content for kind, content in chunks(frame) if kind == b"IDAT")
        if index == 0:
            out.append(chunk(b"IDAT", data))
        else:
            out.append(chunk(b"fdAT", struct.pack(">I", number) + data))
            number += 1
    return b"".join(out + [chunk(b"IEND", b"")])


def png_of(window):
    """What a window shows, as a PNG file in memory."""
    shot = vtkWindowToImageFilter()
    shot.SetInput(window)
    shot.SetInputBufferTypeToRGB()
    shot.ReadFrontBufferOff()
    shot.Update()
    writer = vtkPNGWriter()
    writer.SetInputConnection(shot.GetOutputPort())
    writer.WriteToMemoryOn()
    writer.SetCompressionLevel(9)
    writer.Write()
    return bytes(memoryview(writer.GetResult()))


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("run")
parser.add_argument("--output", default="beating.png")
parser.add_argument("--size", type=int, default=480, help="pixels, across and down")
arguments = parser.parse_args()

listed = ElementTree.parse(os.path.join(arguments.run, "motion.pvd")).iter("DataSet")
times = [(float(entry.get("timestep")), os.path.join(arguments.run, entry.get("file"))) for entry in listed]
# One cycle: what comes later, or just before its end, repeats its beginning.
times = [entry for entry in times if entry[0] < times[0][0] + 0.98]
colours = pictures.branch_colors(pictures.read_poly(os.path.join(arguments.run, "centerline.vtp")))
walls = [pictures.read_poly(path) for _, path in times]

bounds = [walls[0].GetBounds()[side] for side in range(6)]
for wall in walls:
    for axis in range(3):
        bounds[2 * axis] = min(bounds[2 * axis], wall.GetBounds()[2 * axis])
        bounds[2 * axis + 1] = max(bounds[2 * axis + 1], wall.GetBounds()[2 * axis + 1])
center = [0.5 * (bounds[2 * axis] + bounds[2 * axis + 1]) for axis in range(3)]

frames = []
for (time, _), wall in zip(times, walls):
    panel = pictures.new_renderer()
    panel.GetActiveCamera().ParallelProjectionOn()
    mapper = pictures.add_surface(panel, wall).GetMapper()
    if wall.GetCellData().HasArray("GroupIds"):
        mapper.ScalarVisibilityOn()
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray("GroupIds")
        mapper.SetLookupTable(colours)
        mapper.UseLookupTableScalarRangeOn()
    pictures.look_at(panel, center, pictures.TOWARDS_VIEWER, (0, 0, 1), 0.52 * max(
        bounds[2 * axis + 1] - bounds[2 * axis] for axis in range(3)))
    panel.ResetCameraClippingRange()
    pictures.add_text(panel, "%2.0f %% R-R" % (100.0 * (time % 1.0)), 12, 12, 16, pictures.FAINT)
    window = pictures.off_screen((arguments.size, arguments.size), [panel])
    window.Render()
    frames.append(png_of(window))

cycle = walls[0].GetFieldData().GetArray("CycleLength")
cycle_ms = 1000.0 * cycle.GetTuple1(0) if cycle else 1000.0
ends = [time for time, _ in times[1:]] + [times[0][0] + 1.0]
delays = [min(SLOWEST, round(cycle_ms * (end - time))) for (time, _), end in zip(times, ends)]
with open(arguments.output, "wb") as file:
    file.write(animated(frames, delays))
print("%s: %d frames, %d bytes" % (arguments.output, len(frames), os.path.getsize(arguments.output)))
