/**
 * @file KeyboardDevice.h
 * @brief Driving with keys, which a window hands on.
 */
#ifndef DynamicCoronary_KeyboardDevice_h
#define DynamicCoronary_KeyboardDevice_h

#include "Device.h"
#include "HandMotion.h"

#include <atomic>
#include <string>
#include <vector>

namespace coronary
{
/// One line of the key map, for a help text.
struct KeyBinding
{
  const char*
    key; ///< X11's name of the key ("Up", "w", "space"), as VTK's windows give it; letters in any case
  const char* meaning; ///< for people
};

/**
 * Held keys make hands that move evenly, and that start and stop smoothly. Shift makes them fast, Control fine.
 * Always Running.
 */
class KeyboardDevice : public Device
{
public:
  explicit KeyboardDevice(const HandSpeeds& speeds = {});

  static const std::vector<KeyBinding>& KeyMap();

  ///@{
  /// From one thread, that of the window. @return whether the key means something; held keys may be told repeatedly
  bool Press(const std::string& key);
  bool Release(const std::string& key);
  ///@}

  /// When the window loses the keyboard.
  void ReleaseAll();

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;

private:
  std::atomic<std::uint64_t> Held{ 0 }; ///< bits of keys
  HandMotion Hands;                     ///< of the physics' thread
};
}

#endif
