/**
 * coronary-device-emulator: a device for the simulator that is all software, on a pseudo-terminal.
 *
 * Exit codes are those of Program.h; done is, when its time is over, or its scenario unplugged it.
 */
#include "DeviceLog.h"
#include "Interruption.h"
#include "OptionChecks.h"
#include "Program.h"
#include "PseudoTerminal.h"
#include "ScriptedDevice.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace
{
constexpr std::uint64_t Pause = 250; // microseconds

struct Request
{
  std::string scenario;
  std::string link;
  std::string log;
  double duration = 0.0;
  bool quiet = false;
};

/// A name that stays while the pseudo-terminal behind it changes.
class Link
{
public:
  explicit Link(std::string path)
    : Path(std::move(path))
  {
    const std::filesystem::file_status status = std::filesystem::symlink_status(this->Path);
    if (!this->Path.empty() && std::filesystem::exists(status) &&
      !std::filesystem::is_symlink(status))
    {
      throw std::runtime_error("'" + this->Path + "' is there, and no link.");
    }
  }
  ~Link() { this->Remove(); }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  void PointTo(const std::string& target)
  {
    if (this->Path.empty())
    {
      return;
    }
    this->Remove();
    std::error_code error;
    std::filesystem::create_symlink(target, this->Path, error);
    if (error)
    {
      throw std::runtime_error(
        "Cannot make the link '" + this->Path + "': " + error.message() + ".");
    }
  }

  void Remove()
  {
    std::error_code ignored;
    if (!this->Path.empty() && std::filesystem::is_symlink(this->Path, ignored))
    {
      std::filesystem::remove(this->Path, ignored);
    }
  }

private:
  std::string Path;
};

class Emulator
{
public:
  explicit Emulator(const Request& request)
    : Wanted(request)
    , Device(request.scenario.empty() ? coronary::DeviceScenario{}
                                      : coronary::ReadDeviceScenario(request.scenario))
    , Name(request.link)
  {
    if (!request.log.empty())
    {
      this->Log = std::make_unique<coronary::DeviceLog>(request.log);
      this->Device.Device().OnMessage = [this](const coronary::Message& message, std::uint64_t now)
      { this->Log->Received(message, 1e-6 * static_cast<double>(now)); };
    }
  }

  void Run()
  {
    this->Plug();
    const auto start = std::chrono::steady_clock::now();
    double seconds = 0.0;
    while (coronary::Interruption() == 0 && !this->Device.IsGone() &&
      (this->Wanted.duration == 0.0 || seconds < this->Wanted.duration))
    {
      const auto elapsed = std::chrono::steady_clock::now() - start;
      seconds = std::chrono::duration<double>(elapsed).count();
      this->Step(static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(elapsed).count()));
    }
    if (this->Log)
    {
      this->Log->Finish();
    }
  }

private:
  void Plug()
  {
    this->Line = std::make_unique<coronary::PseudoTerminal>();
    this->Name.PointTo(this->Line->Name());
    if (!this->Wanted.quiet)
    {
      std::printf("serial:%s\n", this->Line->Name().c_str());
      std::fflush(stdout);
    }
  }

  void Step(std::uint64_t now)
  {
    if (this->Line)
    {
      std::array<std::uint8_t, 4096> bytes{};
      const std::size_t size = this->Line->Read(bytes.data(), bytes.size());
      this->Device.Device().Receive(bytes.data(), size, now);
    }
    this->Device.Step(now);
    const std::vector<std::uint8_t> bytes = this->Device.TakeBytes();
    if (!this->Device.IsPlugged() || this->Device.IsGone())
    {
      this->Line.reset();
      this->Name.Remove();
    }
    else if (!this->Line)
    {
      this->Plug();
    }
    this->LogMotors(now);
    if (!this->Line)
    {
      std::this_thread::sleep_for(std::chrono::microseconds(Pause));
      return;
    }
    this->Line->Write(bytes);
    this->Line->Wait(Pause);
  }

  void LogMotors(std::uint64_t now)
  {
    const bool relaxed = this->Device.Device().Relaxed();
    if (this->Log && relaxed != this->WasRelaxed)
    {
      this->Log->Relaxed(relaxed, 1e-6 * static_cast<double>(now));
    }
    this->WasRelaxed = relaxed;
  }

  const Request& Wanted;
  coronary::ScriptedDevice Device;
  Link Name;
  std::unique_ptr<coronary::DeviceLog> Log;
  std::unique_ptr<coronary::PseudoTerminal> Line;
  bool WasRelaxed = true;
};

}

int main(int argc, char** argv)
{
  CLI::App program("A device for the simulator that is all software.", "coronary-device-emulator");
  program.set_version_flag("--version", "coronary-device-emulator " DYNAMICCORONARY_VERSION);
  Request request;
  program.add_option("--scenario", request.scenario, "What the hands do and what goes wrong, JSON")
    ->type_name("FILE");
  program.add_option("--link", request.link, "Name to make for the pseudo-terminal")
    ->type_name("PATH");
  program.add_option("--log", request.log, "What the device is told, JSON, a line each")
    ->type_name("FILE");
  program.add_option("--duration", request.duration, "Time to run, s; 0: until it is ended")
    ->check(coronary::Within(0.0, 1e6))
    ->type_name("S")
    ->capture_default_str();
  program.add_flag("--quiet", request.quiet, "Do not print the name of the pseudo-terminal");
  const int exitCode = coronary::RunProgram(program, argc, argv, [&] { Emulator(request).Run(); });
  const int signal = coronary::Interruption();
  return exitCode == 0 && signal != 0 ? 128 + signal : exitCode;
}
