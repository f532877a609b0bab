/**
 * @file VirtualPort.h
 * @brief A serial device and the emulated hardware on one clock that only the test moves.
 */
#ifndef DynamicCoronary_VirtualPort_h
#define DynamicCoronary_VirtualPort_h

#include "DevicePort.h"
#include "EmulatedDevice.h"
#include "SerialDevice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

/// The hardware and its cable.
struct VirtualLine
{
  explicit VirtualLine(const coronary::EmulatedDeviceSettings& settings = {})
    : device(settings)
  {
  }

  coronary::EmulatedDevice device;
  std::uint64_t now = 1000000; ///< microseconds
  coronary::PortOpening opening = coronary::PortOpening::Open;
  bool gone = false;       ///< reads and writes fail
  bool silent = false;     ///< nothing comes from the device
  bool deaf = false;       ///< nothing reaches the device
  std::size_t most = 4096; ///< bytes that one reading gets
  bool open = false;
  int openings = 0;
  std::vector<std::uint8_t> toHost;
  /// May change the frames of the device on their way.
  std::function<void(std::vector<coronary::WireFrame>&)> disturb;

  void StepDevice()
  {
    this->device.Step(this->now);
    std::vector<coronary::WireFrame> frames = this->device.TakeFrames();
    if (this->disturb)
    {
      this->disturb(frames);
    }
    for (const coronary::WireFrame& frame : frames)
    {
      if (!this->silent && this->open)
      {
        this->toHost.insert(this->toHost.end(), frame.bytes.begin(),
          frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.size));
      }
    }
  }
};

class VirtualPort : public coronary::DevicePort
{
public:
  explicit VirtualPort(VirtualLine& line)
    : Line(line)
  {
  }

  const std::string& Name() const override { return this->Path; }

  coronary::PortOpening Open(std::string& why) override
  {
    ++this->Line.openings;
    why = "cannot";
    this->Line.open = this->Line.opening == coronary::PortOpening::Open;
    this->Line.toHost.clear();
    return this->Line.opening;
  }

  void Close() override { this->Line.open = false; }

  int Read(std::uint8_t* bytes, std::size_t most) override
  {
    if (this->Line.gone)
    {
      return -1;
    }
    std::vector<std::uint8_t>& from = this->Line.toHost;
    const std::size_t size = std::min({ most, from.size(), this->Line.most });
    std::copy_n(from.begin(), size, bytes);
    from.erase(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(size));
    return static_cast<int>(size);
  }

  int Write(const std::uint8_t* bytes, std::size_t size) override
  {
    if (this->Line.gone)
    {
      return -1;
    }
    if (!this->Line.deaf)
    {
      this->Line.device.Receive(bytes, size, this->Line.now);
    }
    return static_cast<int>(size);
  }

  void Wait(std::uint64_t /*microseconds*/) override {}

private:
  VirtualLine& Line;
  std::string Path = "virtual";
};

/// Physics at 2 kHz, the thread of the device and the hardware, by turns.
struct VirtualBench
{
  static constexpr std::uint64_t Period = 500; ///< microseconds

  explicit VirtualBench(const coronary::EmulatedDeviceSettings& settings = {})
    : line(settings)
    , serial(std::make_unique<VirtualPort>(line), [this] { return this->line.now; })
  {
  }

  VirtualLine line;
  coronary::SerialDevice serial;
  coronary::InputFrame frame;
  std::uint64_t tick = 0;
  bool alive = true;   ///< the physics runs
  bool ioAlive = true; ///< the thread of the device runs
  bool commands = false;
  coronary::ForceFrame force;
  double maximumStep = 0.0; ///< mm or radians of the wire in one tick
  std::function<void()> atTick;

  void Step()
  {
    this->line.now += Period;
    if (this->atTick)
    {
      this->atTick();
    }
    this->line.StepDevice();
    if (this->ioAlive)
    {
      this->serial.Step();
    }
    if (!this->alive)
    {
      return;
    }
    const coronary::DriveInput before = this->frame.input.drive;
    this->serial.Read(this->tick, 1e-6 * Period, this->frame);
    this->maximumStep = std::max(
      { this->maximumStep, std::abs(this->frame.input.drive.wirePosition - before.wirePosition),
        std::abs(this->frame.input.drive.wireAngle - before.wireAngle) });
    if (this->commands)
    {
      this->force.tick = this->tick;
      this->serial.Command(this->force);
    }
    this->serial.Heartbeat(this->tick);
    ++this->tick;
  }

  void Run(double seconds)
  {
    for (auto left = std::llround(1e6 * seconds / Period); left > 0; --left)
    {
      this->Step();
    }
  }

  /// @return s until it is so; `most` when it does not come to be
  double Until(const std::function<bool()>& condition, double most = 20.0)
  {
    const std::uint64_t start = this->line.now;
    while (!condition() && this->line.now - start < static_cast<std::uint64_t>(1e6 * most))
    {
      this->Step();
    }
    return 1e-6 * static_cast<double>(this->line.now - start);
  }

  double& Place(coronary::AxisKind kind)
  {
    return this->line.device.Hands().places[static_cast<std::size_t>(kind)];
  }

  coronary::DeviceState State() const { return this->frame.state; }
};

#endif
