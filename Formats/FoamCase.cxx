#include "FoamCase.h"

#include "FoamMesh.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace coronary
{
namespace
{
using NamedText = std::pair<std::string, std::string>;

/// The solver's motion lags where the mesh is not orthogonal: in greater steps than these it folds.
constexpr int LeastCheckedSteps = 100;

/// Of scripts: Debian's programs do not find their files by themselves.
const std::string Environment =
  ": \"${WM_PROJECT_DIR:=/usr/share/openfoam}\"\nexport WM_PROJECT_DIR\n";

/// Read back to the same bits.
std::string Number(double value)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

/// Enough to say a length of time by.
std::string Short(double value)
{
  return FoamTime(value);
}

std::string Entry(const std::string& name, const std::string& value, int depth = 0)
{
  return std::string(4 * static_cast<std::size_t>(depth), ' ') + name + " " + value + ";\n";
}

std::string Block(const std::string& name, const std::string& body, int depth = 0)
{
  const std::string indent(4 * static_cast<std::size_t>(depth), ' ');
  return indent + name + "\n" + indent + "{\n" + body + indent + "}\n";
}

/// A series of the solver's expressions; of a steady case its mean.
std::string SeriesText(const std::vector<double>& series, double cycle, bool steady)
{
  std::string text = series.empty() ? "0" : Number(series[0]);
  for (std::size_t k = 1; !steady && k + 1 < series.size(); k += 2)
  {
    const std::string angle =
      Number(2.0 * M_PI * static_cast<double>((k + 1) / 2) / cycle) + "*time()";
    // The solver's grammar knows no sign before a number behind an operator.
    text += " + (" + Number(series[k]) + ")*cos(" + angle + ") + (" + Number(series[k + 1]) +
      ")*sin(" + angle + ")";
  }
  return text;
}

std::string Variables(const std::vector<std::string>& lines)
{
  std::string text = "        variables\n        (\n";
  for (const std::string& line : lines)
  {
    text += "            \"" + line + ";\"\n";
  }
  return text + "        );\n";
}

std::string Stored(const std::vector<NamedText>& starts)
{
  std::string text = "        storedVariables\n        (\n";
  for (const auto& [name, start] : starts)
  {
    text += "            { name " + name + "; initialValue \"" + start + "\"; }\n";
  }
  return text + "        );\n";
}

/// Plug flow, in the frame of the inlet where that moves: its own velocity is as the time scheme (backward) has it.
std::string InletVelocity(const FoamCase& flow)
{
  std::vector<std::string> variables{ "Q=" + SeriesText(flow.inflow, flow.cycle, flow.steady),
    "A=sum(area())" };
  std::string stored;
  if (flow.moving)
  {
    // Several evaluations a step: only the first one sees time go on.
    stored = Stored(
      { { "told", "time()" }, { "cold", "pos()" }, { "v", "0*pos()" }, { "vold", "0*pos()" } });
    variables.insert(variables.end(),
      { "h=time()-told", "vold=(h > 0) ? v : vold", "v=(h > 0) ? (pos() - cold)/(h + 1e-30) : v",
        "cold=pos()", "told=time()" });
  }
  return Entry("type", "exprFixedValue", 2) + Entry("value", "uniform (0 0 0)", 2) + stored +
    Variables(variables) +
    Entry("valueExpr",
      std::string("\"") + (flow.moving ? "1.5*v - 0.5*vold " : "") + "-(Q/A)*face()/area()\"", 2);
}

/// Kinematic, as the solver wants it. It steps once a time step, with the flow of the step before.
std::string OutletPressure(const FoamCase& flow, const FoamOutlet& outlet)
{
  const double rho = flow.density;
  const std::string venous = Number(flow.venousPressure / rho);
  const std::string flux = "Q=sum(phi)";
  if (flow.steady || !(outlet.compliance > 0.0))
  {
    return Entry("type", "exprFixedValue", 2) +
      Entry("value", "uniform " + Number(flow.startPressure / rho), 2) + Variables({ flux }) +
      Entry("valueExpr",
        "\"" + venous + " + " + Number((outlet.proximal + outlet.distal) / rho) + "*Q\"", 2);
  }
  const std::string muscle = SeriesText(flow.musclePressure, flow.cycle, false);
  const std::string inverse = Number(1.0 / (outlet.compliance * rho));
  const std::string rate = Number(1.0 / (outlet.compliance * outlet.distal));
  return Entry("type", "exprFixedValue", 2) +
    Entry("value", "uniform " + Number(flow.startPressure / rho), 2) +
    Stored({ { "pc", Number(flow.startPressure / rho) }, { "told", "time()" },
      { "mold", "(" + muscle + ")/" + Number(rho) } }) +
    Variables({ flux, "h=time()-told", "m=(" + muscle + ")/" + Number(rho),
      "pc=(pc + m - mold + h*" + inverse + "*Q + h*" + rate + "*" + venous + ")/(1 + h*" + rate +
        ")",
      "told=time()", "mold=m" }) +
    Entry("valueExpr", "\"pc + " + Number(outlet.proximal / rho) + "*Q\"", 2);
}

std::string Velocity(const FoamCase& flow)
{
  std::string patches = Block(flow.wall,
    Entry("type", flow.moving ? "movingWallVelocity" : "noSlip", 2) +
      (flow.moving ? Entry("value", "uniform (0 0 0)", 2) : ""),
    1);
  patches += Block(flow.inlet, InletVelocity(flow), 1);
  for (const FoamOutlet& outlet : flow.outlets)
  {
    patches += Block(outlet.patch,
      Entry("type", "inletOutlet", 2) + Entry("inletValue", "uniform (0 0 0)", 2) +
        Entry("value", "uniform (0 0 0)", 2),
      1);
  }
  return FoamHeader("volVectorField", "0", "U") + Entry("dimensions", "[0 1 -1 0 0 0 0]") +
    Entry("internalField", "uniform (0 0 0)") + Block("boundaryField", patches);
}

std::string Pressure(const FoamCase& flow)
{
  const std::string slope = Entry("type", "zeroGradient", 2);
  std::string patches = Block(flow.wall, slope, 1) + Block(flow.inlet, slope, 1);
  for (const FoamOutlet& outlet : flow.outlets)
  {
    patches += Block(outlet.patch, OutletPressure(flow, outlet), 1);
  }
  return FoamHeader("volScalarField", "0", "p") + Entry("dimensions", "[0 2 -2 0 0 0 0]") +
    Entry("internalField", "uniform " + Number(flow.startPressure / flow.density)) +
    Block("boundaryField", patches);
}

std::vector<std::string> PatchesOf(const FoamCase& flow)
{
  std::vector<std::string> names{ flow.wall, flow.inlet };
  for (const FoamOutlet& outlet : flow.outlets)
  {
    names.push_back(outlet.patch);
  }
  return names;
}

std::string PointDisplacement(const FoamCase& flow)
{
  std::string patches;
  for (const std::string& name : PatchesOf(flow))
  {
    patches += Block(name,
      Entry("type", "timeVaryingMappedFixedValue", 2) + Entry("mapMethod", "nearest", 2) +
        Entry("setAverage", "off", 2) + Entry("value", "uniform (0 0 0)", 2),
      1);
  }
  return FoamHeader("pointVectorField", "0", "pointDisplacement") +
    Entry("dimensions", "[0 1 0 0 0 0 0]") + Entry("internalField", "uniform (0 0 0)") +
    Block("boundaryField", patches);
}

std::string Transport(const FoamCase& flow)
{
  std::string text = FoamHeader("dictionary", "constant", "transportProperties");
  if (flow.blood == BloodModel::Newtonian)
  {
    return text + Entry("transportModel", "Newtonian") +
      Entry("nu", "[0 2 -1 0 0 0 0] " + Number(flow.viscosity / flow.density));
  }
  return text + Entry("transportModel", "BirdCarreau") +
    Block("BirdCarreauCoeffs",
      Entry("nu0", "[0 2 -1 0 0 0 0] " + Number(0.056 / flow.density), 1) +
        Entry("nuInf", "[0 2 -1 0 0 0 0] " + Number(0.00345 / flow.density), 1) +
        Entry("k", "[0 0 1 0 0 0 0] 3.313", 1) + Entry("n", "[0 0 0 0 0 0 0] 0.3568", 1));
}

std::string PatchFunction(const FoamCase& flow, const std::string& patch, bool pressure)
{
  const bool each = !flow.steady;
  return Block((pressure ? "pressure_" : "flow_") + patch,
    Entry("type", "surfaceFieldValue", 2) + Entry("libs", "(fieldFunctionObjects)", 2) +
      Entry("writeControl", each ? "timeStep" : "onEnd", 2) + Entry("writeFields", "false", 2) +
      Entry("log", "false", 2) + Entry("regionType", "patch", 2) + Entry("name", patch, 2) +
      Entry("operation", pressure ? "areaAverage" : "sum", 2) +
      Entry("fields", pressure ? "(p)" : "(phi)", 2),
    1);
}

std::string Control(const FoamCase& flow)
{
  const double step = flow.cycle / flow.stepsPerCycle;
  std::string text = FoamHeader("dictionary", "system", "controlDict");
  text += Entry("application", flow.steady ? "simpleFoam" : "pimpleFoam") +
    Entry("startFrom", "latestTime") + Entry("startTime", "0") + Entry("stopAt", "endTime") +
    Entry("endTime", flow.steady ? "3000" : Short(flow.cycle * flow.cycles)) +
    Entry("deltaT", flow.steady ? "1" : Short(step)) +
    Entry("writeControl", flow.steady ? "timeStep" : "runTime") +
    Entry("writeInterval", flow.steady ? "3000" : Short(flow.cycle / flow.picturesPerCycle)) +
    Entry("purgeWrite", "0") + Entry("writeFormat", "ascii") + Entry("writePrecision", "12") +
    Entry("timeFormat", "general") + Entry("timePrecision", "10") +
    Entry("runTimeModifiable", "false");
  std::string functions = Block("wallShear",
    Entry("type", "wallShearStress", 2) + Entry("libs", "(fieldFunctionObjects)", 2) +
      Entry("patches", "(" + flow.wall + ")", 2) + Entry("writeControl", "writeTime", 2) +
      Entry("log", "false", 2),
    1);
  if (!flow.steady)
  {
    functions += Block("wallShearSize",
      Entry("type", "mag", 2) + Entry("libs", "(fieldFunctionObjects)", 2) +
        Entry("field", "wallShearStress", 2) + Entry("result", "wallShearSize", 2) +
        Entry("writeControl", "writeTime", 2) + Entry("log", "false", 2),
      1);
    std::string fields;
    for (const char* field : { "wallShearStress", "wallShearSize" })
    {
      fields += Block(field,
        Entry("mean", "on", 4) + Entry("prime2Mean", "off", 4) + Entry("base", "time", 4), 3);
    }
    functions += Block("cycleMeans",
      Entry("type", "fieldAverage", 2) + Entry("libs", "(fieldFunctionObjects)", 2) +
        Entry("timeStart", Short(flow.cycle * (flow.cycles - 1) + 0.5 * step), 2) +
        Entry("writeControl", "writeTime", 2) + Entry("log", "false", 2) +
        "        fields\n        (\n" + fields + "        );\n",
      1);
  }
  for (const std::string& patch : PatchesOf(flow))
  {
    if (patch != flow.wall)
    {
      functions += PatchFunction(flow, patch, false) + PatchFunction(flow, patch, true);
    }
  }
  return text + Block("functions", functions);
}

std::string Schemes(const FoamCase& flow)
{
  const std::string bounded = flow.steady ? "bounded " : "";
  return FoamHeader("dictionary", "system", "fvSchemes") +
    Block("ddtSchemes", Entry("default", flow.steady ? "steadyState" : "backward", 1)) +
    // In layers of prisms least squares and limited corrections have the friction wrong by 5 %; these by less than 1 %.
    Block("gradSchemes", Entry("default", "Gauss linear", 1)) +
    Block("divSchemes",
      Entry("default", "none", 1) + Entry("div(phi,U)", bounded + "Gauss linearUpwind grad(U)", 1) +
        Entry("div((nuEff*dev2(T(grad(U)))))", "Gauss linear", 1)) +
    Block("laplacianSchemes", Entry("default", "Gauss linear corrected", 1)) +
    Block("interpolationSchemes", Entry("default", "linear", 1)) +
    Block("snGradSchemes", Entry("default", "corrected", 1));
}

std::string Solution(const FoamCase& flow)
{
  const auto solver = [](const std::string& relative)
  {
    return Entry("solver", "GAMG", 2) + Entry("smoother", "GaussSeidel", 2) +
      Entry("tolerance", "1e-8", 2) + Entry("relTol", relative, 2);
  };
  const auto smooth = [](const std::string& relative)
  {
    return Entry("solver", "smoothSolver", 2) + Entry("smoother", "symGaussSeidel", 2) +
      Entry("tolerance", "1e-9", 2) + Entry("relTol", relative, 2);
  };
  std::string text = FoamHeader("dictionary", "system", "fvSolution");
  if (flow.steady)
  {
    return text + Block("solvers", Block("p", solver("0.05"), 1) + Block("U", smooth("0.1"), 1)) +
      Block("SIMPLE",
        Entry("nNonOrthogonalCorrectors", "1", 1) + Entry("consistent", "yes", 1) +
          Block("residualControl", Entry("p", "1e-6", 2) + Entry("U", "1e-7", 2), 1)) +
      Block("relaxationFactors", Block("equations", Entry("U", "0.8", 2), 1));
  }
  return text +
    Block("solvers",
      Block("p", solver("0.02"), 1) + Block("pFinal", solver("0"), 1) +
        // Of the flux before the pressure's own corrections, which decide.
        Block("\"pcorr.*\"",
          Entry("solver", "GAMG", 2) + Entry("smoother", "GaussSeidel", 2) +
            Entry("tolerance", "1e-5", 2) + Entry("relTol", "0", 2),
          1) +
        Block("U", smooth("0.05"), 1) + Block("UFinal", smooth("0"), 1) +
        Block("cellDisplacement",
          Entry("solver", "GAMG", 2) + Entry("smoother", "GaussSeidel", 2) +
            Entry("tolerance", "1e-10", 2) + Entry("relTol", "0", 2),
          1)) +
    Block("PIMPLE",
      // With two corrections of the pressure a coronary tree's flow diverges at a Courant number of 20.
      Entry("nOuterCorrectors", "2", 1) + Entry("nCorrectors", "3", 1) +
        Entry("nNonOrthogonalCorrectors", "1", 1) +
        Entry("correctPhi", flow.moving ? "yes" : "no", 1) + Entry("checkMeshCourantNo", "no", 1));
}

std::string DynamicMesh(const FoamCase& flow)
{
  std::string text = FoamHeader("dictionary", "constant", "dynamicMeshDict");
  if (!flow.moving)
  {
    return text + Entry("dynamicFvMesh", "staticFvMesh");
  }
  return text + Entry("dynamicFvMesh", "dynamicMotionSolverFvMesh") +
    Entry("motionSolverLibs", "(fvMotionSolvers)") +
    Entry("motionSolver", "displacementLaplacian") +
    Block("displacementLaplacianCoeffs",
      Entry("diffusivity", "inverseDistance (" + flow.wall + ")", 1));
}

std::string Readme(const FoamCase& flow)
{
  std::string text = "# " + flow.title +
    "\n\nA case for OpenFOAM (ESI's; made for Debian's 1912). Metres and seconds, LPS axes; `p` is "
    "pressure over density (" +
    Short(flow.density) + " kg/m^3).\n\n";
  text += flow.moving ? "The walls move: `constant/boundaryData` has the displacement of every "
                        "point of every patch over a cycle of " +
      Short(flow.cycle) + " s, and the solver's own Laplacian moves what is inside.\n"
                      : "The walls are at rest.\n";
  text += "\n    checkMesh            # the mesh at rest\n";
  if (flow.moving)
  {
    text += "    sh Allcheck          # the mesh over a cycle\n";
  }
  text += "    sh Allrun            # " +
    std::string(flow.steady ? "steady flow" : "the flow, again from where it was stopped") +
    "\n\nIn ParaView open `case.foam`. `postProcessing` has flow (m^3/s, out of the mesh) and "
    "pressure of each end.\n";
  if (!flow.steady)
  {
    text += "`wallShearStressMean` and `wallShearSizeMean` (over density) of the last time are "
            "means over the last cycle: TAWSS is the "
            "second one, OSI is 0.5 (1 - |first| / second).\n";
  }
  text += "\n| outlet | proximal (Pa s/m^3) | distal | compliance (m^3/Pa) |\n|---|---|---|---|\n";
  for (const FoamOutlet& outlet : flow.outlets)
  {
    text += "| " + outlet.patch + " | " + Short(outlet.proximal) + " | " + Short(outlet.distal) +
      " | " + Short(outlet.compliance) + " |\n";
  }
  return text + "\nMean inflow " + Short(1e6 * (flow.inflow.empty() ? 0.0 : flow.inflow[0])) +
    " mL/s. How all this was chosen, and how far it can be trusted: docs/flow.md of "
    "DynamicCoronary.\n";
}

/// What makes a stopped case fit to go on: functions for Allrun.
constexpr const char* GoOn = R"sh(
# Whether the folder of a time was written to its end.
whole() {
  for file in U p phi uniform/time $must_have; do
    [ -e "$1/$file" ] || return 1
  done
  for file in "$1"/*; do
    [ -d "$file" ] || tail -c 100 "$file" | grep -q '^// [*][*][*]' || return 1
  done
}
for time in $(ls | grep -x '[0-9][0-9.]*\(e-[0-9]*\)\{0,1\}' | sort -g -r); do
  if [ "$time" = 0 ] || whole "$time"; then
    break
  fi
  echo "Allrun: $time was not written to its end; it is unfinished_$time now" >&2
  rm -rf "unfinished_$time"
  mv "$time" "unfinished_$time"
done
)sh";

/// OpenFOAM 1912 writes two things that it does not read: mapped displacements, and stored vectors of expressions.
constexpr const char* MendMovingWalls = R"sh(
if [ "$time" != 0 ]; then
  file=$time/pointDisplacement
  sed '/^boundaryField/,$d' "$file" > mended
  sed -n '/^boundaryField/,$p' 0/pointDisplacement >> mended
  mv mended "$file"
  for file in "$time/U" "$time/U_0"; do
    [ -e "$file" ] || continue
    awk '/^ *isSingleValue +false;/ {
           print
           getline
           if (!/fieldSize/) {
             value = $0
             getline
             print "fieldSize " $1 ";"
             sub(/List<vector>/, "", value)
             print value
           }
         }
         { print }' "$file" > mended
    mv mended "$file"
  done
fi
)sh";

std::string RunScript(const FoamCase& flow)
{
  std::string text = "#!/bin/sh\n# Runs the case, on from its latest time.\nset -e\ncd \"$(dirname "
                     "\"$0\")\"\n" +
    Environment + "must_have='" + (flow.moving ? "pointDisplacement polyMesh/points" : "") + "'" +
    GoOn;
  if (flow.moving)
  {
    text += MendMovingWalls;
    text += "# The later cycles are as the first.\n"
            "for patch in constant/boundaryData/*; do\n"
            "  for now in \"$patch\"/[0-9]*; do\n"
            "    [ -L \"$now\" ] && continue\n"
            "    cycle=1\n"
            "    while [ \"$cycle\" -lt " +
      std::to_string(static_cast<int>(std::ceil(flow.cycles))) +
      " ]; do\n"
      "      then=$(awk -v t=\"${now##*/}\" -v n=\"$cycle\" 'BEGIN { printf \"%.10g\", t + n * " +
      Short(flow.cycle) +
      " }')\n"
      "      [ -e \"$patch/$then\" ] || ln -s \"${now##*/}\" \"$patch/$then\"\n"
      "      cycle=$((cycle + 1))\n"
      "    done\n"
      "  done\n"
      "done\n";
  }
  return text + (flow.steady ? "simpleFoam" : "pimpleFoam") + " >> log.solver 2>&1\n";
}
}

void FoamCase::Validate() const
{
  Require(!this->outlets.empty(), "a case for OpenFOAM needs an outlet");
  Require(this->cycle > 0.0 && this->cycles >= 1.0 && this->stepsPerCycle >= 1 &&
      this->picturesPerCycle >= 1,
    "cycles, steps and pictures of a case for OpenFOAM must be positive");
  // The means are written with the last picture.
  const double pictures = this->cycles * this->picturesPerCycle;
  Require(std::abs(pictures - std::round(pictures)) < 1e-6,
    "a case for OpenFOAM ends with a picture: its cycles are whole parts of " +
      std::to_string(this->picturesPerCycle));
  Require(this->density > 0.0 && this->viscosity > 0.0, "density and viscosity must be positive");
  for (const FoamOutlet& outlet : this->outlets)
  {
    Require(outlet.proximal >= 0.0 && outlet.distal >= 0.0 && outlet.compliance >= 0.0 &&
        (outlet.compliance == 0.0 || outlet.distal > 0.0),
      "outlet " + outlet.patch + ": resistances and compliance must not be negative");
  }
}

std::vector<NamedText> FoamCaseFiles(const FoamCase& flow)
{
  flow.Validate();
  std::vector<NamedText> files{
    { "0/U", Velocity(flow) },
    { "0/p", Pressure(flow) },
    { "constant/transportProperties", Transport(flow) },
    { "constant/turbulenceProperties",
      FoamHeader("dictionary", "constant", "turbulenceProperties") +
        Entry("simulationType", "laminar") },
    { "constant/dynamicMeshDict", DynamicMesh(flow) },
    { "system/controlDict", Control(flow) },
    { "system/fvSchemes", Schemes(flow) },
    { "system/fvSolution", Solution(flow) },
    { "README.md", Readme(flow) },
    { "Allrun", RunScript(flow) },
    { "case.foam", "" },
  };
  if (flow.moving)
  {
    files.emplace_back("0/pointDisplacement", PointDisplacement(flow));
    files.emplace_back("Allcheck",
      "#!/bin/sh\n# Moves the mesh over a cycle, and checks it at each step; in a copy, which "
      "goes.\nset -e\ncd \"$(dirname \"$0\")\"\n" +
        Environment +
        "copy=$(mktemp -d)\ntrap 'rm -rf \"$copy\"' EXIT\ncp -r 0 constant system \"$copy\"\n"
        "sed -i -e '/^functions/,$d' -e 's/^endTime .*/endTime " +
        Short(flow.cycle) +
        ";/' "
        "-e 's/^deltaT .*/deltaT " +
        Short(flow.cycle / std::max(flow.stepsPerCycle / 10, LeastCheckedSteps)) +
        ";/' \"$copy/system/controlDict\"\n"
        "moveDynamicMesh -case \"$copy\" > log.check\n"
        "grep -c 'Mesh OK' log.check\n! grep -n -e '[*][*][*]' -e 'Failed' log.check\n");
  }
  return files;
}
}
