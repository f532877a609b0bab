/**
 * @file CoronaryAnatomy.h
 * @brief Names of coronary segments, and the phases of the cycle that the paper has.
 */
#ifndef DynamicCoronary_CoronaryAnatomy_h
#define DynamicCoronary_CoronaryAnatomy_h

#include <string>
#include <vector>

namespace coronary
{
/// Which artery feeds the posterior descending (PDA) and posterolateral (PLB) branches.
enum class Dominance : int
{
  Right = 0,   ///< both from the right coronary artery
  Left = 1,    ///< both from the left circumflex
  Balanced = 2 ///< PDA from the right, PLB from the left
};

/// Coronary segments. 1 to 18 are the numbers of the SCCT model (Raff et al., J Cardiovasc Comput
/// Tomogr 2009;3:122); branches that the model does not number follow from 20.
enum SegmentId : int
{
  ProximalRCA = 1,
  MidRCA = 2,
  DistalRCA = 3,
  RightPDA = 4,
  LeftMain = 5,
  ProximalLAD = 6,
  MidLAD = 7,
  DistalLAD = 8,
  FirstDiagonal = 9,
  SecondDiagonal = 10,
  ProximalLCx = 11,
  FirstObtuseMarginal = 12,
  DistalLCx = 13,
  SecondObtuseMarginal = 14,
  LeftPDA = 15,
  RightPLB = 16,
  RamusIntermedius = 17,
  LeftPLB = 18,
  ThirdDiagonal = 20,
  ThirdObtuseMarginal = 21,
  FirstSeptal = 22,
  SecondSeptal = 23,
  ThirdSeptal = 24,
  AcuteMarginal = 25,
  RightVentricularBranch = 26,
  InferiorRightBranch = 27
};

/// The SCCT abbreviation: "LM", "pLAD", "mLAD", "dLAD", "D1", "pLCx", "OM1", "pRCA", "R-PDA", ...;
/// an empty string for a number that is no segment.
std::string SegmentName(int segmentId);

/// The paper's 20 phases: -5 % to 106 % of the R-R interval in equal steps.
std::vector<double> PaperPhases();

/// `count` phases from -5 % to 106 % (1 gives 75 %).
std::vector<double> EvenPhases(int count);
}

#endif
