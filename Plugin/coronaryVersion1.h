/**
 * @file coronaryVersion1.h
 * @brief What states of version 1 have and this version does not: proxies and properties, with what to do.
 *
 * A state has all properties of a proxy, so only those count whose value is another than the one of version 1.
 */
#ifndef coronaryVersion1_h
#define coronaryVersion1_h

namespace coronaryVersion1
{
struct MergedProxy
{
  const char* Proxy;
  const char* Successor;
  int FirstPort;        ///< of the successor, for what was port 0
  const char* Property; ///< that has another name now; may be null
  const char* SuccessorProperty;
  const char* Instead;
};

constexpr MergedProxy MergedProxies[] = {
  { "CoronaryBranchMetrics", "CoronaryCenterlineMetrics", 2, nullptr, nullptr,
    "the proxy is part of Centerline Metrics now, and was replaced by it: branches are its third "
    "and fourth output" },
  { "CoronaryCenterlineConversion", "CoronaryTreeTopology", 3, nullptr, nullptr,
    "the proxy is part of Coronary Tree Topology now, and was replaced by it: VMTK's lines are its "
    "fourth output, lines in "
    "VMTK's form its input; coronary-pipeline convert converts alone" },
  { "CoronaryGatedDICOMFolder", "CoronaryGatedImageReader", 0, "DirectoryName", "FileNames",
    "the proxy is part of Gated Image Reader now, and was replaced by it: open the folder like a "
    "file (FileNames)" },
};

/// A switch and a value that are one property now.
struct MergedSwitch
{
  const char* Proxy;
  const char* Switch;
  const char* Automatic; ///< with this the value did not count
  const char* Property;
  const char* Value; ///< that says so now
};

constexpr MergedSwitch MergedSwitches[] = {
  { "FastMarchingCenterline", "AutomaticSpeedThreshold", "1", "SpeedThreshold", "0" },
  { "FastMarchingCenterline", "AutomaticIntensityThreshold", "1", "IntensityThreshold", "0" },
  { "CoronaryTreeTopology", "AutomaticSmoothing", "1", "SmoothingWavelength", "-1" },
  { "VesselSegmentation", "AutomaticTubular", "1", "TubularVesselness", "0" },
  { "CoronaryMeshDistanceMetrics", "ClipEnds", "0", "EndLength", "0" },
};

/// The same property under another name.
struct RenamedProperty
{
  const char* Proxy;
  const char* Property;
  const char* Name;
};

constexpr RenamedProperty RenamedProperties[] = {
  { "CoronaryCenterlineMetrics", "LeastRadius", "MinimumRadius" },
  { "CoronaryCenterlineMetrics", "LeastLength", "MinimumLength" },
  { "CoronaryMotionRegularizer", "GreatestBending", "MaximumBending" },
  { "CoronaryMotionRegularizer", "LeastCurvatureRadius", "MinimumCurvatureRadius" },
  { "CoronaryMotionRegularizer", "GreatestStrain", "MaximumStrain" },
  { "CoronaryMotionRegularizer", "GreatestStep", "MaximumStep" },
  { "CoronarySkinDeformation", "LeastVolumeRatio", "MinimumVolumeRatio" },
  { "CoronarySurfaceCleaner", "SmallestComponent", "MinimumComponentShare" },
  { "VesselSegmentation", "LargestRadius", "MaximumRadius" },
  { "VesselSegmentation", "SmallestIsland", "MinimumIslandVolume" },
  { "VesselSegmentation", "LeastLinkConfidence", "MinimumLinkConfidence" },
};

struct GoneProperty
{
  const char* Proxy;
  const char* Property;
  const char* Default; ///< of version 1
  const char* Instead;
};

constexpr const char* FixedName =
  "names of arrays are fixed; rename the array of the output, or feed one with the fixed name";
constexpr const char* PhantomOption =
  "coronary-pipeline phantom has the option, vtkCoronaryPhantomSource the setter";

constexpr GoneProperty GoneProperties[] = {
  { "CoronaryBiharmonicSkinWeights", "Tolerance", "1e-6", "it is 1e-6; the class has the setter" },
  { "CoronaryBiharmonicSkinWeights", "Iterations", "2000",
    "2000 at most; the class has the setter" },
  { "CoronaryBiharmonicSkinWeights", "Widen", "1",
    "the neighbourhood is always widened where it is needed" },
  { "CoronaryBiharmonicSkinWeights", "BoneWeightsArrayName", "BoneWeights", FixedName },
  { "CoronaryBiharmonicSkinWeights", "BoneIndicesArrayName", "BoneIndices", FixedName },
  { "CoronaryBiharmonicSkinWeights", "BoneWeightsCompactArrayName", "BoneWeightsCompact",
    FixedName },
  { "CoronaryBiharmonicSkinWeights", "DroppedWeightArrayName", "DroppedWeight", FixedName },
  { "CoronaryBiharmonicSkinWeights", "BoneNameArrayName", "BoneName", FixedName },
  { "CoronaryBranchMetrics", "OverlapGate", "0.25", "it is 0.25" },
  { "CoronaryBranchMetrics", "LinesAreBranches", "0",
    "branches are the ways between forks and ends" },
  { "CoronaryBranchMetrics", "Spacing", "0.25", "it is 0.25 mm" },
  { "CoronaryBranchMetrics", "TimeTolerance", "0.001", "it is 0.001" },
  { "CoronaryBranchMetrics", "RadiusArrayName", "Automatic", FixedName },
  { "CoronaryBranchMetrics", "GroupArrayName", "GroupIds", FixedName },
  { "CoronaryBranchMetrics", "AbscissaArrayName", "Abscissas", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "MergeTolerance", "0.01",
    "it is 0.01; the class has the setter" },
  { "CoronaryCardiacPhaseInterpolator", "Period", "1",
    "time is the fraction of the R-R interval; the class has the setter" },
  { "CoronaryCardiacPhaseInterpolator", "GreatestRank", "6", "it is 6; the class has the setter" },
  { "CoronaryCardiacPhaseInterpolator", "GreatestOrder", "8", "it is 8; the class has the setter" },
  { "CoronaryCardiacPhaseInterpolator", "ConfidenceArrayName", "TrackingConfidence", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "StatusArrayName", "TrackingStatus", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "CalibreArrayName", "CalibreFactor", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "RotationArrayName", "BoneRotation", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "RadiusArrayName", "MaximumInscribedSphereRadius",
    FixedName },
  { "CoronaryCardiacPhaseInterpolator", "VelocityArrayName", "Velocity", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "AreaStrainArrayName", "AreaStrain", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "MajorArrayName", "EllipseMajor", FixedName },
  { "CoronaryCardiacPhaseInterpolator", "MinorArrayName", "EllipseMinor", FixedName },
  { "CoronaryCenterlineConversion", "OutputForm", "1",
    "the first output of Coronary Tree Topology is the tree, the fourth are VMTK's lines" },
  { "CoronaryCenterlineConversion", "Tolerance", "1e-6",
    "lines within half a radius are joined; coronary-pipeline convert --tolerance joins none "
    "else" },
  { "CoronaryCenterlineConversion", "RadiusArrayName", "MaximumInscribedSphereRadius", FixedName },
  { "CoronaryCenterlineMetrics", "StartLength", "5", "it is 5 mm" },
  { "CoronaryCenterlineMetrics", "ClipStart", "1", "the start is always clipped" },
  { "CoronaryCenterlineMetrics", "Spacing", "0.03", "it is 0.03 mm" },
  { "CoronaryCenterlineMetrics", "RadiusArrayName", "Automatic", FixedName },
  { "CoronaryCenterlineMetrics", "MatchArrayName", "CenterlineMatch", FixedName },
  { "CoronaryCenterlineMetrics", "DistanceArrayName", "CenterlineDistance", FixedName },
  { "CoronaryCenterlineMetrics", "FromReferenceArrayName", "FromReference", FixedName },
  { "CoronaryCenterlineSkeleton", "InputRadiusArrayName", "Automatic", FixedName },
  { "CoronaryCenterlineSkeleton", "ParentJointArrayName", "ParentJoint", FixedName },
  { "CoronaryCenterlineSkeleton", "RadiusArrayName", "MaximumInscribedSphereRadius", FixedName },
  { "CoronaryCenterlineSkeleton", "AbscissasArrayName", "Abscissas", FixedName },
  { "CoronaryCenterlineSkeleton", "BoneIdArrayName", "BoneId", FixedName },
  { "CoronaryCenterlineSkeleton", "BoneNameArrayName", "BoneName", FixedName },
  { "CoronaryCenterlineTracker", "CycleLength", "0.8",
    "it is that of the input's field data, else 0.8 s" },
  { "CoronaryCenterlineTracker", "RadiusArrayName", "", FixedName },
  { "CoronaryCenterlineTracker", "ConfidenceArrayName", "TrackingConfidence", FixedName },
  { "CoronaryCenterlineTracker", "StatusArrayName", "TrackingStatus", FixedName },
  { "CoronaryCenterlineTracker", "CalibreArrayName", "CalibreFactor", FixedName },
  { "CoronaryCenterlineTracker", "DisplacementArrayName", "Displacement", FixedName },
  { "CoronaryCenterlineTracker", "StrainArrayName", "AxialStrain", FixedName },
  { "FastMarchingCenterline", "FollowThinBranches", "1", "thin branches are always followed" },
  { "FastMarchingCenterline", "RefineLumen", "1", "the lumen is always refined" },
  { "FastMarchingCenterline", "SpeedExponent", "2", "it is 2; the class has the setter" },
  { "FastMarchingCenterline", "ResamplingStepLength", "0", "it is 0.6 voxels" },
  { "FastMarchingCenterline", "SmoothingWavelength", "0", "it is 12 voxels" },
  { "FastMarchingCenterline", "Snap", "1", "points are always put on the measured centre" },
  { "FastMarchingCenterline", "Blur", "0", "it is measured on the image" },
  { "FastMarchingCenterline", "VoxelLimit", "100000000", "it is 100 million" },
  { "FastMarchingCenterline", "RadiusArrayName", "MaximumInscribedSphereRadius", FixedName },
  { "FastMarchingCenterline", "ConfidenceArrayName", "Confidence", FixedName },
  { "FrangiVesselness", "VesselnessArrayName", "Vesselness", FixedName },
  { "FrangiVesselness", "ScaleArrayName", "VesselScale", FixedName },
  { "FrangiVesselness", "DirectionArrayName", "VesselDirection", FixedName },
  { "FrenetSweepSurface", "Gradation", "0.25", "it is 0.25" },
  { "FrenetSweepSurface", "EdgeRetreat", "0.15", "it is 0.15" },
  { "FrenetSweepSurface", "Clearance", "0.05", "it is 0.05" },
  { "FrenetSweepSurface", "ContourNormalArrayName", "FrenetNormal",
    "the normals of contours are FrenetNormal" },
  { "FrenetSweepSurface", "RadiusArrayName", "MaximumInscribedSphereRadius", FixedName },
  { "FrenetSweepSurface", "AbscissasArrayName", "Abscissas", FixedName },
  { "FrenetSweepSurface", "GroupIdsArrayName", "GroupIds", FixedName },
  { "FrenetSweepSurface", "SegmentIdsArrayName", "SegmentIds", FixedName },
  { "FrenetSweepSurface", "SegmentLabelArrayName", "SegmentLabel", FixedName },
  { "FrenetSweepSurface", "CellEntityIdsArrayName", "CellEntityIds", FixedName },
  { "FrenetSweepSurface", "WallCurvatureArrayName", "WallCurvature", FixedName },
  { "FrenetSweepSurface", "EdgeLengthArrayName", "EdgeLength", FixedName },
  { "CoronaryMeshDistanceMetrics", "AreaMeasures", "1", "they are always computed" },
  { "CoronaryMeshDistanceMetrics", "GroupArrayName", "GroupIds", FixedName },
  { "CoronaryMeshDistanceMetrics", "CapArrayName", "CellEntityIds", FixedName },
  { "CoronaryMeshDistanceMetrics", "DistanceArrayName", "SurfaceDistance", FixedName },
  { "CoronaryMeshSequenceWriter", "Period", "1",
    "time is the fraction of the R-R interval; the class has the setter" },
  { "CoronaryMeshSequenceWriter", "PrefixFiles", "1",
    "files begin with the report's name; the class has the setter" },
  { "CoronaryMeshSequenceWriter", "Digits", "3", "it is 3; the class has the setter" },
  { "CoronaryMeshSequenceWriter", "PoorDihedralAngle", "15",
    "it is 15 degrees; coronary-pipeline sequence has the option, the class the setter" },
  { "CoronaryMotionRegularizer", "Period", "1",
    "time is the fraction of the R-R interval; the class has the setter" },
  { "CoronaryMotionRegularizer", "Precision", "0.002", "it is 0.002 mm; the class has the setter" },
  { "CoronaryMotionRegularizer", "Iterations", "400", "400 at most; the class has the setter" },
  { "CoronaryMotionRegularizer", "ConfidenceArrayName", "TrackingConfidence", FixedName },
  { "CoronaryMotionRegularizer", "StatusArrayName", "TrackingStatus", FixedName },
  { "CoronaryMotionRegularizer", "CalibreArrayName", "CalibreFactor", FixedName },
  { "CoronaryMotionRegularizer", "RotationArrayName", "BoneRotation", FixedName },
  { "CoronaryMotionRegularizer", "StrainArrayName", "AxialStrain", FixedName },
  { "CoronaryMotionRegularizer", "StressArrayName", "AxialStress", FixedName },
  { "CoronaryMotionRegularizer", "ClampArrayName", "MotionClamps", FixedName },
  { "CoronaryMotionRegularizer", "MoveArrayName", "RegularizationMove", FixedName },
  { "CoronaryPhantomSource", "PositionVariation", "5", PhantomOption },
  { "CoronaryPhantomSource", "CalibreVariation", "0.1", PhantomOption },
  { "CoronaryPhantomSource", "AxialMotionRight", "18", PhantomOption },
  { "CoronaryPhantomSource", "AxialMotionLeft", "12", PhantomOption },
  { "CoronaryPhantomSource", "RegionalLag", "0.02", PhantomOption },
  { "CoronaryPhantomSource", "RegionalAmplitude", "0.06", PhantomOption },
  { "CoronaryPhantomSource", "NoiseCorrelation", "0.4", PhantomOption },
  { "CoronaryPhantomSource", "SystolicNoise", "1.5", PhantomOption },
  { "CoronaryPhantomSource", "AttenuationGradient", "-1.5", PhantomOption },
  { "CoronaryPhantomSource", "VeinHU", "150", PhantomOption },
  { "ReferencePhase", "Selection", "0", "the nearest time step is taken" },
  { "CoronarySkeletonPose", "RotationArrayName", "BoneRotation", FixedName },
  { "CoronarySkeletonPose", "TwistArrayName", "BoneTwist", FixedName },
  { "CoronarySkeletonPose", "StrainArrayName", "AxialStrain", FixedName },
  { "CoronarySkeletonPose", "CalibreArrayName", "CalibreFactor", FixedName },
  { "CoronarySkinDeformation", "IndicesArrayName", "BoneIndices", FixedName },
  { "CoronarySkinDeformation", "WeightsArrayName", "BoneWeightsCompact", FixedName },
  { "CoronarySkinDeformation", "RotationArrayName", "BoneRotation", FixedName },
  { "CoronarySkinDeformation", "TwistArrayName", "BoneTwist", FixedName },
  { "CoronarySkinDeformation", "CalibreArrayName", "CalibreFactor", FixedName },
  { "CoronarySkinDeformation", "DisplacementArrayName", "Displacement", FixedName },
  { "CoronarySkinDeformation", "VelocityArrayName", "Velocity", FixedName },
  { "CoronarySurfaceCleaner", "MergeTolerance", "1e-6", "it is 1e-6" },
  { "CoronaryTGFReader", "OutputForm", "0",
    "the first output is the tree, the second the skeleton" },
  { "CoronaryTGFWriter", "Tolerance", "1e-6",
    "it is 1e-6 mm; coronary-pipeline convert has --tolerance" },
  { "CoronaryTetrahedralMesher", "Improve", "1", "tetrahedra are always improved" },
  { "CoronaryTetrahedralMesher", "UnitLength", "1", "coordinates are in mm" },
  { "CoronaryTetrahedralMesher", "WorkerFolder", "",
    "the workers lie beside the library; the class has the setter" },
  { "CoronaryTetrahedralMesher", "RadiusArrayName", "Automatic", FixedName },
  { "CoronaryTreeTopology", "MergeRatio", "0.5", "it is 0.5" },
  { "CoronaryTreeTopology", "OrientationWeight", "1", "it is 1" },
  { "CoronaryTreeTopology", "SplitAtSegmentBorders", "1",
    "branches are always cut at the borders of segments" },
  { "CoronaryTreeTopology", "RadiusArrayName", "MaximumInscribedSphereRadius", FixedName },
  { "CoronaryTreeTopology", "AbscissasArrayName", "Abscissas", FixedName },
  { "CoronaryTreeTopology", "FrenetTangentArrayName", "FrenetTangent", FixedName },
  { "CoronaryTreeTopology", "FrenetNormalArrayName", "FrenetNormal", FixedName },
  { "CoronaryTreeTopology", "FrenetBinormalArrayName", "FrenetBinormal", FixedName },
  { "CoronaryTreeTopology", "CurvatureArrayName", "Curvature", FixedName },
  { "CoronaryTreeTopology", "TorsionArrayName", "Torsion", FixedName },
  { "CoronaryTreeTopology", "SectionAreaArrayName", "SectionArea", FixedName },
  { "CoronaryTreeTopology", "SegmentIdsArrayName", "SegmentIds", FixedName },
  { "CoronaryTreeTopology", "GroupIdsArrayName", "GroupIds", FixedName },
  { "CoronaryTreeTopology", "ParentGroupIdsArrayName", "ParentGroupIds", FixedName },
  { "CoronaryTreeTopology", "TreeIdsArrayName", "TreeIds", FixedName },
  { "CoronaryTreeTopology", "BranchGenerationArrayName", "BranchGeneration", FixedName },
  { "CoronaryTreeTopology", "StrahlerOrderArrayName", "StrahlerOrder", FixedName },
  { "CoronaryTreeTopology", "SegmentLabelArrayName", "SegmentLabel", FixedName },
  { "CoronaryTreeTopology", "LengthArrayName", "Length", FixedName },
  { "CoronaryTreeTopology", "TortuosityArrayName", "Tortuosity", FixedName },
  { "VesselSegmentation", "LongestPath", "400", "it is 400 mm; the class has the setter" },
  { "VesselSegmentation", "FillHoles", "1", "holes are always filled" },
  { "VesselSegmentation", "RefineWall", "1", "the wall is always refined" },
  { "VesselSegmentation", "MaskArrayName", "VesselMask", FixedName },
  { "VesselSegmentation", "ProbabilityArrayName", "VesselProbability", FixedName },
};
}

#endif
