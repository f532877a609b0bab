"""A moving mesh saved as a user saves it, and opened again: lists, times, ids, the boundary's faces."""
import csv
import json
import os
import sys

from paraview import servermanager, simple

from coronary_testing import (SURFACE, fetch, load_plugin, quick_phantom, require,
                              skinning_pipeline, write_skeleton)

plugin, folder = sys.argv[1:3]
PHASES = [0.0, 0.25, 0.35, 0.75]


def values(array):
    return [array.GetTuple1(index) for index in range(array.GetNumberOfTuples())]


def opened(path, time):
    source = simple.OpenDataFile(path)
    require(source is not None, "ParaView does not open " + path)
    return list(source.TimestepValues), fetch(source, 0, time)


def moving_surface():
    phantom = quick_phantom(Seed=3)
    phantom.Phases = PHASES
    surface = simple.OutputPort(phantom, SURFACE)
    report = os.path.join(folder, "wall.json")
    simple.SaveData(report, proxy=surface)
    with open(report) as file:
        phases = json.load(file)["phases"]
    require([phase["time"] for phase in phases] == PHASES, "phases of the report: %s" % phases)
    with open(os.path.join(folder, "wall_quality.csv")) as file:
        areas = [float(row["surface_area_mm2"]) for row in csv.DictReader(file)]
    require(len(set(areas)) == len(PHASES), "the wall does not move: %s" % areas)
    for name in ("wall_surface.pvd", "wall_surface.vtp.series"):
        for time in PHASES:
            times, data = opened(os.path.join(folder, name), time)
            require(times == PHASES, "%s has the times %s" % (name, times))
            truth = fetch(phantom, SURFACE, time)
            require(data.GetNumberOfPoints() == truth.GetNumberOfPoints() > 100,
                    "%s has %d points" % (name, data.GetNumberOfPoints()))
            require(bytes(memoryview(data.GetPoints().GetData())) ==
                    bytes(memoryview(truth.GetPoints().GetData())), name + " has other points")
            require(min(values(data.GetCellData().GetArray("CellEntityIds"))) == 1.0,
                    name + " has no ids of faces")


def tetrahedra():
    ball = simple.Sphere(Radius=2.0, ThetaResolution=16, PhiResolution=12)
    mesher = simple.TetrahedralMesher(ball)
    mesher.UpdatePipeline()
    path = os.path.join(folder, "ball.json")
    simple.SaveData(path, proxy=simple.OutputPort(mesher, 0), Boundary=simple.OutputPort(mesher, 1),
                    Series=0, SimVascular=1, VMTK=1)
    with open(path) as file:
        report = json.load(file)
    require(report["tetrahedra"] > 100 and len(report["phases"]) == 1, "the report: %s" % report)
    require([face["name"] for face in report["faces"]] == ["wall"], "faces: %s" % report["faces"])
    require(not os.path.exists(os.path.join(folder, "ball_volume.pvd")), "a series was written")
    exterior = os.path.join(folder, report["phases"][0]["files"]["simvascular"],
                            "mesh-complete.exterior.vtp")
    data = fetch(simple.OpenDataFile(exterior), 0, 0.0)
    require(data.GetNumberOfPolys() == report["triangles"], "the exterior is not whole")
    require(min(values(data.GetPointData().GetArray("GlobalNodeID"))) == 1.0, "ids begin with 1")


def skinned_surface():
    """A surface on bones as a user of File > Save Data has it, in the formats of viewers."""
    moved = skinning_pipeline(write_skeleton(folder), Edits=[1, 0, 0, 20, 0, 0, 0, 0, 1, 0])[2]
    moved.Blend = "Linear"
    path = os.path.join(folder, "skin.json")
    simple.SaveData(path, proxy=moved, Series=0, OBJ=1, PLY=1, STL=1, GLTF=1, GLTFInfluences=8)
    with open(path) as file:
        report = json.load(file)
    for kind in ("obj", "ply", "stl"):
        data = fetch(simple.OpenDataFile(os.path.join(folder, "skin_surface_000." + kind)), 0, 0.0)
        require(data.GetNumberOfPolys() == report["triangles"], kind + " is not whole")
    with open(os.path.join(folder, report["files"]["gltf"]), "rb") as file:
        content = file.read()
    require(content[:4] == b"glTF", "no glTF file")
    size = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20:20 + size])
    require(max(document["scenes"][0]["extras"]["largest_deviation_mm"]) < 1e-3,
            "glTF shows another shape: %s" % document["scenes"][0]["extras"])


load_plugin(plugin)
require(hasattr(servermanager.writers, "MeshSequenceWriter"), "there is no writer")
moving_surface()
tetrahedra()
skinned_surface()
print("done")
