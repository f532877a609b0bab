/**
 * @file GuideLumen.h
 * @brief What is in a guide catheter's lumen: blood, saline, contrast medium, air, in the order in which it was pushed in.
 */
#ifndef DynamicCoronary_GuideLumen_h
#define DynamicCoronary_GuideLumen_h

#include <cstdint>
#include <deque>

namespace coronary
{
/**
 * A tube of pi r^2 L in which everything moves as a plug: what is pushed in at the hub drives as much out of the tip. It
 * begins with saline. Volumes are kept to round-off.
 */
class GuideLumen
{
public:
  /// A stretch of it.
  struct Plug
  {
    double volume = 0.0; ///< mL
    double medium = 0.0; ///< fraction of contrast medium, 0 to 1
    bool air = false;
  };
  /// What left it, mL.
  struct Outflow
  {
    double liquid = 0.0;
    double medium = 0.0; ///< of the liquid
    double air = 0.0;
  };

  /// @param radius, length  mm, above 0
  GuideLumen(double radius, double length);

  double Volume() const { return this->Volume_; } ///< mL
  /// At the hub. @return what leaves the tip
  Outflow Push(const Plug& plug);
  /// Drawn back: blood enters at the tip. @return what leaves the hub
  Outflow Draw(double volume);

  double Medium() const; ///< mL of contrast medium in it
  double Air() const;    ///< mL
  /// From the tip to the hub.
  const std::deque<Plug>& Plugs() const { return this->Plugs_; }
  std::uint64_t Hash(std::uint64_t hash) const;

private:
  double Volume_;
  std::deque<Plug> Plugs_;
};
}

#endif
