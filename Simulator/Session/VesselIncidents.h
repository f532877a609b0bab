/**
 * @file VesselIncidents.h
 * @brief What goes wrong in the arteries by itself: spasm that narrows a vessel, air that blocks it.
 */
#ifndef DynamicCoronary_VesselIncidents_h
#define DynamicCoronary_VesselIncidents_h

#include "FlowNetwork.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// Of a scenario: what happens, where and when.
struct Incident
{
  enum class Kind
  {
    Spasm,
    Air
  };
  /// By which it happens; each once.
  enum class When
  {
    Called,    ///< only by an event of the session, as all can be
    Time,      ///< `at` s after the beginning
    Injection, ///< at the first contrast medium
    Inflation, ///< a balloon is open
    WireIn     ///< the wire's tip is in `vessel`
  };
  Kind kind = Kind::Spasm;
  When when = When::Called;
  double at = 0.0; ///< s, of Time
  std::string
    vessel; ///< the segment that closes, or that air goes to; empty for air: where most blood flows
  double narrowing = 0.8; ///< of the diameter, of Spasm, 0.1 to 0.98
  double onset = 5.0;     ///< s, likewise, 0.5 to 60
  double volume = 0.1;    ///< mL, of Air, 0.01 to 5
};

/**
 * Spasm comes over its onset as half a cosine, the same along the vessel but for 5 mm at both ends, and stays until nitrates
 * are given; then it goes within 100 s (intracoronary nitroglycerin has its greatest effect after 101 +- 32 s, Fongjunsom).
 *
 * A bubble goes where the flow is greatest, as far as the vessel goes, and fills it from its end upwards. Nothing passes. It
 * is absorbed exponentially (60 s, chosen: small ones are gone within minutes), and drawn back through a guide in that artery,
 * a tenth of what is drawn (chosen).
 */
class VesselIncidents
{
public:
  static constexpr double Relaxation = 100.0; ///< s
  static constexpr double Absorption = 60.0;  ///< s
  static constexpr double EndLength = 5.0;    ///< mm over which a spasm begins
  static constexpr double Least =
    0.005; ///< mL of air that still block, when no more has come for a second

  explicit VesselIncidents(const FlowNetwork& network)
    : Network(network)
  {
  }

  /// Segments of that name. @throws std::invalid_argument  there is none: it names those that there are
  std::vector<int> BranchesNamed(const std::string& vessel) const;

  void BeginSpasm(const std::string& vessel, double narrowing, double onset);
  /// @param flow  mL/s per segment @param root  branch that the guide is in
  /// @return the branch that it blocks
  int AddAir(double volume, const std::string& vessel, const std::vector<double>& flow, int root);
  void GiveNitrates();
  /// @param drawn  mL through a guide in the artery
  void Step(double seconds, double drawn);

  bool Any() const { return this->Spasms.size() + this->Bubbles.size() > 0; } ///< now or before
  bool Blocked() const;                                                       ///< there is air
  double Air() const;                                                         ///< mL
  /// How far the narrowest spasm narrows its vessel now, of the diameter.
  double Narrowing() const;
  /// @param lumen, filled  mm, per point of the axes in one list: narrowed, and filled by air
  void Apply(std::vector<double>& lumen, std::vector<double>& filled) const;

private:
  struct Spasm
  {
    std::vector<int> branches;
    double narrowing = 0.0;
    double onset = 0.0;
    double age = 0.0;      ///< s
    double relaxes = -1.0; ///< s since nitrates; below 0: none
    double level = 0.0;    ///< 0 to 1
    double from = 0.0;     ///< level when nitrates were given
  };
  struct Bubble
  {
    std::vector<int> way; ///< branches from where it began to its end
    double volume = 0.0;  ///< mL
    double rests = 0.0;   ///< s since some came
  };

  const FlowNetwork& Network;
  std::vector<Spasm> Spasms;
  std::vector<Bubble> Bubbles;
};
}

#endif
