#include "KeyboardDevice.h"

#include <cctype>

namespace coronary
{
namespace
{
// Bits of what is held: two for each axis, then these.
enum Action : unsigned
{
  Fluoroscopy = 2 * HandAxes,
  Cine,
  Mask,
  FastLeft,
  FastRight,
  FineLeft,
  FineRight
};

struct Key
{
  const char* name;
  Action action;
};

constexpr Key Keys[] = { { "f", Fluoroscopy }, { "c", Cine }, { "m", Mask },
  { "shift_l", FastLeft }, { "shift_r", FastRight }, { "control_l", FineLeft },
  { "control_r", FineRight } };

std::uint64_t Bit(std::size_t action)
{
  return std::uint64_t{ 1 } << action;
}

std::uint64_t BitOf(const std::string& key)
{
  std::string name = key;
  for (char& letter : name)
  {
    letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  }
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    if (name == HandAxisTable[axis].forward || name == HandAxisTable[axis].back)
    {
      return Bit(2 * axis + (name == HandAxisTable[axis].back ? 1 : 0));
    }
  }
  for (const Key& one : Keys)
  {
    if (name == one.name)
    {
      return Bit(one.action);
    }
  }
  return 0;
}

bool Has(std::uint64_t held, std::size_t action)
{
  return (held & Bit(action)) != 0;
}

HandWishes WishesOf(std::uint64_t held, const HandSpeeds& speeds)
{
  HandWishes wishes;
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    wishes.axes[axis] = (Has(held, 2 * axis) ? 1.0 : 0.0) - (Has(held, 2 * axis + 1) ? 1.0 : 0.0);
  }
  if (Has(held, FineLeft) || Has(held, FineRight))
  {
    wishes.pace = speeds.fine;
  }
  else if (Has(held, FastLeft) || Has(held, FastRight))
  {
    wishes.pace = speeds.fast;
  }
  return wishes;
}

std::uint32_t PedalsOf(std::uint64_t held)
{
  return (Has(held, Fluoroscopy) ? FluoroscopyPedal : 0U) | (Has(held, Cine) ? CinePedal : 0U) |
    (Has(held, Mask) ? MaskPedal : 0U);
}
}

KeyboardDevice::KeyboardDevice(const HandSpeeds& speeds)
  : Hands(speeds)
{
}

const std::vector<KeyBinding>& KeyboardDevice::KeyMap()
{
  static const std::vector<KeyBinding> map{ { "Up, Down", "wire forward, back" },
    { "Right, Left", "turn the wire clockwise, counter-clockwise, seen along the way forward" },
    { "W, S", "guide catheter forward, back" },
    { "D, A", "turn the guide catheter clockwise, counter-clockwise" },
    { "Shift, Control", "with these: fast, fine" }, { "E, Q", "balloon forward, back" },
    { "B, V", "inflate the balloon, deflate it" }, { "Space", "inject contrast" },
    { "BackSpace", "refill the syringe" }, { "F", "pedal: fluoroscopy" }, { "C", "pedal: cine" },
    { "M", "pedal: mask of a subtracted image or a roadmap" }, { "L, J", "C-arm to LAO, RAO" },
    { "I, K", "C-arm to cranial, caudal" }, { "O, U", "detector away from the patient, nearer" },
    { "T, G", "isocentre towards the head, the feet" },
    { "H, Z", "isocentre towards the patient's left, right" },
    { "Page Up, Page Down", "isocentre towards the front, the back" } };
  return map;
}

bool KeyboardDevice::Press(const std::string& key)
{
  const std::uint64_t bit = BitOf(key);
  this->Held.fetch_or(bit, std::memory_order_relaxed);
  return bit != 0;
}

bool KeyboardDevice::Release(const std::string& key)
{
  const std::uint64_t bit = BitOf(key);
  this->Held.fetch_and(~bit, std::memory_order_relaxed);
  return bit != 0;
}

void KeyboardDevice::ReleaseAll()
{
  this->Held.store(0, std::memory_order_relaxed);
}

void KeyboardDevice::Read(std::uint64_t /*tick*/, double secondsPerTick, InputFrame& frame)
{
  const std::uint64_t held = this->Held.load(std::memory_order_relaxed);
  this->Hands.Advance(WishesOf(held, this->Hands.Speeds()), secondsPerTick);
  frame = {};
  frame.input = this->Hands.Place();
  frame.input.pedals = PedalsOf(held);
  frame.axes = AllAxes;
  frame.state = DeviceState::Running;
}

DeviceStatus KeyboardDevice::Status() const
{
  DeviceStatus status;
  status.state = DeviceState::Running;
  status.text = "The keyboard drives.";
  return status;
}
}
