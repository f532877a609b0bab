#include "ClockOffset.h"

#include <algorithm>

namespace coronary
{
const ClockOffset::Sample& ClockOffset::Fastest() const
{
  const auto end = this->Samples.begin() +
    static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(this->Count, Window));
  return *std::min_element(this->Samples.begin(), end,
    [](const Sample& a, const Sample& b) { return a.roundTrip < b.roundTrip; });
}

void ClockOffset::Add(std::uint64_t sent, std::uint64_t received, std::uint64_t device)
{
  if (received < sent)
  {
    return;
  }
  Sample sample;
  sample.sent = sent;
  sample.roundTrip = static_cast<double>(received - sent);
  // The difference of the counts may have either sign.
  sample.offset =
    static_cast<double>(static_cast<std::int64_t>(device - sent)) - 0.5 * sample.roundTrip;
  this->Samples[this->Count % Window] = sample;
  ++this->Count;
  this->Best = this->Fastest();
  if (this->Count % Window == 0)
  {
    (this->Count == Window ? this->FirstWindow : this->LastWindow) = this->Best;
  }
}

double ClockOffset::Drift() const
{
  if (this->LastWindow.sent <= this->FirstWindow.sent || this->Count < 2 * Window)
  {
    return 0.0;
  }
  return 1e6 * (this->LastWindow.offset - this->FirstWindow.offset) /
    static_cast<double>(this->LastWindow.sent - this->FirstWindow.sent);
}
}
