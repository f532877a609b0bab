#include "Notices.h"

#include <cstdio>

namespace coronary
{
namespace
{
const char* const NoticeText[] = { "the input is not finite: the instruments are held",
  "the wire is driven faster than hands can: its speed is limited",
  "the wire is turned faster than hands can: its speed is limited",
  "the catheter is at the end of its way", "the wire is drawn back to the end of its way",
  "no more of the wire can be simulated: it is advanced no further",
  "the wire's equations could not be solved: it is set back to where it was last sane",
  "the wire left the lumen and was put back",
  "the balloon is at the end of its way: it has to stay on the wire, and in the guide",
  "the stent is not wholly out of the guide catheter: its balloon is not inflated",
  "the balloon is not exchanged: first it has to be emptied and drawn back into the guide",
  "the wire is not exchanged: first it has to be drawn back into the guide",
  "the microcatheter is at the end of its way: it has to stay on the wire, and in the guide",
  "the wire is drawn back to the microcatheter's tip and goes no further: it can be exchanged "
  "there",
  "a microcatheter has no balloon: nothing is inflated",
  "the microcatheter is not exchanged: first it has to be drawn back into the guide",
  "the wire is not exchanged: its tip is beyond the microcatheter's by " };
}

void Notices::Say(Notice notice, std::uint64_t tick, const std::string& more)
{
  std::uint64_t& last = this->LastTick[static_cast<int>(notice)];
  if (last == 0 || tick - last >= static_cast<std::uint64_t>(this->TickRate))
  {
    last = tick;
    char text[192];
    std::snprintf(text, sizeof(text), "%.3f s: %s",
      static_cast<double>(tick) * (1.0 / this->TickRate), NoticeText[static_cast<int>(notice)]);
    if (this->Messages.size() < 1000)
    {
      this->Messages.push_back(text + more);
    }
  }
}

std::vector<std::string> Notices::Take()
{
  std::vector<std::string> taken;
  taken.swap(this->Messages);
  return taken;
}
}
