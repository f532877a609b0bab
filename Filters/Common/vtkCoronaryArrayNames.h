/**
 * @file vtkCoronaryArrayNames.h
 * @brief Names of the arrays between the stages.
 *
 * They are fixed: a filter has a property for an array only where users bring data of their own.
 * Names follow VMTK where VMTK has one. See docs/design.md, "Data between the stages".
 */
#ifndef vtkCoronaryArrayNames_h
#define vtkCoronaryArrayNames_h

namespace vtkCoronaryArrayNames
{
// Image.
constexpr const char* HounsfieldUnits = "HU";

// Vesselness, point data.
constexpr const char* Vesselness = "Vesselness";           ///< float, 0 to 1
constexpr const char* VesselScale = "VesselScale";         ///< float, sigma of the maximum, mm
constexpr const char* VesselDirection = "VesselDirection"; ///< float[3], unit axis, world
// Vesselness, field data.
constexpr const char* VesselnessSigmas = "VesselnessSigmas";   ///< double, mm, one value a scale
constexpr const char* VesselnessC = "VesselnessC";             ///< double, HU
constexpr const char* VesselnessLambda3 = "VesselnessLambda3"; ///< double, HU, one value a scale

// Field data of every time-dependent output.
constexpr const char* CycleLength = "CycleLength"; ///< double, 1 value, seconds
constexpr const char* PhaseTime = "PhaseTime"; ///< double, 1 value, fraction of the R-R interval

// Segmentation, point data.
constexpr const char* VesselMask = "VesselMask";               ///< unsigned char, 0 or 1
constexpr const char* VesselProbability = "VesselProbability"; ///< float, 0 to 1
// Segmentation, field data.
constexpr const char* BloodWindow = "BloodWindow";   ///< double, 2 values: tissue, blood
constexpr const char* BridgePoints = "BridgePoints"; ///< double[4], mm and number of the bridge
constexpr const char* BridgeConfidences = "BridgeConfidences"; ///< double, 0 to 1, one a bridge
constexpr const char* BridgeUnseen = "BridgeUnseen"; ///< double, mm without a tube, one a bridge

// Aorta, point data.
constexpr const char* Measured = "Measured"; ///< uchar, 1: seen in the image, 0: completed
// Aorta, field data.
constexpr const char* AortaSource = "AortaSource";   ///< string, what was seen, what completed
constexpr const char* AortaLengths = "AortaLengths"; ///< double[4], mm: see vtkAortaData.h

// Centerline tree, field data: what touched it and was left out.
constexpr const char* VeinPositions = "VeinPositions";         ///< double[3], mm
constexpr const char* VeinLengths = "VeinLengths";             ///< double, mm
constexpr const char* VeinProbabilities = "VeinProbabilities"; ///< double, 0.5 to 1

// Centerline tree, point data.
constexpr const char* Bridged = "Bridged"; ///< unsigned char, 1: not seen, guessed across a lesion
constexpr const char* BridgeConfidence =
  "BridgeConfidence"; ///< double, 0 to 1, 1 before any bridge
constexpr const char* OstiumConfidence =
  "OstiumConfidence"; ///< double, 0 to 1, of the seed that the point hangs on
constexpr const char* VeinProbability =
  "VeinProbability"; ///< double, 0 to 1, that what the point hangs on is a vein
constexpr const char* Radius = "MaximumInscribedSphereRadius"; ///< double, mm
constexpr const char* Abscissas = "Abscissas";       ///< double, mm from the root along the tree
constexpr const char* SegmentIds = "SegmentIds";     ///< int, coronary::SegmentId
constexpr const char* Displacement = "Displacement"; ///< double[3], mm from the reference position
constexpr const char* Velocity = "Velocity";         ///< double[3], mm/s

constexpr const char* Visibility = "Visibility"; ///< double, 0 lost .. 1 full contrast

// Centerline tree that was edited by hand, point data.
constexpr const char* EditNumber = "EditNumber"; ///< int, the last edit here, from 1; 0: as found
// And field data, also of an edited mask.
constexpr const char* EditNotes = "EditNotes";     ///< string, what each edit did
constexpr const char* EditNumbers = "EditNumbers"; ///< int, of each of these
constexpr const char* EditPlaces = "EditPlaces";   ///< double[3], mm
constexpr const char* EditLengths = "EditLengths"; ///< double, mm of vessel that it changed
constexpr const char* EditSeen = "EditSeen";       ///< double, share of it that the image shows

// Centerline tree in an image, point data.
constexpr const char* StenosisDegree = "StenosisDegree";   ///< double, 0 to 1, by diameter
constexpr const char* ReferenceRadius = "ReferenceRadius"; ///< double, mm, of the healthy vessel
constexpr const char* RadiusInterpolated = "RadiusInterpolated"; ///< uchar, 1: hidden by calcium
constexpr const char* CalciumLabel = "CalciumLabel"; ///< int, object beside the point, 0: none

// Reformats along a vessel, point data (with Abscissas).
constexpr const char* WorldPosition = "WorldPosition"; ///< double[3], mm, in the patient
// Reformats along a vessel, field data.
constexpr const char* VesselPieces = "VesselPieces";       ///< string, names from ostium to tip
constexpr const char* VesselLength = "VesselLength";       ///< double, mm, from ostium to tip
constexpr const char* SectionPosition = "SectionPosition"; ///< double, mm from the ostium
constexpr const char* LumenDiameter = "LumenDiameter";     ///< double, mm, of the tree
constexpr const char* EdgeArea = "EdgeArea";   ///< double, mm^2, within the edge that the image has
constexpr const char* OuterArea = "OuterArea"; ///< double, mm^2, within the outer boundary

// Lumen over the cycle, point data (with StenosisDegree, ReferenceRadius).
constexpr const char* Diameter = "Diameter";                 ///< double, mm, at the phase
constexpr const char* Area = "Area";                         ///< double, mm^2, of a disc that wide
constexpr const char* LeastDiameter = "LeastDiameter";       ///< double, mm, over the phases
constexpr const char* MedianDiameter = "MedianDiameter";     ///< double, mm
constexpr const char* GreatestDiameter = "GreatestDiameter"; ///< double, mm
constexpr const char* HealthyDiameter = "HealthyDiameter";   ///< double, mm, of the median
constexpr const char* MedianDegree = "MedianDegree"; ///< double, 0 to 1, of the median diameter

// Points with a meaning of their own (ostia, seeds), point data.
constexpr const char* Name = "Name";             ///< string
constexpr const char* Axis = "Axis";             ///< double[3], unit vector
constexpr const char* Confidence = "Confidence"; ///< double, 0 to 1
constexpr const char* SeedVolume = "SeedVolume"; ///< double, mm^3 of vessel that hang on a seed

// Centerline tree, cell data.
constexpr const char* GroupIds = "GroupIds";                 ///< int, one id a branch
constexpr const char* ParentGroupIds = "ParentGroupIds";     ///< int, -1 at a root
constexpr const char* TreeIds = "TreeIds";                   ///< int, 0 left, 1 right
constexpr const char* BranchGeneration = "BranchGeneration"; ///< int, 0 at a root
constexpr const char* StrahlerOrder = "StrahlerOrder";       ///< int, 1 at the tips
constexpr const char* SegmentLabel = "SegmentLabel";         ///< string, SCCT name
constexpr const char* Length = "Length";                     ///< double, mm
constexpr const char* Tortuosity = "Tortuosity";             ///< double, length / chord - 1

// Centerlines in VMTK's form, cell data.
constexpr const char* CenterlineIds = "CenterlineIds"; ///< int, line from a root to a tip
constexpr const char* TractIds = "TractIds";           ///< int, place along its line
constexpr const char* Blanking = "Blanking";           ///< int, 1 inside a bifurcation

// Centerlines, field data.
constexpr const char* SeedStatus = "SeedStatus";       ///< int, coronary::EndStatus
constexpr const char* SeedMessage = "SeedMessage";     ///< string
constexpr const char* TargetStatus = "TargetStatus";   ///< int, coronary::EndStatus
constexpr const char* TargetMessage = "TargetMessage"; ///< string
constexpr const char* ImageBlur = "ImageBlur";         ///< double, mm, standard deviation
constexpr const char* Complete = "Complete";           ///< unsigned char, 0: ended by a limit

// Centerline tree with geometry, point data.
constexpr const char* FrenetTangent = "FrenetTangent";   ///< double[3], unit, downstream
constexpr const char* FrenetNormal = "FrenetNormal";     ///< double[3], unit, to the inside
constexpr const char* FrenetBinormal = "FrenetBinormal"; ///< double[3], tangent x normal
constexpr const char* Curvature = "Curvature";           ///< double, 1/mm
constexpr const char* Torsion = "Torsion";               ///< double, 1/mm
constexpr const char* SectionArea = "SectionArea"; ///< double, mm^2, of the round cross-section

// Centerline tree, field data.
constexpr const char* Dominance = "Dominance";     ///< string, right, left or balanced
constexpr const char* HeartFrame = "HeartFrame";   ///< double[16], world to heart, row by row
constexpr const char* PrunedTwigs = "PrunedTwigs"; ///< int, number
constexpr const char* ClosedGaps = "ClosedGaps";   ///< int, number
constexpr const char* LoopLengths = "LoopLengths"; ///< double, mm, one value a loop
// What the check of whole trees found; one value a warning, absent without any; the sentences are `Warnings`.
constexpr const char* WarningVessels = "WarningVessels";         ///< string, SCCT name
constexpr const char* WarningPlaces = "WarningPlaces";           ///< double[3]
constexpr const char* WarningConfidences = "WarningConfidences"; ///< double, 0 to 1

// Bifurcations, point data (with ParentGroupIds, TreeIds, SegmentIds of the parent).
constexpr const char* DaughterGroupIds = "DaughterGroupIds"; ///< int[n], widest first, -1: none
constexpr const char* BifurcationAngle = "BifurcationAngle"; ///< double, radians
constexpr const char* DaughterAngles = "DaughterAngles";     ///< double[n], radians, from parent
constexpr const char* ParentRadius = "ParentRadius";         ///< double, mm
constexpr const char* DaughterRadii = "DaughterRadii";       ///< double[n], mm
constexpr const char* AreaRatio = "AreaRatio"; ///< double, daughters' areas over parent's
constexpr const char* DaughterAreaRatio = "DaughterAreaRatio"; ///< double, second over widest
constexpr const char* MurrayExponent = "MurrayExponent";       ///< double, the chosen exponent
constexpr const char* MurrayResidual = "MurrayResidual";       ///< double, relative
constexpr const char* HuoKassabResidual = "HuoKassabResidual"; ///< double, relative, exponent 7/3
constexpr const char* FinetRatio = "FinetRatio";               ///< double
constexpr const char* FittedExponent = "FittedExponent";       ///< double, NaN where none fits

// Centerlines held against a reference, point data (FromReference also cell data).
constexpr const char* CenterlineMatch = "CenterlineMatch";       ///< int, 1 true, 2 missed, 3 false
constexpr const char* CenterlineDistance = "CenterlineDistance"; ///< double, mm
constexpr const char* FromReference = "FromReference";           ///< int, 0 or 1
// Field data of their table.
constexpr const char* LongestFalse = "LongestFalse";   ///< double, mm
constexpr const char* LongestMissed = "LongestMissed"; ///< double, mm

// Surfaces held against each other, point data.
constexpr const char* SurfaceDistance = "SurfaceDistance"; ///< double, mm, NaN: not compared
// Field data of both and of their table: HD, HD95, MSD, ..., see vtkMeshDistanceMetrics.
constexpr const char* HausdorffPoints = "HausdorffPoints"; ///< double[3], mm, four: see there
constexpr const char* SignedDistance = "SignedDistance";   ///< int, 1 when inside is negative

// Branches held against each other, cell data (with FromReference, GroupIds, Length).
constexpr const char* BranchMatch = "BranchMatch"; ///< vtkIdType, on the other side, -1: none
constexpr const char* Covered = "Covered";         ///< double, share of the length, 0 to 1

// Surface, cell data.
constexpr const char* CellEntityIds = "CellEntityIds"; ///< int, 1 wall, 2.. caps
// Surface, point data.
constexpr const char* WallCurvature = "WallCurvature"; ///< double, 1/mm, greatest principal
constexpr const char* EdgeLength = "EdgeLength";       ///< double, mm, wanted
// Structured patches, point data (with the frame of centerlines with geometry).
constexpr const char* PatchCentre = "PatchCentre"; ///< double[3], mm
constexpr const char* FrameTwist = "FrameTwist";   ///< double, 1/mm, against least twist
// Inlets and outlets, point data.
constexpr const char* CapNormal = "CapNormal"; ///< double[3], unit, outwards
constexpr const char* IsInlet = "IsInlet";     ///< int, 0 or 1

// Volume, point data: ids of the input's points, vtkIdType, -1 elsewhere.
constexpr const char* SurfacePointId = "SurfacePointId";
constexpr const char* SkeletonPointId = "SkeletonPointId";
// Volume, cell data.
constexpr const char* RegionIds = "RegionIds";                       ///< int, component, from 0
constexpr const char* TetrahedronVolume = "TetrahedronVolume";       ///< double, mm^3
constexpr const char* MinimumDihedralAngle = "MinimumDihedralAngle"; ///< double, radians
constexpr const char* RadiusEdgeRatio = "RadiusEdgeRatio";           ///< double
// Its boundary and its edges along the skeleton, cell data, vtkIdType.
constexpr const char* SurfaceCellId = "SurfaceCellId";
constexpr const char* TetrahedronId = "TetrahedronId";
constexpr const char* SkeletonEdgeId = "SkeletonEdgeId";
// Volume, field data.
constexpr const char* Backend = "Backend";                       ///< string
constexpr const char* Tries = "Tries";                           ///< int, 2 after a repair
constexpr const char* RepairDisplacement = "RepairDisplacement"; ///< double, mm
constexpr const char* MeshMinimumDihedralAngle = "MeshMinimumDihedralAngle"; ///< double, radians
constexpr const char* PoorFraction = "PoorFraction";           ///< double, below 15 degrees
constexpr const char* MeshMinimumVolume = "MeshMinimumVolume"; ///< double, mm^3
constexpr const char* TotalVolume = "TotalVolume";             ///< double, mm^3
constexpr const char* MeshMaximumRadiusEdgeRatio = "MeshMaximumRadiusEdgeRatio"; ///< double
constexpr const char* Warnings = "Warnings"; ///< string, one a warning
// Skeleton (with radius and abscissa, GroupIds, TreeIds, SegmentIds, Length), point data.
constexpr const char* ParentJoint =
  "ParentJoint"; ///< vtkIdType, next joint rootwards, -1 at a root
// Skeleton, cell data.
constexpr const char* BoneId = "BoneId"; ///< int, from 0 in the order of the cells
// Skeleton, field data; a string array of cells would crash ParaView's parallel XML reader.
constexpr const char* BoneName = "BoneName"; ///< string, one a bone

// Weights of bones, point data.
constexpr const char* BoneWeights = "BoneWeights"; ///< double[bones], named components
constexpr const char* BoneIndices = "BoneIndices"; ///< int[n], -1: none
constexpr const char* BoneWeightsCompact = "BoneWeightsCompact"; ///< float[n], greatest first
constexpr const char* DroppedWeight = "DroppedWeight"; ///< float, weight of bones left out

// Weights of bones, field data.
constexpr const char* WeightsConverged = "WeightsConverged";   ///< int, 1 or 0
constexpr const char* WeightsIterations = "WeightsIterations"; ///< int
constexpr const char* WeightsResidual = "WeightsResidual";     ///< double: in reach, everywhere
constexpr const char* WeightsEnergy = "WeightsEnergy";         ///< double, 1/mm
constexpr const char* WeightsEnergyGap = "WeightsEnergyGap";   ///< double, share of the energy
constexpr const char* WeightsRowSums = "WeightsRowSums";       ///< double: least, greatest, Eq. 7
constexpr const char* WeightsOnBones = "WeightsOnBones";       ///< double, greatest error there
constexpr const char* BoneLengthOutside = "BoneLengthOutside"; ///< double, mm, one value a bone
constexpr const char* LeftOutBones = "LeftOutBones";           ///< int, bones without weights
constexpr const char* LeftOutBoneNames = "LeftOutBoneNames";   ///< string, of these
// Posed skeleton, cell data.
constexpr const char* BoneRotation = "BoneRotation"; ///< double[4], w x y z, from rest, first joint
constexpr const char* BoneTwist = "BoneTwist";       ///< double, radians along the bone
constexpr const char* AxialStrain = "AxialStrain";   ///< double, posed length / rest length - 1
constexpr const char* BoneAngularVelocity =
  "BoneAngularVelocity"; ///< double[3], of BoneRotation, radians/s about axes of the world
constexpr const char* BoneTwistRate = "BoneTwistRate"; ///< double, of BoneTwist, radians/s
// Posed skeleton, point data.
constexpr const char* CalibreFactor = "CalibreFactor";           ///< double, of the radius
constexpr const char* CalibreRate = "CalibreRate";               ///< double, of CalibreFactor, 1/s
constexpr const char* TrackingConfidence = "TrackingConfidence"; ///< double, 0 to 1
constexpr const char* TrackingStatus = "TrackingStatus";         ///< int, coronary::TrackingStatus
/// double, 0 to 1: probability that the branch is within 1 mm of an artery at this phase (coronary::PlacementConfidence)
constexpr const char* PlacementConfidence = "PlacementConfidence";
constexpr const char* LumenBeside = "LumenBeside"; ///< double, mm to the middle of the lumen
constexpr const char* LumenContrast =
  "LumenContrast"; ///< double, HU of the point over its surroundings
// Tracked lines, field data.
constexpr const char* ReferenceTime = "ReferenceTime"; ///< double, fraction of the R-R interval
constexpr const char* TrackedShare = "TrackedShare";   ///< double, 0 to 1, one value a phase
constexpr const char* TrackingRepeatability = "TrackingRepeatability"; ///< double, mm
// Interpolated pose, point data.
constexpr const char* AreaStrain = "AreaStrain";     ///< double, eps_r of the cross-section's area
constexpr const char* EllipseMajor = "EllipseMajor"; ///< double, semi-axis, mm
constexpr const char* EllipseMinor = "EllipseMinor"; ///< double, semi-axis, mm
// Interpolated pose, field data.
constexpr const char* ClampedSections = "ClampedSections"; ///< vtkIdType, number of points
constexpr const char* Repeatability = "Repeatability"; ///< double, mm, of phases that come twice
constexpr const char* LowNoiseFit = "LowNoiseFit"; ///< double: rank, order, ridge, left-out error
// Motion of a population, point data.
constexpr const char* MotionDeviation = "MotionDeviation"; ///< double, mm, standard deviation
// Motion of a population, field data.
constexpr const char* MotionSource =
  "MotionSource"; ///< string, what of the motion is not the patient's
constexpr const char* MotionPhases = "MotionPhases"; ///< int, phases of the patient that carry it
constexpr const char* HeartLandmarks = "HeartLandmarks"; ///< string, what the heart's place is from
constexpr const char* LongAxis = "LongAxis";             ///< double[6], mm: base, apex
constexpr const char* LongAxisDeviation =
  "LongAxisDeviation"; ///< double, 3 values: radians, mm at the base, mm of length
constexpr const char* PopulationValues = "PopulationValues"; ///< double, one a parameter
constexpr const char* PopulationMisfit = "PopulationMisfit"; ///< double, 2 values, mm
// Regularised motion, cell data (with AxialStrain).
constexpr const char* AxialStress = "AxialStress"; ///< double, MPa, Young's modulus times strain
// Regularised motion, point data.
constexpr const char* MotionClamps = "MotionClamps"; ///< int, bits of coronary::MotionClamp
constexpr const char* RegularizationMove =
  "RegularizationMove"; ///< double[3], mm, from where the point was
// Regularised motion, field data; energies before and after, mm^2.
constexpr const char* TemporalEnergy = "TemporalEnergy";   ///< double[2]
constexpr const char* SpatialEnergy = "SpatialEnergy";     ///< double[2]
constexpr const char* TotalEnergy = "TotalEnergy";         ///< double[2]
constexpr const char* MotionObjective = "MotionObjective"; ///< double[2], what is minimised
constexpr const char* ClampedPoints = "ClampedPoints";     ///< vtkIdType[5], one a limit
constexpr const char* LimitViolations = "LimitViolations"; ///< vtkIdType, that are left
constexpr const char* LimitIterations = "LimitIterations"; ///< int
constexpr const char* MaximumMove = "MaximumMove";         ///< double, mm
constexpr const char* MotionNoise = "MotionNoise"; ///< double, one a time step, mm along each axis
// Deformed mesh, cell data.
constexpr const char* VolumeRatio = "VolumeRatio"; ///< double, against rest, below 0 inverted
// Deformed mesh, field data.
constexpr const char* InvertedTetrahedra = "InvertedTetrahedra"; ///< vtkIdType, ids of cells left
constexpr const char* RepairedTetrahedra = "RepairedTetrahedra"; ///< vtkIdType, number

// Surface of a sequence of meshes, point data.
constexpr const char* MeshPointId = "MeshPointId"; ///< vtkIdType, point of the tetrahedra
// Sequence of meshes, field data.
constexpr const char* SurfaceArea = "SurfaceArea"; ///< double, mm^2

// Cleaned surface, field data.
constexpr const char* Repairs = "Repairs";               ///< string, a sentence each
constexpr const char* RepairVessels = "RepairVessels";   ///< string, of the swept surface
constexpr const char* RepairPlaces = "RepairPlaces";     ///< double[3], mm
constexpr const char* LeftOut = "LeftOut";               ///< string, reasons of branches
constexpr const char* LeftOutVessels = "LeftOutVessels"; ///< string
constexpr const char* LeftOutPlaces = "LeftOutPlaces";   ///< double[3], mm
constexpr const char* LeftOutLengths = "LeftOutLengths"; ///< double, mm
constexpr const char* LeftOutPoints = "LeftOutPoints";   ///< idtype, of the tree
constexpr const char* Repaired = "Repaired";             ///< uchar, 1: triangles were replaced
constexpr const char* MaximumDisplacement = "MaximumDisplacement"; ///< double, mm
}

#endif
