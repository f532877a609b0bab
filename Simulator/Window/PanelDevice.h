/**
 * @file PanelDevice.h
 * @brief Hands on the window itself: the mouse's wheel, the buttons of the panel.
 */
#ifndef DynamicCoronary_PanelDevice_h
#define DynamicCoronary_PanelDevice_h

#include "Device.h"

#include <atomic>
#include <cstdint>

namespace coronary
{
/// The window's thread sets wishes, the physics' thread makes even movements of them.
class PanelDevice : public Device
{
public:
  ///@{
  /// The window's thread.
  void AdvanceWire(double mm) { Add(this->Wire, mm); }
  void TurnWire(double radians) { Add(this->Turn, radians); }
  void AdvanceCatheter(double mm) { Add(this->Catheter, mm); }
  void SetInjection(double millilitresASecond) { this->Injection = millilitresASecond; }
  void SetPedal(std::uint32_t pedal, bool down)
  {
    down ? this->Pedals |= pedal : this->Pedals &= ~pedal;
  }
  ///@}

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;

private:
  static void Add(std::atomic<double>& place, double amount)
  {
    place = place.load() + amount; // there is one writer
  }

  std::atomic<double> Wire{ 0.0 };     ///< mm that the wheel asked for
  std::atomic<double> Turn{ 0.0 };     ///< radians
  std::atomic<double> Catheter{ 0.0 }; ///< mm
  std::atomic<double> Injection{ 0.0 };
  std::atomic<std::uint32_t> Pedals{ 0 };
  SessionInput Place; ///< of the physics' thread
};
}

#endif
