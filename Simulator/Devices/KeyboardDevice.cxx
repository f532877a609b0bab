#include "KeyboardDevice.h"

#include <cctype>

namespace coronary
{
namespace
{
enum Action : unsigned
{
  WireForward,
  WireBack,
  WireRight,
  WireLeft,
  CatheterForward,
  CatheterBack,
  CatheterRight,
  CatheterLeft,
  Inject,
  Refill,
  Fluoroscopy,
  Cine,
  Mask,
  Lao,
  Rao,
  Cranial,
  Caudal,
  DetectorAway,
  DetectorNear,
  TableHead,
  TableFeet,
  TableLeft,
  TableRight,
  TableUp,
  TableDown,
  FastLeft,
  FastRight,
  FineLeft,
  FineRight,
  Unknown
};

struct Key
{
  const char* name;
  Action action;
};

constexpr Key Keys[] = { { "up", WireForward }, { "down", WireBack }, { "right", WireRight },
  { "left", WireLeft }, { "w", CatheterForward }, { "s", CatheterBack }, { "d", CatheterRight },
  { "a", CatheterLeft }, { "space", Inject }, { "backspace", Refill }, { "f", Fluoroscopy },
  { "c", Cine }, { "m", Mask }, { "j", Rao }, { "l", Lao }, { "i", Cranial }, { "k", Caudal },
  { "o", DetectorAway }, { "u", DetectorNear }, { "t", TableHead }, { "g", TableFeet },
  { "h", TableLeft }, { "z", TableRight }, { "prior", TableUp }, { "next", TableDown },
  { "shift_l", FastLeft }, { "shift_r", FastRight }, { "control_l", FineLeft },
  { "control_r", FineRight } };

std::uint64_t BitOf(const std::string& key)
{
  std::string name = key;
  for (char& letter : name)
  {
    letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  }
  for (const Key& one : Keys)
  {
    if (name == one.name)
    {
      return std::uint64_t{ 1 } << one.action;
    }
  }
  return 0;
}

bool Has(std::uint64_t held, Action action)
{
  return (held >> action & 1) != 0;
}

double Wish(std::uint64_t held, Action forward, Action back)
{
  return (Has(held, forward) ? 1.0 : 0.0) - (Has(held, back) ? 1.0 : 0.0);
}

HandWishes WishesOf(std::uint64_t held, const HandSpeeds& speeds)
{
  HandWishes wishes;
  wishes.wire = Wish(held, WireForward, WireBack);
  wishes.wireTurning = Wish(held, WireRight, WireLeft);
  wishes.catheter = Wish(held, CatheterForward, CatheterBack);
  wishes.catheterTurning = Wish(held, CatheterRight, CatheterLeft);
  wishes.syringe = Wish(held, Inject, Refill);
  wishes.primary = Wish(held, Lao, Rao);
  wishes.secondary = Wish(held, Cranial, Caudal);
  wishes.detector = Wish(held, DetectorAway, DetectorNear);
  // LPS.
  wishes.table = { Wish(held, TableLeft, TableRight), Wish(held, TableDown, TableUp),
    Wish(held, TableHead, TableFeet) };
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
    { "Shift, Control", "with these: fast, fine" }, { "Space", "inject contrast" },
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
