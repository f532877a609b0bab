/**
 * @file TrappedWire.h
 * @brief A wire beside a balloon that opens, and between a stent and the vessel's wall: a jailed wire.
 */
#ifndef DynamicCoronary_TrappedWire_h
#define DynamicCoronary_TrappedWire_h

#include "BalloonOnWire.h"
#include "ContactSurface.h"
#include "DilatableWall.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/**
 * What is open in the vessel is an obstacle from inside, about the vessel's axis. Where there is no room for the wire between that
 * and the wall, both yield around the wire: it stays at the wall, pressed from both sides with the wall's pressure on its own
 * width, p d a length. So Coulomb friction on both sides holds it with 2 mu p d a length.
 *
 * It is jailed by a stent that was left in the wall while it lay there, until it has been drawn out; what comes afterwards is in the
 * stent's lumen. Struts do not catch it.
 */
class TrappedWire
{
public:
  enum class At : char
  {
    Free,
    Beside, ///< there is room between what is open and the wall
    Held
  };

  /// A stent was left in the wall just now.
  void Jail(std::size_t stent) { this->Stents.push_back(stent); }
  /**
   * A key frame: what the wire lies beside comes to be there after `seconds`.
   * @param balloon  that another wire carries; null: none  @param axisNow, axisNext  points of all axes
   */
  void BeginFrame(const std::vector<PlacedStent>& stents, const BalloonOnWire* balloon,
    const DilatableWall& wall, const std::vector<Vector3>& axisNow,
    const std::vector<Vector3>& axisNext, double seconds);
  void SetTime(double seconds);

  bool Active() const { return !this->Chains.empty(); }
  bool Jailed() const { return !this->Stents.empty(); }
  /// Whether any of the wire is beside what is open: without, it is soon not jailed any more.
  void Found(bool beside) { this->Seen = this->Seen || beside; }

  /**
   * @param length  mm of the wire that the sample stands for
   * @param contacts  of the lumen; gets what presses from the other side
   */
  At Meet(const ContactSample& sample, double length, SampleContacts& contacts) const;

private:
  struct Station
  {
    std::int64_t point = -1;
    Vector3 now = Vector3::Zero();
    Vector3 next = Vector3::Zero();
    double insideNow = 0.0; ///< mm: outside of what is open
    double insideNext = 0.0;
    double wallNow = 0.0; ///< mm, radius of what is around
    double wallNext = 0.0;
    double pressure = 0.0; ///< MPa on the wall
  };
  struct Chain
  {
    std::vector<Station> stations;
    Vector3 centre = Vector3::Zero();
    double reach = 0.0; ///< mm from there: whatever is further is free
  };

  /// @param inside, outside  mm, of what is open and of what is around it
  Station StationAt(std::int64_t point, double inside, double outside, const DilatableWall& wall,
    const std::vector<Vector3>& axisNow, const std::vector<Vector3>& axisNext) const;
  void Close(std::vector<Station>& stations);
  At MeetChain(
    const Chain& chain, const ContactSample& sample, double length, SampleContacts& contacts) const;

  std::vector<std::size_t> Stents; ///< that it is jailed by
  std::vector<Chain> Chains;
  std::vector<Chain> Before;
  double Seconds = 1.0;
  double Share = 0.0;
  bool Seen = false;
  int Unseen = 0; ///< frames
};
}

#endif
