// Hardware on pseudo-terminals, in real time.
#include "DeviceMux.h"
#include "DeviceUri.h"
#include "KeyboardDevice.h"
#include "PseudoTerminal.h"
#include "ScriptedDevice.h"
#include "SerialDevice.h"
#include "SerialPort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace coronary;

namespace
{
using Clock = std::chrono::steady_clock;

std::uint64_t Microseconds()
{
  return static_cast<std::uint64_t>(
    std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count());
}

double SecondsSince(std::uint64_t start)
{
  return 1e-6 * static_cast<double>(Microseconds() - start);
}

/// The hardware in a thread, behind a name that stays when it is plugged in again.
class Hardware
{
public:
  explicit Hardware(const std::string& script = R"(,"pieces":[])")
    : Device(ScenarioOf(script))
    , Link(std::filesystem::temp_directory_path() /
        ("coronary-device-" + std::to_string(::getpid()) + "-" + std::to_string(++Count)))
    , Thread([this] { this->Run(); })
  {
    while (!this->Plugged)
    {
      std::this_thread::yield();
    }
  }

  ~Hardware()
  {
    this->Stopping = true;
    this->Thread.join();
    std::filesystem::remove(this->Link);
  }

  std::string Path() const { return this->Link.string(); }

  std::atomic<bool> pulled{ false };
  std::atomic<bool> byteByByte{ false };
  std::atomic<bool> relaxed{ true };
  std::atomic<double> motor{ 0.0 };
  std::atomic<std::uint64_t> relaxedAt{ 0 };
  std::atomic<std::uint64_t> looseAt{ 0 };

private:
  static DeviceScenario ScenarioOf(const std::string& members)
  {
    return DeviceScenarioFromText(
      R"({"format":"dynamiccoronary script","version":1)" + members + "}", "the test's script");
  }

  void Plug()
  {
    this->Line = std::make_unique<PseudoTerminal>();
    std::filesystem::remove(this->Link);
    std::filesystem::create_symlink(this->Line->Name(), this->Link);
    this->Plugged = true;
  }

  void Run()
  {
    while (!this->Stopping)
    {
      const bool wanted = !this->pulled && this->Device.IsPlugged();
      if (wanted && !this->Line)
      {
        this->Plug();
      }
      else if (!wanted && this->Line)
      {
        this->Line.reset();
        std::filesystem::remove(this->Link);
      }
      this->Step();
    }
  }

  void Step()
  {
    std::array<std::uint8_t, 4096> bytes{};
    const std::size_t size = this->Line ? this->Line->Read(bytes.data(), bytes.size()) : 0;
    const std::uint64_t now = Microseconds();
    EmulatedDevice& device = this->Device.Device();
    device.Receive(bytes.data(), size, now);
    this->Device.Step(now);
    if (device.Relaxed() && !this->relaxed)
    {
      this->relaxedAt = now;
    }
    if (device.Motors()[0] == 0.0 && this->motor != 0.0)
    {
      this->looseAt = now;
    }
    this->relaxed = device.Relaxed();
    this->motor = device.Motors()[0];
    const std::vector<std::uint8_t> out = this->Device.TakeBytes();
    if (!this->Line)
    {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      return;
    }
    if (this->byteByByte)
    {
      for (const std::uint8_t byte : out)
      {
        this->Line->Write({ byte });
      }
    }
    else
    {
      this->Line->Write(out);
    }
    this->Line->Wait(200);
  }

  static inline std::atomic<int> Count{ 0 };

  ScriptedDevice Device;
  std::filesystem::path Link;
  std::unique_ptr<PseudoTerminal> Line;
  std::atomic<bool> Plugged{ false };
  std::atomic<bool> Stopping{ false };
  std::thread Thread;
};

/// The physics' loop: about 2 kHz, in the thread of the test.
class Loop
{
public:
  explicit Loop(std::shared_ptr<SerialDevice> serial)
    : device(std::move(serial))
  {
    this->mux.Add(this->device);
    this->mux.Add(std::make_shared<KeyboardDevice>());
  }

  void Step()
  {
    constexpr double Tick = 0.0005;
    const std::uint64_t now = Microseconds();
    if (this->Start == 0)
    {
      this->Start = now;
    }
    // Catches up a few ticks, as the simulator does.
    const auto due = static_cast<std::uint64_t>(SecondsSince(this->Start) / Tick);
    for (int n = 0; this->tick < due && n < 8; ++n)
    {
      const double before = this->input.drive.wirePosition;
      this->input = this->mux.Next(this->tick, Tick);
      this->maximumStep =
        std::max(this->maximumStep, std::abs(this->input.drive.wirePosition - before));
      ++this->tick;
    }
    if (this->tick < due)
    {
      this->Start = now - static_cast<std::uint64_t>(1e6 * Tick * static_cast<double>(this->tick));
    }
    if (this->beats)
    {
      this->force.tick = this->tick;
      this->mux.Command(this->force);
      this->mux.Heartbeat(this->tick);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }

  /// @return s until it is so, or `most`
  double Until(const std::function<bool()>& condition, double most = 10.0)
  {
    const std::uint64_t start = Microseconds();
    while (!condition() && SecondsSince(start) < most)
    {
      this->Step();
    }
    return SecondsSince(start);
  }

  /// Until the motors do it. A machine that is busy for 20 ms relaxes them: then they are armed anew.
  double UntilArmed(const std::function<bool()>& condition, double most = 10.0)
  {
    return this->Until(
      [&]
      {
        if (this->device->Status().awaitsForces)
        {
          this->device->ConfirmForces();
        }
        return condition();
      },
      most);
  }

  void Run(double seconds)
  {
    this->Until([] { return false; }, seconds);
  }

  bool Reaches(DeviceState state, double most = 10.0)
  {
    const auto reached = [&] { return this->device->Status().state == state; };
    this->Until(reached, most);
    return reached();
  }

  std::shared_ptr<SerialDevice> device;
  DeviceMux mux;
  SessionInput input;
  ForceFrame force;
  bool beats = true;
  double maximumStep = 0.0;
  std::uint64_t tick = 0;

private:
  std::uint64_t Start = 0;
};

bool Contains(const std::string& text, const std::string& part)
{
  return text.find(part) != std::string::npos;
}
}

TEST(SerialPort, SuddenCloseIsTold)
{
  auto line = std::make_unique<PseudoTerminal>();
  SerialPort port(line->Name());
  std::string why;
  ASSERT_EQ(port.Open(why), PortOpening::Open) << why;
  std::array<std::uint8_t, 8> bytes{};
  EXPECT_EQ(port.Read(bytes.data(), bytes.size()), 0);
  line->Write(
    { 1, 2, 0, 10, 13, 17, 19, 255 }); // raw: nothing of it means anything to the terminal
  port.Wait(1000000);
  EXPECT_EQ(port.Read(bytes.data(), bytes.size()), 8);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 8>{ 1, 2, 0, 10, 13, 17, 19, 255 }));
  line.reset();
  EXPECT_EQ(port.Read(bytes.data(), bytes.size()), -1);
  EXPECT_EQ(port.Write(bytes.data(), bytes.size()), -1);
}

TEST(SerialPort, WhatIsNoDevice)
{
  std::string why;
  EXPECT_EQ(SerialPort("/nowhere/tty").Open(why), PortOpening::Missing);
  EXPECT_TRUE(Contains(why, "/nowhere/tty"));
  EXPECT_EQ(SerialPort("/dev/null").Open(why), PortOpening::Denied);
  EXPECT_TRUE(Contains(why, "no serial port"));
  const std::string locked =
    (std::filesystem::temp_directory_path() / ("coronary-locked-" + std::to_string(::getpid())))
      .string();
  std::ofstream(locked).put('x');
  std::filesystem::permissions(locked, std::filesystem::perms::none);
  if (::geteuid() != 0) // whom nothing is forbidden
  {
    EXPECT_EQ(SerialPort(locked).Open(why), PortOpening::Denied);
    EXPECT_TRUE(Contains(why, "dialout"));
  }
  std::filesystem::remove(locked);
}

TEST(SerialDevice, NoSuchDevice)
{
  const std::shared_ptr<Device> device = OpenDevice("serial:/nowhere/ttyACM0");
  const DeviceStatus status = WaitWhileConnecting(*device, 5.0);
  EXPECT_EQ(status.state, DeviceState::Disconnected);
  EXPECT_TRUE(Contains(status.text, "no device at '/nowhere/ttyACM0'"));
}

TEST(SerialDevice, WrongDevice)
{
  PseudoTerminal nobody;
  const std::shared_ptr<Device> device = OpenDevice("serial:" + nobody.Name());
  const DeviceStatus status = WaitWhileConnecting(*device, 5.0);
  EXPECT_EQ(status.state, DeviceState::Refused);
  EXPECT_TRUE(Contains(status.text, "does not answer"));
}

TEST(SerialDevice, DrivesByteByByteWithJunk)
{
  Hardware hardware(R"(,"pieces":[{"seconds":0.3},{"seconds":1,"wire_mm":20,"pedals":["cine"]}],
    "device":{"faults":[{"at":0.2,"kind":"garbage","count":300},{"at":0.4,"kind":"duplicate","count":5},
              {"at":0.6,"kind":"reorder","count":3}]})");
  hardware.byteByByte = true;
  Loop loop(std::make_shared<SerialDevice>(hardware.Path()));
  ASSERT_TRUE(loop.Reaches(DeviceState::Running));
  loop.Until([&] { return loop.input.pedals == CinePedal; });
  loop.Until([&] { return loop.input.drive.wirePosition >= 19.99; }, 2.0);
  loop.Run(0.2);
  EXPECT_NEAR(loop.input.drive.wirePosition, 20.0, 0.01);
  EXPECT_EQ(loop.input.pedals, 0U);
}

TEST(SerialDevice, PulledOutAndBack)
{
  Hardware hardware(
    R"(,"device":{"repeat":true},"pieces":[{"seconds":1,"wire_mm":20,"inject_mL":1,"pedals":["fluoroscopy"]}])");
  Loop loop(std::make_shared<SerialDevice>(hardware.Path()));
  loop.force.wireForce = -1.0;
  ASSERT_TRUE(loop.Reaches(DeviceState::Running));
  loop.UntilArmed([&] { return loop.input.drive.wirePosition > 5.0 && hardware.motor == -1.0; });
  EXPECT_EQ(hardware.motor, -1.0);
  hardware.pulled = true;
  const double released = loop.Until([&] { return loop.input.pedals == 0; });
  EXPECT_LT(released, 0.2);
  const SessionInput held = loop.input;
  loop.Run(0.5);
  EXPECT_EQ(loop.input.drive.wirePosition, held.drive.wirePosition);
  EXPECT_EQ(loop.input.syringe, held.syringe);
  EXPECT_TRUE(Contains(loop.device->Status().text, hardware.Path()));
  loop.maximumStep = 0.0;
  hardware.pulled = false;
  ASSERT_TRUE(loop.Reaches(DeviceState::Running));
  loop.Until([&] { return loop.input.drive.wirePosition > held.drive.wirePosition + 5.0; }, 5.0);
  EXPECT_LT(loop.maximumStep, 0.5); // mm in a tick; the hands had moved by 10 and more
  EXPECT_TRUE(loop.device->Status().awaitsForces);
  EXPECT_EQ(hardware.motor, 0.0);
}

TEST(SerialDevice, WatchdogsInRealTime)
{
  Hardware hardware;
  Loop loop(std::make_shared<SerialDevice>(hardware.Path()));
  loop.force.wireForce = 1.0;
  ASSERT_TRUE(loop.Reaches(DeviceState::Running));
  std::vector<double> relaxed;
  std::vector<double> loose;
  for (int round = 0; round < 5; ++round)
  {
    loop.beats = true;
    loop.Run(0.1);
    loop.UntilArmed([&] { return hardware.motor == 1.0 && !hardware.relaxed; });
    loop.beats = false;
    const std::uint64_t quiet = Microseconds();
    loop.Until([&] { return hardware.relaxed && hardware.motor == 0.0; }, 1.0);
    relaxed.push_back(1e-6 * static_cast<double>(hardware.relaxedAt - quiet));
    loose.push_back(1e-6 * static_cast<double>(hardware.looseAt - quiet));
  }
  std::sort(relaxed.begin(), relaxed.end());
  std::sort(loose.begin(), loose.end());
  std::printf("relaxes after %.1f to %.1f ms, loose after %.1f to %.1f ms\n", 1e3 * relaxed.front(),
    1e3 * relaxed.back(), 1e3 * loose.front(), 1e3 * loose.back());
  EXPECT_GE(relaxed.front(), 0.015);
  EXPECT_LE(relaxed.back(), 0.025);
  EXPECT_LE(loose.back(), 0.075);
}

namespace
{
/// s from the hand to the simulator, sorted, of 10 s.
std::vector<double> Latencies(Loop& loop)
{
  std::vector<double> latencies;
  std::uint64_t last = 0;
  const std::uint64_t first = loop.device->States();
  const std::uint64_t start = Microseconds();
  while (SecondsSince(start) < 10.0)
  {
    loop.Step();
    const std::uint64_t taken = loop.device->TakenAt();
    if (taken != 0 && taken != last)
    {
      last = taken;
      const auto late = static_cast<std::int64_t>(loop.device->ArrivedAt() - taken);
      latencies.push_back(1e-6 * static_cast<double>(late));
    }
  }
  std::sort(latencies.begin(), latencies.end());
  std::printf(
    "%.0f states/s", static_cast<double>(loop.device->States() - first) / SecondsSince(start));
  return latencies;
}
}

TEST(SerialDevice, AThousandStatesASecond)
{
  Hardware hardware;
  Loop loop(std::make_shared<SerialDevice>(hardware.Path()));
  ASSERT_TRUE(loop.Reaches(DeviceState::Running));
  loop.Run(0.5); // the clocks come to know each other
  const std::vector<double> latencies = Latencies(loop);
  ASSERT_GT(latencies.size(), 100U);
  const double p99 = latencies[latencies.size() * 99 / 100];
  std::printf(", from hand to simulator: median %.3f ms, 99 %% %.3f ms, most %.3f ms\n",
    1e3 * latencies[latencies.size() / 2], 1e3 * p99, 1e3 * latencies.back());
  EXPECT_LT(p99, 0.002);
  EXPECT_EQ(loop.device->Status().glitches, 0U);
}

namespace
{
/// The emulator as a process of its own.
class EmulatorProcess
{
public:
  explicit EmulatorProcess(const std::vector<std::string>& arguments)
  {
    std::vector<char*> words;
    this->Arguments = arguments;
    this->Arguments.insert(this->Arguments.begin(), DYNAMICCORONARY_DEVICE_EMULATOR);
    for (std::string& argument : this->Arguments)
    {
      words.push_back(&argument[0]);
    }
    words.push_back(nullptr);
    this->Process = ::fork();
    if (this->Process == 0)
    {
      ::execv(words[0], words.data());
      ::_exit(127);
    }
  }
  ~EmulatorProcess()
  {
    if (this->Process > 0)
    {
      ::kill(this->Process, SIGKILL);
      this->Wait();
    }
  }

  void End() { ::kill(this->Process, SIGTERM); }

  int Wait()
  {
    int status = 0;
    ::waitpid(this->Process, &status, 0);
    this->Process = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

private:
  std::vector<std::string> Arguments;
  pid_t Process = -1;
};

std::string TextOf(const std::filesystem::path& path)
{
  std::ifstream stream(path);
  return { std::istreambuf_iterator<char>(stream), {} };
}
}

TEST(Emulator, AsAProgram)
{
  const std::filesystem::path folder =
    std::filesystem::temp_directory_path() / ("coronary-emulator-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path link = folder / "device";
  std::ofstream(folder / "scenario.json") << R"({"format":"dynamiccoronary script","version":1,
    "pieces":[{"seconds":1.0},{"seconds":4.0,"wire_mm":40}],
    "device":{"faults":[{"at":6.0,"kind":"close","ms":300}]}})";
  EmulatorProcess emulator({ "--quiet", "--scenario", (folder / "scenario.json").string(), "--link",
    link.string(), "--log", (folder / "log").string() });
  {
    Loop loop(std::make_shared<SerialDevice>(link.string()));
    ASSERT_TRUE(loop.Reaches(DeviceState::Running));
    // What is moved while a busy machine keeps the host from listening does not count, and it may
    // have to connect anew.
    loop.Until([&] { return loop.input.drive.wirePosition > 5.0; }, 8.0);
    EXPECT_TRUE(loop.Reaches(DeviceState::Disconnected, 8.0));
    const double reached = loop.input.drive.wirePosition;
    EXPECT_GT(reached, 5.0);
    EXPECT_LT(reached, 40.01);
    EXPECT_TRUE(loop.Reaches(DeviceState::Running, 8.0));
    EXPECT_NEAR(loop.input.drive.wirePosition, reached, 0.01);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200)); // it hears STOP
  emulator.End();
  EXPECT_EQ(emulator.Wait(), 128 + SIGTERM);
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(link)));
  const std::string log = TextOf(folder / "log");
  EXPECT_TRUE(Contains(log, R"("type":"HELLO")"));
  EXPECT_TRUE(Contains(log, R"("type":"FORCE")"));
  EXPECT_TRUE(Contains(log, R"("type":"STOP")"));
  EXPECT_TRUE(Contains(log, R"("type":"motors armed")"));
  std::filesystem::remove_all(folder);
}

TEST(Emulator, WrongUse)
{
  EXPECT_EQ(EmulatorProcess({ "--nonsense" }).Wait(), 2);
  EXPECT_EQ(EmulatorProcess({ "--duration", "-1" }).Wait(), 2);
  EXPECT_EQ(EmulatorProcess({ "--scenario", "/nowhere.json" }).Wait(), 1);
  EXPECT_EQ(EmulatorProcess({ "--link", "/dev/null" }).Wait(), 1);
  EXPECT_EQ(EmulatorProcess({ "--quiet", "--duration", "0.1" }).Wait(), 0);
}
