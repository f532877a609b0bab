#include "DeviceLog.h"

#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
std::string ForceText(const ForceMessage& force)
{
  char text[200];
  std::snprintf(text, sizeof(text),
    R"("FORCE","tick":%u,"valid_ms":%u,"force_N":[%.9g,%.9g],"torque_Nm":[%.9g,%.9g])", force.tick,
    static_cast<unsigned>(force.validMilliseconds), static_cast<double>(force.force[0]),
    static_cast<double>(force.force[1]), static_cast<double>(force.torque[0]),
    static_cast<double>(force.torque[1]));
  return text;
}

/// Empty for what is not logged.
std::string TextOf(const Message& message)
{
  HelloMessage hello;
  StartMessage start;
  ForceMessage force;
  HeartbeatMessage heartbeat;
  ZeroMessage zero;
  if (Decode(message, hello))
  {
    return R"("HELLO","nonce":)" + std::to_string(hello.nonce);
  }
  if (Decode(message, start))
  {
    return R"("START","rate_hz":)" + std::to_string(start.rate) + R"(,"watchdog_ms":)" +
      std::to_string(start.watchdog);
  }
  if (Decode(message, force))
  {
    return ForceText(force);
  }
  if (Decode(message, heartbeat))
  {
    return R"("HEARTBEAT","tick":)" + std::to_string(heartbeat.tick);
  }
  if (message.type == MessageType::Zero && Decode(message, zero))
  {
    return R"("ZERO","axes":)" + std::to_string(zero.axes);
  }
  return message.type == MessageType::Stop ? R"("STOP")" : "";
}
}

DeviceLog::DeviceLog(const std::string& path)
  : Path(path)
  , Stream(path)
{
  if (!this->Stream)
  {
    throw std::runtime_error("Cannot write '" + path + "'.");
  }
}

void DeviceLog::Line(double seconds, const std::string& rest)
{
  char time[40];
  std::snprintf(time, sizeof(time), "{\"t\":%.6f,\"type\":", seconds);
  this->Stream << time << rest << "}\n";
}

void DeviceLog::Received(const Message& message, double seconds)
{
  const std::string text = TextOf(message);
  if (!text.empty())
  {
    this->Line(seconds, text);
  }
}

void DeviceLog::Relaxed(bool relaxed, double seconds)
{
  this->Line(seconds, relaxed ? R"("motors relaxed")" : R"("motors armed")");
  this->Stream.flush();
}

void DeviceLog::Finish()
{
  this->Stream.close();
  if (!this->Stream)
  {
    throw std::runtime_error("Cannot write '" + this->Path + "'.");
  }
}
}
