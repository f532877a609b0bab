// Devices and what they become in one input, on a clock that the test moves.
#include "ClockOffset.h"
#include "CounterRandom.h"
#include "DeviceMux.h"
#include "DeviceScenario.h"
#include "DeviceUri.h"
#include "KeyboardDevice.h"
#include "RecordedDevices.h"
#include "Recording.h"
#include "RingQueue.h"
#include "ScriptedDevice.h"

#include "Refusals.h"
#include "VirtualPort.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace UnitTestDevices
{
using namespace coronary;

namespace
{
constexpr double Tick = 0.0005; // s

bool Says(const Device& device, const std::string& part)
{
  return device.Status().text.find(part) != std::string::npos;
}

/// Hands that the test moves.
class TestDevice : public Device
{
public:
  explicit TestDevice(std::uint32_t axes = AllAxes) { this->Frame.axes = axes; }

  void Read(std::uint64_t /*tick*/, double /*secondsPerTick*/, InputFrame& frame) override
  {
    this->Frame.input.drive.wirePosition += this->Speed * Tick;
    frame = this->Frame;
  }
  DeviceStatus Status() const override { return {}; }
  bool IsScripted() const override { return this->Scripted; }

  InputFrame Frame;
  double Speed = 0.0; ///< mm/s of the wire
  bool Scripted = false;
};

struct MuxBench
{
  MuxBench()
  {
    for (const std::shared_ptr<TestDevice>& device : { this->first, this->second })
    {
      device->Frame.state = DeviceState::Running;
      this->mux.Add(device);
    }
  }

  std::shared_ptr<TestDevice> first = std::make_shared<TestDevice>();
  std::shared_ptr<TestDevice> second = std::make_shared<TestDevice>();
  DeviceMux mux;
  std::uint64_t tick = 0;
  double maximumStep = 0.0;

  double Run(double seconds)
  {
    double at = 0.0;
    for (auto left = std::llround(seconds / Tick); left > 0; --left)
    {
      const double before = this->last.drive.wirePosition;
      this->last = this->mux.Next(this->tick++, Tick);
      at = this->last.drive.wirePosition;
      this->maximumStep = std::max(this->maximumStep, std::abs(at - before));
    }
    return at;
  }

  SessionInput last;
};
}

TEST(ClockOffset, FastestRoundTripCounts)
{
  // The way there takes 50 us, the way back 50 us and sometimes up to 10 ms more.
  RandomStream random(3);
  ClockOffset clock;
  EXPECT_FALSE(clock.Known());
  constexpr double Ahead = 123456.0;
  constexpr double Faster = 40e-6;
  double expected = 0.0;
  for (std::uint64_t n = 0; n < 320; ++n)
  {
    const std::uint64_t sent = 1000000 + n * 100000;
    const std::uint64_t late = n % 10 == 0 ? 0 : random.Bits() % 10000;
    expected = Ahead + Faster * static_cast<double>(sent + 50);
    clock.Add(
      sent, sent + 100 + late, sent + 50 + static_cast<std::uint64_t>(std::llround(expected)));
  }
  EXPECT_NEAR(clock.RoundTrip(), 100.0, 100.0);
  EXPECT_NEAR(clock.Offset(), expected, 150.0); // of which 128 are the drift in a window
  EXPECT_NEAR(clock.Drift(), 40.0, 4.0);
}

TEST(ClockOffset, DeviceBehind)
{
  ClockOffset clock;
  clock.Add(5000000, 5000200, 100);
  EXPECT_DOUBLE_EQ(clock.Offset(), -5000000.0);
}

TEST(SerialDevice, HandshakeAndPlaces)
{
  EmulatedDeviceSettings settings;
  settings.firstCount = std::numeric_limits<std::int32_t>::max() - 10; // wraps soon
  VirtualBench bench(settings);
  EXPECT_EQ(bench.serial.Status().state, DeviceState::Connecting);
  bench.Run(0.05);
  ASSERT_EQ(bench.State(), DeviceState::Running);
  EXPECT_EQ(bench.frame.axes, static_cast<std::uint32_t>(AllAxes & ~BalloonAxes));
  EXPECT_EQ(bench.frame.input.drive.wirePosition, 0.0);
  bench.line.device.Hands().pedals = CinePedal;
  bench.line.device.Hands().buttons = 2;
  bench.atTick = [&]
  {
    bench.Place(AxisKind::WireAdvance) += 0.05;
    bench.Place(AxisKind::WireTurn) -= 0.002;
    bench.Place(AxisKind::Syringe) += 0.001;
    bench.Place(AxisKind::Primary) += 0.0005;
  };
  bench.Run(2.0);
  bench.atTick = nullptr;
  bench.Run(0.01);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, 200.0, 0.005);
  EXPECT_NEAR(bench.frame.input.drive.wireAngle, -8.0, 4e-4);
  EXPECT_NEAR(bench.frame.input.syringe, 4.0, 0.001);
  EXPECT_NEAR(bench.frame.input.primary, 2.0, 4e-4);
  EXPECT_EQ(bench.frame.input.pedals, static_cast<std::uint32_t>(CinePedal));
  EXPECT_EQ(bench.frame.buttons, 2U);
  EXPECT_LT(bench.maximumStep, 0.056); // even, although states come at half the rate of ticks
  EXPECT_EQ(bench.serial.Status().glitches, 0U);
  EXPECT_TRUE(Says(bench.serial, "EMU-0001"));
}

TEST(SerialDevice, WatchdogTimes)
{
  VirtualBench bench;
  bench.Run(0.5);
  ASSERT_EQ(bench.State(), DeviceState::Running);
  bench.line.device.Hands().pedals = FluoroscopyPedal;
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.01; };
  bench.Run(0.1);
  EXPECT_EQ(bench.frame.input.pedals, static_cast<std::uint32_t>(FluoroscopyPedal));
  bench.line.silent = true;
  EXPECT_NEAR(bench.Until([&] { return bench.State() == DeviceState::Stale; }), 0.030, 0.002);
  const double held = bench.frame.input.drive.wirePosition;
  EXPECT_NEAR(
    bench.Until([&] { return bench.State() == DeviceState::Disconnected; }), 0.170, 0.002);
  EXPECT_EQ(bench.frame.input.drive.wirePosition, held);
  EXPECT_EQ(bench.frame.input.pedals, 0U);
  EXPECT_TRUE(Says(bench.serial, "silent"));
}

TEST(SerialDevice, ShortSilenceIsCaughtUpEvenly)
{
  VirtualBench bench;
  bench.Run(0.2);
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.05; };
  bench.Run(0.2);
  bench.line.silent = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.State(), DeviceState::Stale);
  bench.line.silent = false;
  bench.maximumStep = 0.0;
  bench.Run(0.01);
  EXPECT_EQ(bench.State(), DeviceState::Running);
  bench.atTick = nullptr;
  bench.Run(0.4);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, bench.Place(AxisKind::WireAdvance), 0.006);
  EXPECT_LT(bench.maximumStep, 2 * 0.056); // on top of the movement that goes on
}

TEST(SerialDevice, LostAndFoundWithoutAJump)
{
  VirtualBench bench;
  bench.commands = true;
  bench.force.wireForce = -1.0;
  bench.Run(0.2);
  bench.serial.ConfirmForces();
  bench.Place(AxisKind::WireAdvance) = 0.0;
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.02; };
  bench.Run(0.5);
  EXPECT_NEAR(bench.line.device.Motors()[0], -1.0, 1e-6);
  bench.atTick = nullptr;
  bench.Run(0.05);
  const double before = bench.frame.input.drive.wirePosition;
  bench.line.gone = true;
  bench.line.opening = PortOpening::Missing;
  EXPECT_LE(bench.Until([&] { return bench.State() == DeviceState::Disconnected; }), 0.001);
  bench.Place(AxisKind::WireAdvance) += 55.0; // moved while nobody looked
  bench.Place(AxisKind::WireTurn) += 3.0;
  bench.Run(2.0);
  bench.line.gone = false;
  bench.line.opening = PortOpening::Open;
  bench.maximumStep = 0.0;
  EXPECT_LT(bench.Until([&] { return bench.State() == DeviceState::Running; }), 5.1);
  bench.Run(0.5);
  EXPECT_EQ(bench.frame.input.drive.wirePosition, before);
  EXPECT_EQ(bench.maximumStep, 0.0);
  EXPECT_EQ(bench.serial.Status().glitches, 0U);
  // No forces before the trainee says so.
  EXPECT_TRUE(bench.serial.Status().awaitsForces);
  EXPECT_EQ(bench.line.device.Motors()[0], 0.0);
  bench.serial.ConfirmForces();
  bench.Run(0.1);
  EXPECT_FALSE(bench.serial.Status().awaitsForces);
  EXPECT_NEAR(bench.line.device.Motors()[0], -1.0, 1e-6);
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.02; };
  bench.Run(0.5);
  bench.atTick = nullptr;
  bench.Run(0.01);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, before + 20.0, 0.006);
}

TEST(SerialDevice, BackOff)
{
  VirtualBench bench;
  bench.line.opening = PortOpening::Missing;
  std::vector<double> times;
  const std::uint64_t start = bench.line.now;
  int openings = 0;
  bench.atTick = [&]
  {
    if (bench.line.openings > openings)
    {
      openings = bench.line.openings;
      times.push_back(1e-6 * static_cast<double>(bench.line.now - start));
    }
  };
  bench.Run(14.0);
  ASSERT_EQ(times.size(), 5U);
  const std::vector<double> expected{ 0.0, 1.0, 3.0, 8.0, 13.0 };
  for (std::size_t n = 0; n < times.size(); ++n)
  {
    EXPECT_NEAR(times[n], expected[n], 0.005);
  }
}

TEST(SerialDevice, NoAnswerIsAnotherDevice)
{
  VirtualBench bench;
  int hellos = 0;
  bench.line.device.OnMessage = [&](const Message& message, std::uint64_t)
  { hellos += message.type == MessageType::Hello ? 1 : 0; };
  bench.line.silent = true;
  EXPECT_NEAR(bench.Until([&] { return bench.State() == DeviceState::Refused; }), 1.5, 0.005);
  EXPECT_EQ(hellos, 3);
  EXPECT_TRUE(Says(bench.serial, "does not answer"));
  bench.line.silent = false; // plugged in another one
  EXPECT_NEAR(bench.Until([&] { return bench.State() == DeviceState::Running; }), 1.0, 0.01);
}

TEST(SerialDevice, OtherVersionAndOtherMagicAreRefused)
{
  EmulatedDeviceSettings settings;
  settings.major = 2;
  VirtualBench version(settings);
  version.Run(0.05);
  EXPECT_EQ(version.State(), DeviceState::Refused);
  EXPECT_TRUE(Says(version.serial, "version 2"));
  EXPECT_NE(version.line.device.Now(), EmulatedDevice::State::Streaming);
  settings.major = ProtocolMajor;
  settings.wrongMagic = true;
  VirtualBench magic(settings);
  magic.Run(0.05);
  EXPECT_EQ(magic.State(), DeviceState::Refused);
  EXPECT_TRUE(Says(magic.serial, "no device for this simulator"));
  settings.wrongMagic = false;
  settings.rate = 50;
  VirtualBench slow(settings);
  slow.Run(0.05);
  EXPECT_EQ(slow.State(), DeviceState::Refused);
  EXPECT_TRUE(Says(slow.serial, "100 times a second"));
}

TEST(SerialDevice, SlowDevice)
{
  EmulatedDeviceSettings settings;
  settings.rate = 125;
  VirtualBench bench(settings);
  bench.Run(0.1);
  ASSERT_EQ(bench.State(), DeviceState::Running);
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.01; };
  bench.Run(0.5);
  bench.maximumStep = 0.0;
  bench.Run(1.0);
  EXPECT_LT(bench.maximumStep, 0.0106); // not 0.16 mm every 8 ms
  // Slower than it said: silence again and again.
  bench.line.device.Settings().rate = 20;
  EXPECT_LT(bench.Until([&] { return bench.State() == DeviceState::Stale; }), 0.06);
}

TEST(SerialDevice, GlitchesAreNoMovement)
{
  VirtualBench bench;
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.05; };
  bench.Run(0.5);
  const double before = bench.frame.input.drive.wirePosition;
  const double places = bench.Place(AxisKind::WireAdvance);
  bench.maximumStep = 0.0;
  bench.line.device.JumpCounts(100000);
  bench.Run(0.2);
  EXPECT_EQ(bench.serial.Status().glitches, 7U); // one of each axis
  bench.line.device.JumpCounts(std::numeric_limits<std::int32_t>::min());
  bench.Run(0.2);
  EXPECT_EQ(bench.serial.Status().glitches, 14U);
  EXPECT_LT(bench.maximumStep, 0.056);
  // Of each jump the movement within one state is lost.
  EXPECT_NEAR(bench.frame.input.drive.wirePosition - before,
    bench.Place(AxisKind::WireAdvance) - places, 2 * 0.1 + 0.006);
  EXPECT_EQ(bench.State(), DeviceState::Running);
}

TEST(SerialDevice, FastHandsAreNoGlitch)
{
  VirtualBench bench;
  bench.Run(0.1);
  bench.atTick = [&]
  {
    bench.Place(AxisKind::WireAdvance) += 1.9e3 * Tick;
    bench.Place(AxisKind::WireTurn) += 58.0 * Tick;
  };
  bench.Run(0.5);
  EXPECT_EQ(bench.serial.Status().glitches, 0U);
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 2.1e3 * Tick; };
  bench.Run(0.1);
  EXPECT_GT(bench.serial.Status().glitches, 90U);
}

TEST(SerialDevice, DisturbedLine)
{
  VirtualBench bench;
  int frames = 0;
  int every = 200; // 0.5 %
  bench.line.disturb = [&](std::vector<WireFrame>& out)
  {
    for (WireFrame& frame : out)
    {
      frame.bytes[5] =
        static_cast<std::uint8_t>(++frames % every == 0 ? frame.bytes[5] ^ 1U : frame.bytes[5]);
    }
  };
  bench.Run(3.0);
  EXPECT_EQ(bench.State(), DeviceState::Running);
  EXPECT_NEAR(bench.serial.Status().errorsPerSecond, 5.0, 1.0);
  every = 50; // 2 %
  bench.Run(2.1);
  EXPECT_EQ(bench.State(), DeviceState::Stale);
  EXPECT_NEAR(bench.serial.Status().errorsPerSecond, 20.0, 2.0);
  EXPECT_TRUE(Says(bench.serial, "disturbed"));
  const double held = bench.frame.input.drive.wirePosition;
  bench.maximumStep = 0.0;
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.05; };
  bench.Run(0.5);
  EXPECT_EQ(bench.frame.input.drive.wirePosition, held);
  bench.atTick = nullptr;
  every = 1000000;
  bench.Run(2.5);
  EXPECT_EQ(bench.State(), DeviceState::Running);
  EXPECT_EQ(bench.frame.input.drive.wirePosition, held);
  EXPECT_EQ(bench.maximumStep, 0.0);
}

TEST(SerialDevice, DrivesByTornFramesAndJunk)
{
  VirtualBench bench;
  bench.line.most = 61; // frames come in pieces
  bench.Run(0.1);
  ASSERT_EQ(bench.State(), DeviceState::Running);
  RandomStream random(7);
  int junk = 0;
  bench.atTick = [&]
  {
    bench.Place(AxisKind::WireAdvance) += 0.01;
    // Between frames, and without the byte that ends one: the next one is lost with it.
    for (int n = bench.tick % 200 == 0 ? 40 : 0; n > 0; --n, ++junk)
    {
      bench.line.toHost.push_back(static_cast<std::uint8_t>((random.Bits() & 0xFFU) | 1U));
    }
  };
  bench.Run(1.0);
  bench.atTick = nullptr;
  bench.Run(0.05);
  EXPECT_EQ(junk, 400);
  EXPECT_EQ(bench.State(), DeviceState::Running);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, 20.0, 0.006);
  EXPECT_LT(bench.maximumStep, 0.1);
}

TEST(SerialDevice, LostRepeatedAndReorderedStatesLoseNothing)
{
  VirtualBench bench;
  int frames = 0;
  std::vector<WireFrame> kept;
  bench.Run(0.1);
  bench.line.disturb = [&](std::vector<WireFrame>& out)
  {
    if (out.empty())
    {
      return;
    }
    ++frames;
    if (frames % 300 == 0)
    {
      out.clear();
    }
    else if (frames % 310 == 0)
    {
      out.push_back(out.back());
    }
    else if (frames % 320 == 0)
    {
      kept = std::move(out);
      out.clear();
    }
    else if (!kept.empty())
    {
      out.insert(out.end(), kept.begin(), kept.end());
      kept.clear();
    }
  };
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.02; };
  bench.Run(3.0);
  bench.atTick = nullptr;
  bench.line.disturb = nullptr;
  bench.Run(0.05);
  EXPECT_EQ(bench.State(), DeviceState::Running);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, 120.0, 0.006);
  EXPECT_EQ(bench.serial.Status().glitches, 0U);
  EXPECT_GT(bench.serial.Link().Counts().repeated, 10U);
  EXPECT_GT(bench.serial.Link().Counts().lost, 10U);
}

TEST(SerialDevice, ForcesAreClampedAndRiseSlowly)
{
  VirtualBench bench;
  bench.commands = true;
  bench.force.wireForce = -9.0;      // N; the axis has 2
  bench.force.catheterTorque = 15.0; // N mm; the axis has 20
  bench.Run(0.2);
  EXPECT_TRUE(bench.serial.Status().awaitsForces);
  EXPECT_EQ(bench.line.device.Motors()[0], 0.0);
  bench.serial.ConfirmForces();
  double maximum = 0.0;
  double last = 0.0;
  bench.atTick = [&]
  {
    maximum = std::max(maximum, std::abs(bench.line.device.Motors()[0] - last));
    last = bench.line.device.Motors()[0];
  };
  bench.Run(0.015);
  EXPECT_GT(bench.line.device.Motors()[0], -2.0);
  bench.Run(0.1);
  EXPECT_NEAR(bench.line.device.Motors()[0], -2.0, 1e-6);
  EXPECT_NEAR(bench.line.device.Motors()[3], 0.015, 1e-6);
  EXPECT_LE(maximum, 0.11 * 2.0); // full force in 20 ms, states of the motor each ms or so
  EXPECT_FALSE(bench.line.device.Clamped());
}

TEST(SerialDevice, DeviceRelaxesWithoutPhysics)
{
  for (const bool poison : { false, true })
  {
    VirtualBench bench;
    bench.commands = true;
    bench.force.wireForce = 1.5;
    bench.Run(0.1);
    bench.serial.ConfirmForces();
    bench.Run(0.2);
    ASSERT_NEAR(bench.line.device.Motors()[0], 1.5, 1e-6);
    (poison ? bench.force.wireForce : bench.force.catheterForce) = std::nan("");
    bench.alive = poison;
    const auto relaxed = [&] { return bench.line.device.Relaxed(); };
    const auto loose = [&] { return bench.line.device.Motors()[0] == 0.0; };
    EXPECT_NEAR(bench.Until(relaxed), 0.020, 0.0055);
    EXPECT_NEAR(bench.Until(loose), 0.050, 0.001);
    // It stays so until the trainee wants it otherwise.
    bench.alive = true;
    bench.force.wireForce = 1.5;
    bench.force.catheterForce = 0.0;
    bench.Run(0.5);
    EXPECT_EQ(bench.line.device.Motors()[0], 0.0);
    EXPECT_TRUE(bench.serial.Status().awaitsForces);
    bench.serial.ConfirmForces();
    bench.Run(0.2);
    EXPECT_NEAR(bench.line.device.Motors()[0], 1.5, 1e-6);
  }
}

TEST(SerialDevice, ForceIsGoodForItsTimeOnly)
{
  VirtualBench bench;
  bench.commands = true;
  bench.force.wireForce = 1.0;
  bench.force.validMilliseconds = 10;
  bench.Run(0.1);
  bench.serial.ConfirmForces();
  bench.Run(0.1);
  EXPECT_FALSE(bench.line.device.Relaxed());
  bench.commands = false; // heartbeats go on
  EXPECT_NEAR(bench.Until([&] { return bench.line.device.Relaxed(); }), 0.010, 0.003);
}

TEST(SerialDevice, HeartbeatsStopWhenPhysicsOverruns)
{
  VirtualBench bench;
  bench.Run(0.1);
  int heartbeats = 0;
  bench.line.device.OnMessage = [&](const Message& message, std::uint64_t)
  { heartbeats += message.type == MessageType::Heartbeat ? 1 : 0; };
  bench.Run(1.0);
  EXPECT_NEAR(heartbeats, 200, 2);
  bench.alive = false;
  bench.Run(0.0045);
  heartbeats = 0;
  bench.Run(1.0);
  EXPECT_EQ(heartbeats, 0);
}

TEST(SerialDevice, NoForcesWhileStale)
{
  VirtualBench bench;
  bench.commands = true;
  bench.force.wireForce = 1.0;
  bench.Run(0.1);
  bench.serial.ConfirmForces();
  bench.Run(0.1);
  ASSERT_NEAR(bench.line.device.Motors()[0], 1.0, 1e-6);
  bench.line.silent = true;
  bench.Run(0.033);
  EXPECT_EQ(bench.line.device.Motors()[0], 0.0);
  EXPECT_FALSE(bench.line.device.Relaxed());
  bench.line.silent = false;
  bench.Run(0.1);
  EXPECT_NEAR(bench.line.device.Motors()[0], 1.0, 1e-6);
}

TEST(SerialDevice, DeviceThreadThatHangsIsALostDevice)
{
  VirtualBench bench;
  bench.line.device.Hands().pedals = CinePedal;
  bench.Run(0.1);
  bench.ioAlive = false;
  EXPECT_NEAR(bench.Until([&] { return bench.State() == DeviceState::Disconnected; }), 0.2, 0.002);
  EXPECT_EQ(bench.frame.input.pedals, 0U);
}

TEST(SerialDevice, PauseOfThePhysicsOrOfTheThreadIsNoJump)
{
  for (const bool ofThread : { false, true })
  {
    VirtualBench bench;
    bench.Run(0.1);
    bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.05; };
    bench.Run(0.2);
    const double before = bench.frame.input.drive.wirePosition;
    bench.maximumStep = 0.0;
    (ofThread ? bench.ioAlive : bench.alive) = false;
    bench.Run(1.0);
    bench.ioAlive = bench.alive = true;
    bench.Run(0.1);
    EXPECT_EQ(bench.State(), DeviceState::Running);
    EXPECT_LT(bench.maximumStep, 0.056);
    EXPECT_NEAR(bench.frame.input.drive.wirePosition, before + 10.0, 0.3);
  }
}

TEST(SerialDevice, ZeroAndCalibrationMoveNothing)
{
  VirtualBench bench;
  bench.Run(0.1);
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.02; };
  bench.Run(0.5);
  bench.atTick = nullptr;
  bench.Run(0.01);
  const double before = bench.frame.input.drive.wirePosition;
  EXPECT_GT(before, 19.0);
  bench.maximumStep = 0.0;
  bench.serial.Zero(1U << static_cast<unsigned>(AxisKind::WireAdvance));
  bench.Run(0.1);
  EXPECT_EQ(bench.frame.input.drive.wirePosition, before);
  EXPECT_EQ(bench.maximumStep, 0.0);
  EXPECT_EQ(bench.serial.Status().glitches, 0U);
  // Moves on as far as before.
  bench.atTick = [&] { bench.Place(AxisKind::WireAdvance) += 0.02; };
  bench.Run(0.5);
  bench.atTick = nullptr;
  bench.Run(0.01);
  EXPECT_NEAR(bench.frame.input.drive.wirePosition, before + 20.0, 0.006);
}

TEST(SerialDevice, ClockOfTheDevice)
{
  EmulatedDeviceSettings settings;
  settings.clockOffset = -900000000;
  settings.clockDrift = 100.0;
  VirtualBench bench(settings);
  bench.Run(12.0);
  const ClockOffset& clock = bench.serial.Link().Clock();
  ASSERT_TRUE(clock.Known());
  EXPECT_NEAR(clock.Drift(), 100.0, 1.0);
  EXPECT_NEAR(
    static_cast<double>(bench.serial.TakenAt()), static_cast<double>(bench.line.now), 1200.0);
}

TEST(DeviceMux, AScriptIsFollowedToTheBit)
{
  auto script = std::make_shared<TestDevice>(WireAxes | CatheterAxes);
  script->Scripted = true;
  script->Frame.state = DeviceState::Running;
  script->Frame.input.drive = { 1.1, 0.3, -2.7, 0.9 };
  DeviceMux mux;
  mux.Add(script);
  for (std::uint64_t tick = 0; tick < 1000; ++tick)
  {
    script->Frame.input.drive.wirePosition += 0.1 / 3.0;
    const SessionInput& input = mux.Next(tick, Tick);
    ASSERT_EQ(input.drive.wirePosition, script->Frame.input.drive.wirePosition);
    ASSERT_EQ(input.drive.catheterPosition, -2.7);
  }
}

TEST(DeviceMux, HandsStartWhereTheyAre)
{
  MuxBench bench;
  bench.first->Frame.input.drive.wirePosition = 77.0;
  EXPECT_EQ(bench.Run(0.1), 0.0);
  bench.first->Speed = 10.0;
  EXPECT_NEAR(bench.Run(1.0), 10.0, 1e-9);
}

TEST(DeviceMux, EarlierTakesWhenItMovesLaterWhenThatRests)
{
  MuxBench bench;
  bench.Run(1.0);
  EXPECT_EQ(bench.mux.Follows(0), 0);
  bench.second->Speed = 10.0;
  EXPECT_GT(bench.Run(1.0), 9.5);
  EXPECT_EQ(bench.mux.Follows(0), 1);
  EXPECT_EQ(bench.mux.Follows(1), 0); // the catheter is another matter
  bench.first->Speed = -20.0;
  bench.Run(0.1);
  EXPECT_EQ(bench.mux.Follows(0), 0);
  bench.Run(1.0);
  // The later one still moves; when the earlier one stops that alone does not bring it in.
  bench.first->Speed = 0.0;
  const double rest = bench.Run(2.0);
  EXPECT_EQ(bench.Run(0.5), rest);
  bench.second->Speed = 0.0;
  bench.Run(1.0);
  bench.second->Speed = 10.0;
  bench.Run(0.1);
  EXPECT_EQ(bench.mux.Follows(0), 1);
  EXPECT_LT(bench.maximumStep, 0.0101);
}

TEST(DeviceMux, LostDeviceIsHeldUntilANewMovement)
{
  MuxBench bench;
  bench.first->Speed = 10.0;
  bench.second->Speed = 10.0;
  bench.first->Frame.input.pedals = FluoroscopyPedal;
  bench.second->Frame.input.pedals = MaskPedal;
  const double before = bench.Run(1.0);
  EXPECT_EQ(bench.last.pedals, FluoroscopyPedal | MaskPedal);
  bench.first->Frame.state = DeviceState::Disconnected;
  bench.first->Frame.input.pedals = 0;
  EXPECT_EQ(bench.Run(3.0), before);
  EXPECT_EQ(bench.last.pedals, static_cast<std::uint32_t>(MaskPedal));
  bench.second->Speed = 0.0;
  bench.Run(0.4);
  bench.second->Speed = 10.0; // has not rested long enough
  EXPECT_EQ(bench.Run(1.0), before);
  bench.second->Speed = 0.0;
  bench.Run(0.6);
  bench.second->Speed = 10.0;
  EXPECT_NEAR(bench.Run(1.0), before + 10.0, 0.3);
  // It comes back somewhere else: nothing moves until it does.
  bench.second->Speed = 0.0;
  bench.first->Speed = 0.0;
  const double after = bench.Run(0.1);
  bench.first->Frame.input.drive.wirePosition += 300.0;
  bench.first->Frame.state = DeviceState::Running;
  EXPECT_LT(bench.maximumStep, 0.0101);
  EXPECT_NEAR(bench.Run(1.0), after, 0.0101);
  bench.first->Speed = 5.0;
  EXPECT_NEAR(bench.Run(1.0), after + 5.0, 0.3);
  EXPECT_EQ(bench.mux.Follows(0), 0);
  EXPECT_LT(bench.maximumStep, 0.0101);
}

TEST(DeviceMux, SyringeIsHeldWhenItsDeviceIsLost)
{
  MuxBench bench;
  for (int n = 0; n < 1000; ++n)
  {
    bench.first->Frame.input.syringe += 0.001;
    bench.Run(Tick);
  }
  EXPECT_NEAR(bench.last.syringe, 1.0, 0.002);
  const double held = bench.last.syringe;
  bench.first->Frame.state = DeviceState::Stale;
  bench.first->Frame.input.syringe += 1.0;
  bench.Run(0.2);
  EXPECT_EQ(bench.last.syringe, held);
}

TEST(DeviceMux, ViewsAreLimitedAndCanBePlaced)
{
  MuxBench bench;
  ViewPlace view;
  view.primary = 0.5;
  view.sourceToDetector = 1000.0;
  bench.mux.Start(view);
  bench.Run(0.1);
  EXPECT_EQ(bench.last.primary, 0.5);
  EXPECT_EQ(bench.last.sourceToDetector, 1000.0);
  bench.first->Frame.input.primary += 10.0;
  bench.first->Frame.input.table[2] -= 900.0;
  bench.Run(Tick);
  EXPECT_DOUBLE_EQ(bench.last.primary, 120.0 * M_PI / 180.0);
  EXPECT_EQ(bench.last.table[2], -200.0);
  bench.first->Frame.input.primary -= 0.1; // back at once
  bench.Run(Tick);
  EXPECT_NEAR(bench.last.primary, 120.0 * M_PI / 180.0 - 0.1, 1e-12);
  view.primary = -0.3;
  bench.mux.PlaceView(view);
  bench.Run(Tick);
  EXPECT_EQ(bench.last.primary, -0.3);
  bench.first->Frame.input.primary += 0.01;
  bench.Run(Tick);
  EXPECT_NEAR(bench.last.primary, -0.29, 1e-12);
}

TEST(DeviceMux, TheFirstThatIsThereWhileNothingMoves)
{
  MuxBench bench;
  bench.first->Frame.state = DeviceState::Connecting;
  bench.Run(1.0);
  EXPECT_EQ(bench.mux.Follows(0), 1);
  bench.first->Frame.input.drive.wirePosition = 40.0;
  bench.first->Frame.state = DeviceState::Running;
  bench.Run(1.0);
  EXPECT_EQ(bench.mux.Follows(0), 0);
  EXPECT_EQ(bench.last.drive.wirePosition, 0.0);
  bench.first->Speed = 1.0; // nothing of it is lost
  EXPECT_NEAR(bench.Run(0.1), 0.1, 1e-9);
}

TEST(DeviceMux, TremblingEncodersDoNotKeepOthersOut)
{
  MuxBench bench;
  bench.mux.Add(std::make_shared<KeyboardDevice>());
  DeviceMux mux;
  VirtualBench serial;
  serial.Run(0.1);
  std::shared_ptr<Device> hardware(&serial.serial, [](Device*) {});
  mux.Add(hardware);
  mux.Add(bench.second);
  const auto run = [&](double seconds)
  {
    double at = 0.0;
    for (auto left = std::llround(seconds / Tick); left > 0; --left)
    {
      serial.Place(AxisKind::WireAdvance) = left / 2 % 2 == 0 ? 0.0 : 0.01;
      serial.Step();
      at = mux.Next(bench.tick++, Tick).drive.wirePosition;
    }
    return at;
  };
  run(1.0);
  EXPECT_EQ(mux.Follows(0), 0);
  bench.second->Speed = 10.0;
  EXPECT_GT(run(1.0), 9.9);
  EXPECT_EQ(mux.Follows(0), 1);
}

TEST(DeviceUri, Names)
{
  EXPECT_EQ(ParseDeviceUri("serial:/dev/ttyACM0").path, "/dev/ttyACM0");
  EXPECT_EQ(ParseDeviceUri("replay:a:b").path, "a:b");
  EXPECT_EQ(ParseDeviceUri("gamepad:").scheme, "gamepad");
  for (const char* wrong : { "serial:", "replay:", "script:" })
  {
    ExpectRefusal([&] { ParseDeviceUri(wrong); }, "needs a path");
  }
  ExpectRefusal([] { ParseDeviceUri("keyboard:x"); }, "none is wanted");
  for (const char* wrong : { "", "serial", "mouse:", ":", "SERIAL:/dev/ttyACM0" })
  {
    ExpectRefusal([&] { ParseDeviceUri(wrong); }, std::string("'") + wrong + "' is none of");
  }
  InputFrame frame;
  OpenDevice("null:")->Read(0, Tick, frame);
  EXPECT_EQ(frame.state, DeviceState::Running);
  EXPECT_EQ(frame.axes, 0U);
  OpenDevice("keyboard:")->Read(0, Tick, frame);
  EXPECT_EQ(frame.axes, static_cast<std::uint32_t>(AllAxes));
  EXPECT_THROW(OpenDevice("replay:/nowhere"), std::runtime_error);
  EXPECT_THROW(OpenDevice("script:/nowhere"), std::runtime_error);
}

TEST(ScriptDevice, AsAHeadlessSessionHasIt)
{
  const std::string path = testing::TempDir() + "device-script.json";
  std::ofstream(path) << R"({"format":"dynamiccoronary script","version":1,
    "pieces":[{"seconds":0.3,"wire_mm":7},{"seconds":0.2,"catheter_deg":30}]})";
  const DriveScript script = ReadDriveScript(path);
  const std::shared_ptr<Device> device = OpenDevice("script:" + path);
  DeviceMux mux;
  mux.Add(device);
  InputFrame frame;
  for (std::uint64_t tick = 0; tick < 1200; ++tick)
  {
    const DriveInput expected = script.At(static_cast<double>(tick + 1) / 2000.0).drive;
    const DriveInput drive = mux.Next(tick, Tick).drive;
    ASSERT_EQ(drive.wirePosition, expected.wirePosition);
    ASSERT_EQ(drive.catheterAngle, expected.catheterAngle);
    device->Read(tick, Tick, frame);
    ASSERT_EQ(frame.state, tick < 1000 ? DeviceState::Running : DeviceState::Ended) << tick;
  }
}

TEST(ReplayDevice, AsItWasRecorded)
{
  const std::string path = testing::TempDir() + "device-replay.pcirec";
  RecordingHeader header;
  header.tickRate = 2000.0;
  std::vector<SessionInput> inputs;
  {
    RecordingWriter writer(path, header);
    for (std::uint64_t tick = 0; tick < 3000; ++tick)
    {
      SessionInput input;
      input.drive.wirePosition = tick % 500 < 300 || inputs.empty()
        ? std::sin(0.01 * static_cast<double>(tick))
        : inputs.back().drive.wirePosition;
      inputs.push_back(input);
      writer.Input(tick, input);
    }
    writer.Finish(3000);
  }
  ReplayDevice device(path);
  EXPECT_EQ(device.Ticks(), 3000U);
  InputFrame frame;
  for (std::uint64_t tick = 0; tick < 3100; ++tick)
  {
    device.Read(tick, Tick, frame);
    ASSERT_EQ(frame.input.drive.wirePosition,
      inputs[std::min<std::uint64_t>(tick, 2999)].drive.wirePosition);
    ASSERT_EQ(frame.state, tick < 3000 ? DeviceState::Running : DeviceState::Ended);
  }
  // By time at another rate.
  for (std::uint64_t tick = 0; tick < 1500; ++tick)
  {
    device.Read(tick, 2 * Tick, frame);
    ASSERT_EQ(frame.input.drive.wirePosition, inputs[2 * tick].drive.wirePosition) << tick;
  }
}

namespace
{
DeviceScenario ScenarioOf(const std::string& device, const std::string& pieces = "")
{
  return DeviceScenarioFromText(R"({"format":"dynamiccoronary script","version":1,"pieces":[)" +
      pieces + R"(],"device":{)" + device + "}}",
    "'test'");
}

/// What a host sees of a scenario in its first 2 s.
struct Seen
{
  DecoderCounts counts;
  std::vector<StateMessage> states;
  bool wasUnplugged = false;
};

Seen Watch(const std::string& device, double seconds = 2.0)
{
  ScriptedDevice emulated(ScenarioOf(device));
  FrameSender host;
  FrameDecoder decoder;
  Seen seen;
  const auto say = [&](const Message& message, std::uint64_t now)
  {
    const WireFrame wire = host.Send(message, now);
    emulated.Device().Receive(wire.bytes.data(), wire.size, now);
  };
  say(Encode(HelloMessage{ 1, 1, 42, "test" }), 0);
  say(Encode(StartMessage{ 1000, 20, 42 }), 0);
  for (std::uint64_t now = 0; now < static_cast<std::uint64_t>(1e6 * seconds); now += 500)
  {
    emulated.Step(now);
    seen.wasUnplugged = seen.wasUnplugged || !emulated.IsPlugged();
    for (const std::uint8_t byte : emulated.TakeBytes())
    {
      StateMessage state;
      if (decoder.Push(byte) && Decode(decoder.Last(), state))
      {
        seen.states.push_back(state);
      }
    }
  }
  seen.counts = decoder.Counts();
  return seen;
}
}

TEST(Emulator, Faults)
{
  const Seen good = Watch("");
  EXPECT_EQ(good.states.size(), 2000U);
  EXPECT_EQ(good.counts.damaged + good.counts.lost + good.counts.repeated, 0U);
  const Seen dropped = Watch(R"("faults":[{"at":1,"kind":"drop_bytes","count":10}])");
  EXPECT_EQ(dropped.counts.damaged, 1U);
  EXPECT_EQ(dropped.counts.lost, 1U);
  const Seen flipped = Watch(R"("faults":[{"at":1,"kind":"flip_bits","count":20}])");
  EXPECT_EQ(flipped.counts.lost, 20U);
  EXPECT_GE(flipped.counts.damaged, 20U);
  const Seen twice = Watch(R"("faults":[{"at":1,"kind":"duplicate","count":20}])");
  EXPECT_EQ(twice.counts.repeated, 20U);
  EXPECT_EQ(twice.states.size(), 2000U);
  const Seen disordered = Watch(R"("faults":[{"at":1,"kind":"reorder","count":20}])");
  EXPECT_EQ(disordered.counts.lost, 20U);
  EXPECT_EQ(disordered.counts.repeated, 20U);
  const Seen garbage = Watch(R"("faults":[{"at":1,"kind":"garbage","count":5000}])");
  EXPECT_GE(garbage.counts.damaged, 5U);
  EXPECT_LE(garbage.counts.lost, 1U);
  const Seen stopped = Watch(R"("faults":[{"at":1,"kind":"stop","ms":100}])");
  EXPECT_EQ(stopped.counts.lost, 100U);
  const Seen closed = Watch(R"("faults":[{"at":1,"kind":"close","ms":100}])");
  EXPECT_TRUE(closed.wasUnplugged);
  EXPECT_NEAR(static_cast<double>(closed.states.size()), 1900.0, 1.0);
  const Seen slow = Watch(R"("faults":[{"at":1,"kind":"rate","count":100}])");
  EXPECT_NEAR(static_cast<double>(slow.states.size()), 1100.0, 2.0);
  const Seen jumped =
    Watch(R"("first_count":7,"faults":[{"at":1,"kind":"jump_counts","count":-1000}])");
  EXPECT_EQ(jumped.states.front().counts[0], 7);
  EXPECT_EQ(jumped.states.back().counts[0], -993);
}

TEST(Emulator, ScriptOfHands)
{
  const auto check = [](const DeviceScenario& scenario, unsigned pedalsAfter)
  {
    HandPlaces hands = scenario.At(0.5);
    EXPECT_DOUBLE_EQ(hands.places[static_cast<std::size_t>(AxisKind::WireAdvance)], 5.0);
    EXPECT_DOUBLE_EQ(hands.places[static_cast<std::size_t>(AxisKind::WireTurn)], M_PI / 2);
    EXPECT_EQ(hands.pedals, FluoroscopyPedal | MaskPedal);
    hands = scenario.At(5.5);
    EXPECT_DOUBLE_EQ(hands.places[static_cast<std::size_t>(AxisKind::WireAdvance)], 30.0);
    EXPECT_DOUBLE_EQ(hands.places[static_cast<std::size_t>(AxisKind::Syringe)], 5.0);
    EXPECT_DOUBLE_EQ(hands.places[static_cast<std::size_t>(AxisKind::CatheterAdvance)], 6.0);
    EXPECT_EQ(hands.pedals, pedalsAfter);
  };
  const std::string first =
    R"({"seconds":1,"wire_mm":10,"wire_deg":180,"pedals":["fluoroscopy","mask"]},)";
  const std::string last = R"({"seconds":0,"catheter_mm":3})";
  check(ScenarioOf(R"("repeat":true)", first + R"({"seconds":1,"inject_mL":2},)" + last),
    FluoroscopyPedal | MaskPedal);
  // The format that devices once had: pedals are up again after their piece, and the syringe has another name.
  check(DeviceScenarioFromText(
          R"({"format":"dynamiccoronary device scenario","version":1,"repeat":true,"pieces":[)" +
            first + R"({"seconds":1,"syringe_mL":2},)" + last + "]}",
          "'old'"),
    0U);
  EXPECT_EQ(DeviceScenarioFromText(
              R"({"format":"dynamiccoronary device scenario","version":1,"rate_hz":500})", "'old'")
              .device.rate,
    500);
  // The simulator drives by the same file.
  const DriveScript script =
    DriveScriptFromText(R"({"format":"dynamiccoronary script","version":1,"pieces":[)" + first +
        last + R"(],"device":{"faults":[{"at":1,"kind":"close","ms":0}]}})",
      "'both'");
  EXPECT_DOUBLE_EQ(script.At(2.0).drive.catheterPosition, 3.0);
}

TEST(Emulator, WrongScripts)
{
  ExpectRefusal([] { ScenarioOf("", R"({"seconds":-1})"); }, "'test', piece 1");
  ExpectRefusal([] { ScenarioOf("", R"({"seconds":1,"wire":1})"); }, "'wire'");
  ExpectRefusal([] { ScenarioOf("", R"({"seconds":1,"pedals":["brake"]})"); }, "'pedals'");
  ExpectRefusal([] { ScenarioOf("", R"({"seconds":1,"syringe_mL":1})"); }, "'syringe_mL'");
  ExpectRefusal(
    [] { ScenarioOf(R"("faults":[{"at":1,"kind":"fire"}])"); }, "no fault that is known");
  ExpectRefusal([] { ScenarioOf(R"("faults":[{"at":1,"kind":"stop"}])"); }, "'ms'");
  ExpectRefusal([] { ScenarioOf(R"("faults":[{"at":1,"kind":"rate","count":0}])"); }, "'count'");
  ExpectRefusal([] { ScenarioOf(R"("rate_hz":5000)"); }, "'rate_hz'");
  ExpectRefusal([] { ScenarioOf(R"("colour":"red")"); }, "'test', device has 'colour'");
  ExpectRefusal([]
    { DeviceScenarioFromText(R"({"format":"dynamiccoronary scenario","version":1})", "'test'"); },
    "is no script of driving");
}

TEST(KeyboardDevice, SpeedsAndSmoothness)
{
  KeyboardDevice keys;
  InputFrame frame;
  std::uint64_t tick = 0;
  double fastest = 0.0;
  double jerk = 0.0;
  double speed = 0.0;
  const auto run = [&](double seconds)
  {
    for (auto left = std::llround(seconds / Tick); left > 0; --left)
    {
      const double before = frame.input.drive.wirePosition;
      keys.Read(tick++, Tick, frame);
      const double now = (frame.input.drive.wirePosition - before) / Tick;
      jerk = std::max(jerk, std::abs(now - speed));
      speed = now;
      fastest = std::max(fastest, std::abs(speed));
    }
    return frame.input.drive.wirePosition;
  };
  EXPECT_EQ(run(0.1), 0.0);
  EXPECT_EQ(frame.state, DeviceState::Running);
  EXPECT_TRUE(keys.Press("Up"));
  EXPECT_FALSE(keys.Press("F12"));
  // Starting and stopping take the same time: 10 mm/s as long as the key is held.
  run(1.0);
  EXPECT_TRUE(keys.Release("Up"));
  EXPECT_NEAR(run(1.0), 10.0, 0.02);
  EXPECT_EQ(speed, 0.0);
  EXPECT_LE(fastest, 10.0 + 1e-9);
  EXPECT_LT(jerk, 0.1); // mm/s in a tick
  keys.Press("Shift_L");
  keys.Press("Down");
  run(1.0);
  EXPECT_NEAR(speed, -40.0, 1e-3);
  keys.Release("Shift_L");
  keys.Press("Control_R");
  run(1.0);
  EXPECT_NEAR(speed, -2.0, 1e-3);
  keys.Press("W");
  keys.Press("f");
  keys.Press("space");
  run(0.1);
  EXPECT_EQ(frame.input.pedals, static_cast<std::uint32_t>(FluoroscopyPedal));
  EXPECT_GT(frame.input.syringe, 0.1);
  EXPECT_GT(frame.input.drive.catheterPosition, 0.0);
  keys.ReleaseAll();
  run(1.0);
  EXPECT_EQ(frame.input.pedals, 0U);
  EXPECT_EQ(speed, 0.0);
}

TEST(KeyboardDevice, WrongSpeeds)
{
  HandSpeeds speeds;
  speeds.most[0] = -1.0;
  ExpectRefusal([&] { KeyboardDevice keys(speeds); }, "'wire_position'");
  speeds.most[0] = 1.0;
  speeds.settling = 0.0;
  ExpectRefusal([&] { KeyboardDevice keys(speeds); }, "'settling'");
}

TEST(HandAxes, OneTableForDevicesKeysScriptsAndRecordings)
{
  std::set<std::string> names;
  AxisPlaces places{};
  for (std::size_t n = 0; n < HandAxes; ++n)
  {
    const HandAxis& axis = HandAxisTable[n];
    EXPECT_EQ(static_cast<std::size_t>(axis.kind), n + 1)
      << "the protocol's numbers go with places";
    EXPECT_EQ(HandAxisOf(axis.kind), &axis);
    EXPECT_LT(axis.low, axis.high);
    EXPECT_GT(axis.fastest, axis.speed);
    for (const char* name : { axis.recorded, axis.scripted, axis.forward, axis.back })
    {
      EXPECT_TRUE(names.insert(name).second || axis.recorded == std::string(name)) << name;
    }
    places[n] = 1.0 + static_cast<double>(n);

    // Its keys move it and nothing else; so does a script.
    for (const bool forward : { true, false })
    {
      KeyboardDevice keys;
      InputFrame frame;
      keys.Read(0, Tick, frame);
      const AxisPlaces before = PlacesOf(frame.input);
      EXPECT_TRUE(keys.Press(forward ? axis.forward : axis.back));
      for (int k = 1; k < 2000; ++k)
      {
        keys.Read(k, Tick, frame);
      }
      const AxisPlaces after = PlacesOf(frame.input);
      for (std::size_t m = 0; m < HandAxes; ++m)
      {
        const double expected = m == n ? (forward ? axis.speed : -axis.speed) : 0.0;
        EXPECT_NEAR(after[m] - before[m], expected, 0.1 * axis.speed) << axis.recorded;
      }
    }
    const DriveScript script = DriveScriptFromText(
      R"({ "format": "dynamiccoronary script", "version": 1, "pieces": [ { "seconds": 1, ")" +
        std::string(axis.scripted) + R"(": 10 } ] })",
      "'script'");
    const AxisPlaces scripted = PlacesOf(script.At(1.0));
    const AxisPlaces start = PlacesOf(SessionInput());
    for (std::size_t m = 0; m < HandAxes; ++m)
    {
      EXPECT_NEAR(scripted[m] - start[m], m == n ? 10.0 * axis.scriptUnit : 0.0, 1e-12);
    }
  }
  EXPECT_EQ(HandAxisOf(AxisKind::None), nullptr);
  SessionInput input;
  SetPlaces(input, places);
  EXPECT_EQ(PlacesOf(input), places);
}

TEST(RingQueue, KeepsOrderAndRefusesWhenFull)
{
  RingQueue<std::string, 4> queue;
  std::string value;
  EXPECT_FALSE(queue.Pop(value));
  for (int round = 0; round < 3; ++round)
  {
    EXPECT_TRUE(queue.Push("a"));
    EXPECT_TRUE(queue.Push("b"));
    EXPECT_TRUE(queue.Push("c"));
    EXPECT_FALSE(queue.Push("d"));
    for (const char* wanted : { "a", "b", "c" })
    {
      EXPECT_TRUE(queue.Pop(value));
      EXPECT_EQ(value, wanted);
    }
    EXPECT_FALSE(queue.Pop(value));
  }
}

TEST(TripleBuffer, LatestWhole)
{
  TripleBuffer<int> buffer;
  int value = 5;
  EXPECT_FALSE(buffer.Read(value));
  EXPECT_EQ(value, 0);
  buffer.Write(1);
  buffer.Write(2);
  EXPECT_TRUE(buffer.Read(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(buffer.Read(value));
  EXPECT_EQ(value, 2);
}
}
