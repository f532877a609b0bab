/**
 * @file DeviceMux.h
 * @brief One input out of several devices.
 */
#ifndef DynamicCoronary_DeviceMux_h
#define DynamicCoronary_DeviceMux_h

#include "Device.h"
#include "TripleBuffer.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace coronary
{
/// Where the C-arm and the table are, as in SessionInput.
struct ViewPlace
{
  double primary = 0.0;
  double secondary = 0.0;
  double sourceToDetector = 1100.0;
  Vector3 table{ Vector3::Zero() };
};

/**
 * Wire, catheter, syringe and view (C-arm with table) each follow one device at a time:
 * - while nothing moves, the first one that has it;
 * - a device that was added earlier takes it as soon as it moves it; a later one by moving it when the device that has it
 *   has rested for RestSeconds;
 * - when the device that has it is lost (Stale, Disconnected, ...) it is held. Another device gets it only by a new
 *   movement: one that begins after that device has rested for RestSeconds since the loss. So a key that is held down
 *   does not go on with a wire that fell out of the hand.
 * Changing from one device to another, losing one and finding it again do not move anything: what a device says counts
 * against the place where it took over. What moves the input is only ever that hands move.
 * Moving a device while another one is followed takes nothing over later on: it has to rest first here, too.
 * Pedals are those of all devices that are there. The view stays within what a C-arm can do: HandAxisTable.
 */
class DeviceMux
{
public:
  static constexpr double RestSeconds = 0.5;
  static constexpr std::size_t Groups = 5; ///< wire, catheter, syringe, view, balloon

  /// Before the first Next(). The order is that of priority: hardware, gamepad, keyboard.
  void Add(std::shared_ptr<Device> device);

  /// The view to start from, before the first Next().
  void Start(const ViewPlace& view);

  ///@{
  /// The thread of the physics; does not wait. Command() and Heartbeat() go to all devices.
  const SessionInput& Next(std::uint64_t tick, double secondsPerTick);
  void Command(const ForceFrame& forces);
  void Heartbeat(std::uint64_t tick);
  ///@}

  /// From one other thread: moves the view there at the next tick, as a button for a standard view does.
  void PlaceView(const ViewPlace& view) { this->WantedView.Write(view); }

  /// Any thread. @param group  0 wire, 1 catheter, 2 syringe, 3 view  @return number of the device it follows, or -1
  int Follows(std::size_t group) const { return this->Owner.at(group).load(); }

private:
  /// One device's hold on one group.
  struct Hand
  {
    AxisPlaces reference{};    ///< where it was when it was last seen to move
    std::uint64_t restsAt = 0; ///< tick
    bool seen = false;
    bool moves = false;
    bool fresh = true; ///< has rested: its next movement is a new one
  };

  struct Source
  {
    InputFrame frame;
    AxisPlaces places{};
    bool noisy = false;
    std::array<Hand, Groups> hands;

    bool Drives(std::size_t group) const;
  };

  void ReadAll(std::uint64_t tick, double secondsPerTick);
  void NoteMovement(Source& source, std::size_t group, std::uint64_t tick);
  void Arbitrate(std::size_t group, std::uint64_t tick);
  void RestAnew(std::size_t group, std::uint64_t tick);
  void TakeOver(std::size_t group, std::size_t source);
  void Follow(std::size_t group);
  void Place(const ViewPlace& view);
  void Finish();

  std::vector<std::shared_ptr<Device>> All;
  std::vector<Source> Sources;
  std::array<std::atomic<int>, Groups> Owner{ { { -1 }, { -1 }, { -1 }, { -1 }, { -1 } } };
  std::array<bool, Groups> Held{};  ///< its device is lost
  std::array<bool, Groups> Begun{}; ///< has followed a device
  AxisPlaces Now = PlacesOf(SessionInput());
  AxisPlaces Offset{}; ///< of the device that each place follows
  std::uint64_t RestTicks = 0;
  SessionInput Output;
  TripleBuffer<ViewPlace> WantedView;
};
}

#endif
