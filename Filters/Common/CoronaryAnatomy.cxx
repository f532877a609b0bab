#include "CoronaryAnatomy.h"

#include <stdexcept>

namespace coronary
{
std::string SegmentName(int segmentId)
{
  switch (segmentId)
  {
    case ProximalRCA:
      return "pRCA";
    case MidRCA:
      return "mRCA";
    case DistalRCA:
      return "dRCA";
    case RightPDA:
      return "R-PDA";
    case LeftMain:
      return "LM";
    case ProximalLAD:
      return "pLAD";
    case MidLAD:
      return "mLAD";
    case DistalLAD:
      return "dLAD";
    case FirstDiagonal:
      return "D1";
    case SecondDiagonal:
      return "D2";
    case ProximalLCx:
      return "pLCx";
    case FirstObtuseMarginal:
      return "OM1";
    case DistalLCx:
      return "dLCx";
    case SecondObtuseMarginal:
      return "OM2";
    case LeftPDA:
      return "L-PDA";
    case RightPLB:
      return "R-PLB";
    case RamusIntermedius:
      return "RI";
    case LeftPLB:
      return "L-PLB";
    case ThirdDiagonal:
      return "D3";
    case ThirdObtuseMarginal:
      return "OM3";
    case FirstSeptal:
      return "S1";
    case SecondSeptal:
      return "S2";
    case ThirdSeptal:
      return "S3";
    case AcuteMarginal:
      return "AM1";
    case RightVentricularBranch:
      return "RV1";
    case InferiorRightBranch:
      return "R-INF";
    default:
      return "";
  }
}

std::vector<double> EvenPhases(int count)
{
  if (count < 1)
  {
    throw std::invalid_argument("the number of phases must be at least 1");
  }
  if (count == 1)
  {
    return { 0.75 };
  }
  std::vector<double> phases(count);
  for (int i = 0; i < count; ++i)
  {
    phases[i] = -0.05 + 1.11 * i / (count - 1);
  }
  return phases;
}

std::vector<double> PaperPhases()
{
  return EvenPhases(20);
}
}
