/**
 * @file ScannerGating.h
 * @brief When a scanner looks where, and from which views of which beats each slice is made.
 */
#ifndef DynamicCoronary_ScannerGating_h
#define DynamicCoronary_ScannerGating_h

#include "ScannerSettings.h"

#include <cstdint>

namespace coronary
{
/// A heartbeat of the scan.
struct ScannerBeat
{
  double start = 0.0;              ///< its R peak, s
  double interval = 0.0;           ///< to the next one, s
  Vector3 shift = Vector3::Zero(); ///< of the heart, mm: it does not come back to the same place
};

/// A view that counts in a reconstruction.
struct GatedView
{
  int position;        ///< in the half scan: angles grow by one view's from one to the next
  std::int64_t number; ///< in time: at number times the time of a view
  int tube;            ///< 0, or 1: a quarter turn ahead
  float weight;        ///< of all views of a position together: 1
};

/// Slices that are made of the same views.
struct GatedStack
{
  std::vector<int> beats;       ///< that its views are of
  double centre = 0.0;          ///< height of the table in the middle of its views, mm
  double middle = 0.0;          ///< s, of the first beat's views
  double firstAngle = 0.0;      ///< of the tube at position 0, rad
  std::vector<GatedView> views; ///< by position
  double worst = 0.0;           ///< s, the greatest distance of a view from the wanted moment
};

/**
 * The heart beats with intervals that vary; the gantry turns at its own pace. Step and shoot: a slab
 * is seen in as many beats as there are segments, during the next one the table moves. Helical: the
 * table moves all the time.
 */
class ScannerSchedule
{
public:
  /**
   * @param low, high    z range to be seen, mm
   * @param cycleLength  mean R-R interval, s
   * @throws std::invalid_argument for settings that can not be
   */
  ScannerSchedule(const ScannerSettings& settings, double low, double high, double cycleLength);

  /// A beat of the scan; the first is 0.
  const ScannerBeat& Beat(int number) const;

  /// Phase of the heart at a moment: whole numbers at the R peaks, beat 0 starts at 0; straight between.
  double Phase(double seconds) const;

  /// Where the heart is, mm: that of its beat, and what breathing adds.
  Vector3 Shift(double seconds) const;

  /// Factor on all iodine.
  double Iodine(double seconds) const;

  /// Height of the central plane, mm.
  double Table(double seconds) const;

  double Seconds(std::int64_t view) const { return static_cast<double>(view) * this->ViewTime; }
  double Angle(std::int64_t view, int tube) const;

  /**
   * The slices of the image at a phase, from the head to the feet. Step and shoot is triggered: the
   * moment comes that share of the mean R-R interval after a beat's R peak. Helical scans are gated
   * afterwards: it is a share of each beat's own interval.
   */
  std::vector<GatedStack> Stacks(double phase) const;

  /// Share of each stack in the image at height z: 1 but where two overlap, there straight ramps.
  std::vector<double> Weights(const std::vector<GatedStack>& stacks, double z) const;

private:
  double Moment(int beat, double phase) const;
  void ChooseViews(GatedStack& stack, const std::vector<double>& moments) const;

  ScannerSettings Settings;
  double Low;
  double High;
  double CycleLength;
  double ViewTime;
  double FirstAngle; ///< of the first tube at 0 s
  double Step;       ///< from slab to slab, mm
  double Speed;      ///< of the table, mm/s; 0: it steps
  double Top;        ///< of the table at 0 s, mm
  int Slabs = 1;
  std::vector<ScannerBeat> Beats; ///< some before the scan, and after it
};
}

#endif
