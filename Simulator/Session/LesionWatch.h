/**
 * @file LesionWatch.h
 * @brief The lesions of a session: how open they are, what flows through them, and what a balloon did to them.
 */
#ifndef DynamicCoronary_LesionWatch_h
#define DynamicCoronary_LesionWatch_h

#include "ContrastModel.h"
#include "Intervention.h"
#include "VesselLesions.h"

#include <string>
#include <vector>

namespace coronary
{
struct LesionResult
{
  std::string vessel;
  int branch = 0;             ///< with the narrowest place
  double reference = 0.0;     ///< mm, diameter without the lesion at its narrowest place
  double least = 0.0;         ///< mm, diameter now
  double degreeBefore = 0.0;  ///< of the diameter, when the session began
  double degree = 0.0;        ///< now; after a dilation the residual stenosis
  double pressureRatio = 0.0; ///< Pd / Pa, means over about two seconds
  double reserveBefore = 0.0; ///< FFR when the session began
  double reserve = 0.0;       ///< FFR now
  double stretch = 0.0;       ///< greatest diameter that a balloon gave it, over the reference
};

/// Something that a report has to name.
struct ProcedureEvent
{
  enum class Kind
  {
    OverExpansion, ///< wall beyond 1.3 of its reference: dissection threatens; value: diameter over reference
    OverPressure ///< balloon beyond its rated pressure; value: atm
  };
  Kind kind = Kind::OverExpansion;
  double seconds = 0.0;
  int branch = -1;
  double value = 0.0;
};

class LesionWatch
{
public:
  explicit LesionWatch(const WallTopology& topology, const ContrastModel& medium);

  /// A step of the flow: the lumen as it is now, and what lies in it, goes into the network.
  void StepFlow(double seconds, const Intervention& instruments, ContrastModel& medium);
  /// @param said  gets a sentence of each new event
  void StepTick(double seconds, const Intervention& instruments,
    const std::optional<BalloonCatheter>& balloon, std::vector<std::string>& said);

  bool Empty() const { return this->Lesions.empty(); }
  std::vector<LesionResult> Results(
    const Intervention& instruments, const ContrastModel& medium) const;
  const std::vector<ProcedureEvent>& Events() const { return this->Events_; }

  ///@{
  /// mm, per point of the axes in one list; empty without a balloon.
  const std::vector<double>& Lumen() const { return this->Lumen_; }
  const std::vector<double>& Filled() const { return this->Filled_; } ///< by the balloon catheter
  ///@}

private:
  struct Watched
  {
    FoundLesion lesion;
    double reference = 0.0; ///< mm, radius
    double stretch = 0.0;
    double meanDistal = 0.0; ///< mmHg
    double meanAortic = 0.0;
  };
  int BranchOf(std::int64_t point) const;

  std::vector<Watched> Lesions;
  std::vector<CatheterTip> Distal; ///< place behind each lesion
  std::vector<double> ReserveBefore;
  std::vector<double> Reserve;                ///< of the lumen when it last stayed for a step
  bool ReserveIsOld = false;                  ///< the lumen has changed since
  std::vector<std::int64_t> First;            ///< point of each branch
  std::vector<std::vector<double>> Reference; ///< mm, radii
  std::vector<std::string> Names;             ///< of branches
  std::vector<double> Lumen_;
  std::vector<double> Filled_;
  std::vector<ProcedureEvent> Events_;
  bool Stretched = false;
  bool Pressed = false;
};
}

#endif
