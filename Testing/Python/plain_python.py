"""The package dynamiccoronary in an ordinary python3: numpy arrays in and out, help, and what it says of another VTK."""

import importlib
import os
import subprocess
import sys
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData

import dynamiccoronary


def require(condition, what):
    if not condition:
        raise SystemExit("FAILED: " + what)


def vesselness_of_a_tube():
    """A bright tube along z through (20, 16): where vesselness is greatest, and how it depends on the tube's axis."""
    z, y, x = np.mgrid[0:24, 0:32, 0:40]
    tube = 300.0 * np.exp(-((x - 20.0) ** 2 + (y - 16.0) ** 2) / (2.0 * 1.5 ** 2))
    image = vtkImageData()
    image.SetDimensions(40, 32, 24)
    image.SetSpacing(0.5, 0.5, 0.5)
    values = numpy_to_vtk(tube.astype(np.float32).ravel(), deep=True)
    values.SetName("HU")
    image.GetPointData().SetScalars(values)
    vesselness = dynamiccoronary.vtkFrangiVesselness()
    vesselness.SetInputData(image)
    vesselness.SetSigmaMin(0.5)
    vesselness.SetSigmaMax(1.5)
    vesselness.SetGenerateDirection(True)
    vesselness.Update()
    data = vesselness.GetOutput().GetPointData()
    response = vtk_to_numpy(data.GetArray("Vesselness")).reshape(24, 32, 40)
    direction = vtk_to_numpy(data.GetArray("VesselDirection")).reshape(24, 32, 40, 3)
    require(np.unravel_index(np.argmax(response[12]), (32, 40)) == (16, 20), "vesselness is not greatest on the axis")
    require(abs(direction[12, 16, 20, 2]) > 0.999, "the direction on the axis is not that of the tube")
    require(response[12, 2, 2] < 0.05 * response[12, 16, 20], "vesselness away from the tube")


def every_class():
    """Every filter, reader and writer can be made, and says what it is."""
    names = [name for name in dir(dynamiccoronary) if name.startswith("vtk") and isinstance(getattr(dynamiccoronary, name), type)]
    require({"vtkFrangiVesselness", "vtkFastMarchingCenterline", "vtkFrenetSweepSurface", "vtkBiharmonicSkinWeights",
             "vtkCardiacPhaseInterpolator", "vtkMeshDistanceMetrics", "vtkGatedImageReader", "vtkMeshSequenceWriter"} <= set(names),
            "classes are missing: there are " + ", ".join(names))
    for name in names:
        kind = getattr(dynamiccoronary, name)
        require(kind().IsA("vtkAlgorithm"), name + " is no algorithm")
        require(kind.__doc__ and len(kind.__doc__) > 200, name + " has no help")


def refusal(version=None):
    """What importing the package says where VTK is missing, or another one."""
    with tempfile.TemporaryDirectory() as folder:
        os.makedirs(os.path.join(folder, "vtkmodules"))
        with open(os.path.join(folder, "vtkmodules", "__init__.py"), "w", encoding="utf-8"):
            pass
        if version:
            with open(os.path.join(folder, "vtkmodules", "vtkCommonCore.py"), "w", encoding="utf-8") as file:
                file.write("class vtkVersion:\n    @staticmethod\n    def GetVTKVersion():\n        return %r\n" % version)
        package = os.path.dirname(os.path.dirname(dynamiccoronary.__file__))
        run = subprocess.run([sys.executable, "-c", "import dynamiccoronary"], capture_output=True, text=True, check=False,
                             env=dict(os.environ, PYTHONPATH=os.pathsep.join([folder, package])))
    require(run.returncode == 1, "a package without its VTK was imported")
    return run.stderr.strip().splitlines()[-1]


vesselness_of_a_tube()
every_class()
built = vtkVersion.GetVTKVersion()
said = refusal("8.2.0")
require("built for Python" in said and built in said and "VTK 8.2.0" in said, "another VTK: " + said)
said = refusal()
require("needs VTK's Python modules" in said and "python3-vtk9" in said, "no VTK: " + said)
print("passed")
