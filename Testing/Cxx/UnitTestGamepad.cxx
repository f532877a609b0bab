// Events of a game controller, recorded bytes of them through a pipe, and what they make the hands do.
#include "GamepadDevice.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <linux/input.h>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

namespace UnitTestGamepad
{
using namespace coronary;

namespace
{
constexpr double Tick = 0.0005; // s

input_event Event(unsigned type, unsigned code, int value)
{
  input_event event{};
  event.type = static_cast<std::uint16_t>(type);
  event.code = static_cast<std::uint16_t>(code);
  event.value = value;
  return event;
}

std::string BytesOf(const std::vector<input_event>& events)
{
  std::string bytes(events.size() * sizeof(input_event), '\0');
  std::memcpy(&bytes[0], events.data(), bytes.size());
  return bytes;
}

/// A controller whose events come out of a pipe.
class PipedGamepad
{
public:
  PipedGamepad()
  {
    int ends[2] = { -1, -1 };
    EXPECT_EQ(::pipe(ends), 0);
    this->Into = ends[1];
    this->device = std::make_unique<GamepadDevice>(ends[0]);
  }
  ~PipedGamepad() { this->Unplug(); }

  void Write(const std::string& bytes)
  {
    EXPECT_EQ(::write(this->Into, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  void Send(std::vector<input_event> events)
  {
    events.push_back(Event(EV_SYN, SYN_REPORT, 0));
    this->Write(BytesOf(events));
  }

  void Unplug()
  {
    if (this->Into >= 0)
    {
      ::close(this->Into);
      this->Into = -1;
    }
  }

  /// Reads until it is so. @return whether it came to be
  bool Wait(const std::function<bool()>& condition)
  {
    for (int n = 0; n < 5000 && !condition(); ++n)
    {
      this->Step();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return condition();
  }

  void Step() { this->device->Read(this->tick++, Tick, this->frame); }

  double Speed()
  {
    const double before = this->frame.input.drive.wirePosition;
    this->Step();
    return (this->frame.input.drive.wirePosition - before) / Tick;
  }

  std::unique_ptr<GamepadDevice> device;
  InputFrame frame;

private:
  std::uint64_t tick = 0;
  int Into = -1;
};
}

TEST(Gamepad, DeadZoneAndResponse)
{
  EXPECT_EQ(GamepadResponse(0.0), 0.0);
  EXPECT_EQ(GamepadResponse(GamepadDeadZone), 0.0);
  EXPECT_EQ(GamepadResponse(-0.11), 0.0);
  EXPECT_DOUBLE_EQ(GamepadResponse(1.0), 1.0);
  EXPECT_DOUBLE_EQ(GamepadResponse(-1.0), -1.0);
  EXPECT_DOUBLE_EQ(GamepadResponse(0.56), 0.25); // half of what is left
  EXPECT_DOUBLE_EQ(GamepadResponse(7.0), 1.0);
}

TEST(Gamepad, EventsToState)
{
  GamepadDecoder decoder;
  EXPECT_FALSE(decoder.State().there);
  EXPECT_FALSE(decoder.Feed(EV_ABS, ABS_X, 32767));
  EXPECT_FALSE(decoder.Feed(EV_ABS, ABS_Y, 32767));
  EXPECT_FALSE(decoder.Feed(EV_ABS, ABS_RZ, 255));
  EXPECT_FALSE(decoder.Feed(EV_ABS, ABS_HAT0Y, -1));
  EXPECT_FALSE(decoder.Feed(EV_KEY, BTN_SOUTH, 1));
  EXPECT_EQ(decoder.State().leftX, 0.0); // a report is whole or not there
  EXPECT_TRUE(decoder.Feed(EV_SYN, SYN_REPORT, 0));
  const GamepadState& state = decoder.State();
  EXPECT_TRUE(state.there);
  EXPECT_EQ(state.leftX, 1.0);
  EXPECT_EQ(state.leftY, -1.0); // down is positive in evdev
  EXPECT_EQ(state.rightTrigger, 1.0);
  EXPECT_EQ(state.padY, 1.0);
  EXPECT_EQ(state.buttons, static_cast<std::uint32_t>(SouthButton));
  decoder.SetRange(ABS_X, 0, 1023);
  decoder.SetRange(ABS_X, 5, 5); // is none
  decoder.Feed(EV_ABS, ABS_X, 0);
  decoder.Feed(EV_KEY, BTN_SOUTH, 0);
  decoder.Feed(EV_ABS, 0xFFFF, 3);
  decoder.Feed(EV_KEY, 0xFFFF, 1);
  decoder.Feed(EV_SYN, SYN_REPORT, 0);
  EXPECT_EQ(decoder.State().leftX, -1.0);
  EXPECT_EQ(decoder.State().buttons, 0U);
}

TEST(Gamepad, LostEventsReleaseEverything)
{
  GamepadDecoder decoder;
  decoder.Feed(EV_ABS, ABS_Y, -32768);
  decoder.Feed(EV_KEY, BTN_SOUTH, 1);
  decoder.Feed(EV_SYN, SYN_REPORT, 0);
  decoder.Feed(EV_SYN, SYN_DROPPED, 0);
  decoder.Feed(EV_ABS, ABS_X, 32767); // of a report that is not whole
  decoder.Feed(EV_SYN, SYN_REPORT, 0);
  EXPECT_EQ(decoder.State().leftY, 0.0);
  EXPECT_EQ(decoder.State().leftX, 0.0);
  EXPECT_EQ(decoder.State().buttons, 0U);
  decoder.Feed(EV_ABS, ABS_X, 32767);
  decoder.Feed(EV_SYN, SYN_REPORT, 0);
  EXPECT_EQ(decoder.State().leftX, 1.0);
}

TEST(Gamepad, WishesAndPedals)
{
  const HandSpeeds speeds;
  GamepadState state;
  state.leftY = 1.0;
  state.rightX = -1.0;
  state.rightTrigger = 1.0;
  state.padX = -1.0;
  state.padY = 1.0;
  HandWishes wishes = GamepadWishes(state, speeds);
  EXPECT_EQ(wishes[AxisKind::WireAdvance], 1.0);
  EXPECT_EQ(wishes[AxisKind::CatheterTurn], -1.0);
  EXPECT_EQ(wishes[AxisKind::Syringe], 1.0);
  EXPECT_EQ(wishes[AxisKind::Primary], -1.0);
  EXPECT_EQ(wishes[AxisKind::Secondary], 1.0);
  EXPECT_EQ(wishes.pace, 1.0);
  state.buttons = NorthButton | LeftShoulder | SelectButton;
  wishes = GamepadWishes(state, speeds);
  EXPECT_EQ(wishes[AxisKind::Primary], 0.0);
  EXPECT_EQ(wishes[AxisKind::TableLeft], -1.0);
  EXPECT_EQ(wishes[AxisKind::TableHead], 1.0);
  EXPECT_EQ(wishes[AxisKind::Syringe], 0.0);
  EXPECT_EQ(wishes.pace, speeds.fine);
  state.buttons = WestButton | RightShoulder;
  wishes = GamepadWishes(state, speeds);
  EXPECT_EQ(wishes[AxisKind::SourceToDetector], 1.0);
  EXPECT_EQ(wishes.pace, speeds.fast);

  std::uint32_t pedals = 0;
  for (const auto& step : std::vector<std::pair<double, std::uint32_t>>{
         { 0.45, 0U }, { 0.55, FluoroscopyPedal }, { 0.45, FluoroscopyPedal }, { 0.35, 0U } })
  {
    state.leftTrigger = step.first;
    state.buttons = 0;
    pedals = GamepadPedals(state, pedals);
    EXPECT_EQ(pedals, step.second) << step.first;
  }
  state.buttons = SouthButton | EastButton;
  EXPECT_EQ(GamepadPedals(state, 0), CinePedal | MaskPedal);
}

TEST(Gamepad, RecordedEventsThroughAPipe)
{
  PipedGamepad pad;
  ASSERT_TRUE(pad.Wait([&] { return pad.frame.state == DeviceState::Running; }));
  EXPECT_EQ(pad.frame.input.drive.wirePosition, 0.0);
  pad.Send({ Event(EV_ABS, ABS_Y, -32768), Event(EV_KEY, BTN_EAST, 1) });
  ASSERT_TRUE(pad.Wait([&] { return pad.Speed() > 9.9; }));
  EXPECT_LE(pad.Speed(), 10.0 + 1e-6);
  EXPECT_EQ(pad.frame.input.pedals, static_cast<std::uint32_t>(MaskPedal));
  // Within the dead zone; in pieces of bytes.
  const std::string bytes = BytesOf({ Event(EV_ABS, ABS_Y, 2000), Event(EV_SYN, SYN_REPORT, 0) });
  pad.Write(bytes.substr(0, 7));
  pad.Write(bytes.substr(7, 30));
  pad.Write(bytes.substr(37));
  ASSERT_TRUE(pad.Wait([&] { return pad.Speed() == 0.0; }));
  pad.Send({ Event(EV_ABS, ABS_Y, 32767) });
  ASSERT_TRUE(pad.Wait([&] { return pad.Speed() < -9.0; }));
  // Goes away while it is deflected: held at once, nothing pressed.
  pad.Unplug();
  ASSERT_TRUE(pad.Wait([&] { return pad.frame.state == DeviceState::Disconnected; }));
  EXPECT_EQ(pad.frame.input.pedals, 0U);
  EXPECT_EQ(pad.Speed(), 0.0);
  ASSERT_TRUE(pad.Wait([&] { return pad.device->Status().state == DeviceState::Disconnected; }));
}

TEST(Gamepad, NothingThere)
{
  if (!GamepadDevice::HasEvdev())
  {
    EXPECT_THROW(GamepadDevice(std::string()), std::runtime_error);
    return;
  }
  GamepadDevice device("/nowhere/event0");
  EXPECT_NE(WaitWhileConnecting(device, 5.0).text.find("/nowhere/event0"), std::string::npos);
  GamepadDevice file("/dev/null");
  const DeviceStatus status = WaitWhileConnecting(file, 5.0);
  EXPECT_EQ(status.state, DeviceState::Refused);
  EXPECT_NE(status.text.find("no game controller"), std::string::npos);
}
}
