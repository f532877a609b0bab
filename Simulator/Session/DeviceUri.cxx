#include "DeviceUri.h"

#include "GamepadDevice.h"
#include "KeyboardDevice.h"
#include "RecordedDevices.h"
#include "SerialDevice.h"

#include <array>
#include <stdexcept>

namespace coronary
{
namespace
{
enum class PathRule
{
  None,
  Optional,
  Required
};

struct SchemeRule
{
  const char* name;
  PathRule path;
};
constexpr std::array<SchemeRule, 6> Schemes{ { { "serial", PathRule::Required },
  { "gamepad", PathRule::Optional }, { "keyboard", PathRule::None },
  { "replay", PathRule::Required }, { "script", PathRule::Required },
  { "null", PathRule::None } } };

[[noreturn]] void Refuse(const std::string& text, const std::string& why)
{
  throw std::invalid_argument("The device '" + text + "' " + why + ".");
}
}

DeviceUri ParseDeviceUri(const std::string& text)
{
  const std::size_t colon = text.find(':');
  DeviceUri uri{ text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 1) };
  for (const SchemeRule& rule : Schemes)
  {
    if (colon == std::string::npos || uri.scheme != rule.name)
    {
      continue;
    }
    if (rule.path == PathRule::Required && uri.path.empty())
    {
      Refuse(text, "needs a path behind the colon");
    }
    if (rule.path == PathRule::None && !uri.path.empty())
    {
      Refuse(text, "has a path, and none is wanted");
    }
    return uri;
  }
  Refuse(text,
    "is none of serial:PATH, gamepad:, gamepad:PATH, keyboard:, replay:FILE, script:FILE, null:");
}

std::shared_ptr<Device> OpenDevice(const std::string& text, const SessionInput& start)
{
  const DeviceUri uri = ParseDeviceUri(text);
  if (uri.scheme == "serial")
  {
    return std::make_shared<SerialDevice>(uri.path);
  }
  if (uri.scheme == "gamepad")
  {
    return std::make_shared<GamepadDevice>(uri.path);
  }
  if (uri.scheme == "keyboard")
  {
    return std::make_shared<KeyboardDevice>();
  }
  if (uri.scheme == "replay")
  {
    return std::make_shared<ReplayDevice>(uri.path);
  }
  if (uri.scheme == "script")
  {
    return std::make_shared<ScriptDevice>(ReadDriveScript(uri.path), uri.path, start);
  }
  return std::make_shared<NullDevice>();
}
}
