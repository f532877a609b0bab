#include "GamepadDevice.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <linux/input.h>
#include <poll.h>
#include <stdexcept>
#include <unistd.h>
#include <utility>

#ifdef DYNAMICCORONARY_WITH_EVDEV
#include <libevdev/libevdev.h>
#endif

namespace coronary
{
namespace
{
constexpr double PedalDown = 0.5; // of the trigger
constexpr double PedalUp = 0.4;

bool Holds(const GamepadState& state, GamepadButton button)
{
  return (state.buttons & button) != 0;
}

std::uint32_t ButtonOf(std::uint16_t code)
{
  switch (code)
  {
    case BTN_SOUTH:
      return SouthButton;
    case BTN_EAST:
      return EastButton;
    case BTN_NORTH:
      return NorthButton;
    case BTN_WEST:
      return WestButton;
    case BTN_TL:
      return LeftShoulder;
    case BTN_TR:
      return RightShoulder;
    case BTN_SELECT:
      return SelectButton;
    default:
      return 0;
  }
}
}

double GamepadResponse(double deflection)
{
  const double size = std::min(1.0, std::abs(deflection));
  if (!(size > GamepadDeadZone))
  {
    return 0.0;
  }
  const double share = (size - GamepadDeadZone) / (1.0 - GamepadDeadZone);
  return std::copysign(share * share, deflection);
}

HandWishes GamepadWishes(const GamepadState& state, const HandSpeeds& speeds)
{
  HandWishes wishes;
  wishes[AxisKind::WireAdvance] = GamepadResponse(state.leftY);
  wishes[AxisKind::WireTurn] = GamepadResponse(state.leftX);
  wishes[AxisKind::CatheterAdvance] = GamepadResponse(state.rightY);
  wishes[AxisKind::CatheterTurn] = GamepadResponse(state.rightX);
  wishes[AxisKind::Syringe] =
    GamepadResponse(state.rightTrigger) - (Holds(state, SelectButton) ? 1.0 : 0.0);
  if (Holds(state, LeftShoulder))
  {
    wishes.pace = speeds.fine;
  }
  else if (Holds(state, RightShoulder))
  {
    wishes.pace = speeds.fast;
  }
  if (Holds(state, NorthButton))
  {
    wishes[AxisKind::TableLeft] = state.padX;
    wishes[AxisKind::TableHead] = state.padY;
  }
  else if (Holds(state, WestButton))
  {
    wishes[AxisKind::SourceToDetector] = state.padY;
  }
  else
  {
    wishes[AxisKind::Primary] = state.padX;
    wishes[AxisKind::Secondary] = state.padY;
  }
  return wishes;
}

std::uint32_t GamepadPedals(const GamepadState& state, std::uint32_t before)
{
  const double threshold = (before & FluoroscopyPedal) != 0 ? PedalUp : PedalDown;
  return (state.leftTrigger > threshold ? FluoroscopyPedal : 0U) |
    (Holds(state, SouthButton) ? CinePedal : 0U) | (Holds(state, EastButton) ? MaskPedal : 0U);
}

GamepadDecoder::GamepadDecoder()
{
  for (const std::uint16_t trigger : { ABS_Z, ABS_RZ, ABS_GAS, ABS_BRAKE })
  {
    this->SetRange(trigger, 0, 255);
  }
  this->SetRange(ABS_HAT0X, -1, 1);
  this->SetRange(ABS_HAT0Y, -1, 1);
}

void GamepadDecoder::SetRange(std::uint16_t axis, std::int32_t low, std::int32_t high)
{
  if (axis < Axes && low < high)
  {
    this->Ranges[axis] = { low, high };
  }
}

/// 0 to 1.
double GamepadDecoder::Scaled(std::uint16_t axis, std::int32_t value) const
{
  const Range& range = this->Ranges[axis];
  const double low = range.low;
  const double high = range.high;
  return std::clamp((value - low) / (high - low), 0.0, 1.0);
}

void GamepadDecoder::FeedAxis(std::uint16_t axis, std::int32_t value)
{
  if (axis >= Axes)
  {
    return;
  }
  GamepadState& state = this->Growing;
  const double share = this->Scaled(axis, value);
  const double centred = 2.0 * share - 1.0;
  switch (axis)
  {
    case ABS_X:
      state.leftX = centred;
      break;
    case ABS_Y: // down is positive
      state.leftY = -centred;
      break;
    case ABS_RX:
      state.rightX = centred;
      break;
    case ABS_RY:
      state.rightY = -centred;
      break;
    case ABS_Z:
    case ABS_BRAKE:
      state.leftTrigger = share;
      break;
    case ABS_RZ:
    case ABS_GAS:
      state.rightTrigger = share;
      break;
    case ABS_HAT0X:
      state.padX = centred;
      break;
    case ABS_HAT0Y:
      state.padY = -centred;
      break;
    default:
      break;
  }
}

bool GamepadDecoder::Feed(std::uint16_t type, std::uint16_t code, std::int32_t value)
{
  if (type == EV_SYN && code == SYN_DROPPED)
  {
    // Events were lost: nothing is held until it is told again.
    this->Dropping = true;
    this->Growing = {};
    return false;
  }
  if (type == EV_SYN && code == SYN_REPORT)
  {
    this->Dropping = false;
    this->Reported = this->Growing;
    this->Reported.there = true;
    return true;
  }
  if (this->Dropping)
  {
    return false;
  }
  if (type == EV_ABS)
  {
    this->FeedAxis(code, value);
  }
  else if (type == EV_KEY)
  {
    const std::uint32_t button = ButtonOf(code);
    std::uint32_t& held = this->Growing.buttons;
    held = value != 0 ? held | button : held & ~button;
  }
  return false;
}

GamepadDevice::GamepadDevice(const std::string& path, const HandSpeeds& speeds)
  : Path(path)
  , Hands(speeds)
{
#ifdef DYNAMICCORONARY_WITH_EVDEV
  this->Tell(DeviceState::Connecting, "A game controller is looked for.");
  this->Thread = std::thread([this] { this->WatchController(); });
#else
  throw std::runtime_error("This build has no game controllers: libevdev was not there.");
#endif
}

GamepadDevice::GamepadDevice(int file, const HandSpeeds& speeds)
  : Hands(speeds)
{
  this->Tell(DeviceState::Running, "Recorded events of a game controller drive.");
  this->Thread = std::thread(
    [this, file]
    {
      this->ReadEvents(file);
      ::close(file);
    });
}

GamepadDevice::~GamepadDevice()
{
  this->Stopping = true;
  if (this->Thread.joinable())
  {
    this->Thread.join();
  }
}

void GamepadDevice::Tell(DeviceState state, const std::string& text)
{
  const std::lock_guard<std::mutex> lock(this->StatusMutex);
  this->LastStatus.state = state;
  this->LastStatus.text = text;
}

DeviceStatus GamepadDevice::Status() const
{
  const std::lock_guard<std::mutex> lock(this->StatusMutex);
  return this->LastStatus;
}

void GamepadDevice::Pause(int milliseconds)
{
  constexpr int Slice = 20;
  for (int waited = 0; waited < milliseconds && !this->Stopping; waited += Slice)
  {
    std::this_thread::sleep_for(std::chrono::milliseconds(Slice));
  }
}

void GamepadDevice::ReadEvents(int file)
{
  std::array<unsigned char, sizeof(input_event) * 64> bytes{};
  std::size_t size = 0;
  this->Latest.Write(GamepadState{ {}, {}, {}, {}, {}, {}, {}, {}, 0, true });
  while (!this->Stopping)
  {
    pollfd wanted{ file, POLLIN, 0 };
    if (::poll(&wanted, 1, 20) <= 0)
    {
      continue;
    }
    const ssize_t got = ::read(file, bytes.data() + size, bytes.size() - size);
    if (got < 0 && (errno == EINTR || errno == EAGAIN))
    {
      continue;
    }
    if (got <= 0)
    {
      break;
    }
    size += static_cast<std::size_t>(got);
    std::size_t at = 0;
    for (; size - at >= sizeof(input_event); at += sizeof(input_event))
    {
      input_event event{};
      std::memcpy(&event, bytes.data() + at, sizeof(event));
      if (this->Decoder.Feed(event.type, event.code, event.value))
      {
        this->Latest.Write(this->Decoder.State());
      }
    }
    std::memmove(bytes.data(), bytes.data() + at, size - at);
    size -= at;
  }
  this->Latest.Write({});
  this->Tell(DeviceState::Disconnected, "The game controller is gone.");
}

void GamepadDevice::Read(std::uint64_t /*tick*/, double secondsPerTick, InputFrame& frame)
{
  this->Latest.Read(this->State);
  this->WasThere = this->WasThere || this->State.there;
  frame = {};
  frame.axes = AllAxes;
  if (this->State.there)
  {
    this->Hands.Advance(GamepadWishes(this->State, this->Hands.Speeds()), secondsPerTick);
    this->Pedals = GamepadPedals(this->State, this->Pedals);
    frame.state = DeviceState::Running;
  }
  else
  {
    this->Hands.Stop();
    this->Pedals = 0;
    frame.state = this->WasThere ? DeviceState::Disconnected : DeviceState::Connecting;
  }
  frame.input = this->Hands.Place();
  frame.input.pedals = this->Pedals;
  frame.buttons = this->State.buttons;
}

#ifdef DYNAMICCORONARY_WITH_EVDEV
namespace
{
struct FreeEvdev
{
  void operator()(libevdev* device) const { libevdev_free(device); }
};
using Evdev = std::unique_ptr<libevdev, FreeEvdev>;

Evdev OpenEvdev(int file)
{
  libevdev* device = nullptr;
  return libevdev_new_from_fd(file, &device) == 0 ? Evdev(device) : Evdev();
}

bool IsGamepad(const libevdev* device)
{
  return libevdev_has_event_code(device, EV_KEY, BTN_GAMEPAD) != 0 &&
    libevdev_has_event_code(device, EV_ABS, ABS_X) != 0;
}

int OpenFile(const std::string& path)
{
  return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
}

/// @param path  the one that it is found at  @return -1: there is none
int FindGamepad(std::string& path)
{
  for (int number = 0; number < 64; ++number)
  {
    path = "/dev/input/event" + std::to_string(number);
    const int file = OpenFile(path);
    if (file < 0)
    {
      continue;
    }
    const Evdev device = OpenEvdev(file);
    if (device && IsGamepad(device.get()))
    {
      return file;
    }
    ::close(file);
  }
  errno = ENOENT;
  return -1;
}
}

bool GamepadDevice::HasEvdev()
{
  return true;
}

void GamepadDevice::WatchController()
{
  while (!this->Stopping)
  {
    std::string path = this->Path;
    const int file = path.empty() ? FindGamepad(path) : OpenFile(path);
    if (file < 0)
    {
      const std::string what = this->Path.empty() ? "There is no game controller"
        : errno == EACCES                         ? "No permission for '" + path + "'"
                                                  : "There is no '" + path + "'";
      this->Tell(errno == EACCES ? DeviceState::Refused : DeviceState::Disconnected,
        what + "; it is waited for.");
    }
    else
    {
      this->ReadController(file, path);
      ::close(file);
    }
    this->Pause(1000);
  }
}

void GamepadDevice::ReadController(int file, const std::string& name)
{
  const Evdev device = OpenEvdev(file);
  if (!device || !IsGamepad(device.get()))
  {
    this->Tell(DeviceState::Refused, "'" + name + "' is no game controller.");
    return;
  }
  this->Decoder = {};
  for (unsigned axis = 0; axis <= ABS_MAX; ++axis)
  {
    if (const input_absinfo* range = libevdev_get_abs_info(device.get(), axis))
    {
      const auto code = static_cast<std::uint16_t>(axis);
      this->Decoder.SetRange(code, range->minimum, range->maximum);
      this->Decoder.Feed(EV_ABS, code, range->value);
    }
  }
  this->Decoder.Feed(EV_SYN, SYN_REPORT, 0);
  this->Latest.Write(this->Decoder.State());
  this->Tell(DeviceState::Running,
    std::string("The game controller '") + libevdev_get_name(device.get()) + "' drives.");
  unsigned flags = LIBEVDEV_READ_FLAG_NORMAL;
  while (!this->Stopping)
  {
    input_event event{};
    const int result = libevdev_next_event(device.get(), flags, &event);
    // After lost events it is asked for all that has changed.
    flags =
      result == LIBEVDEV_READ_STATUS_SYNC ? LIBEVDEV_READ_FLAG_SYNC : LIBEVDEV_READ_FLAG_NORMAL;
    const bool dropped = event.type == EV_SYN && event.code == SYN_DROPPED;
    if (result >= 0 && !dropped && this->Decoder.Feed(event.type, event.code, event.value))
    {
      this->Latest.Write(this->Decoder.State());
    }
    else if (result == -EAGAIN)
    {
      pollfd wanted{ file, POLLIN, 0 };
      ::poll(&wanted, 1, 20);
    }
    else if (result < 0)
    {
      break;
    }
  }
  this->Latest.Write({});
  this->Tell(DeviceState::Disconnected, "The game controller is gone; it is waited for.");
}
#else
void GamepadDevice::WatchController()
{
}
void GamepadDevice::ReadController(int /*file*/, const std::string& /*name*/)
{
}
#endif
}
