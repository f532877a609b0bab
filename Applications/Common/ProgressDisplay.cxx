#include "ProgressDisplay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <unistd.h>

namespace coronary
{
namespace
{
constexpr int BarWidth = 28;
constexpr auto BarInterval = std::chrono::milliseconds(100);
constexpr auto LineInterval = std::chrono::milliseconds(500);

std::string Duration(double seconds)
{
  const long whole = std::lround(seconds);
  char text[32];
  if (whole < 60)
  {
    std::snprintf(text, sizeof(text), "%ld s", whole);
  }
  else
  {
    std::snprintf(text, sizeof(text), "%ld min %02ld s", whole / 60, whole % 60);
  }
  return text;
}
}

ProgressDisplay::ProgressDisplay(std::string unit, int steps, bool quiet)
  : Unit(std::move(unit))
  , Steps(steps)
  , Quiet(quiet)
  , Terminal(isatty(STDERR_FILENO) != 0)
  , Lines(!Terminal && std::getenv("DYNAMICCORONARY_PROGRESS") != nullptr)
{
}

ProgressDisplay::~ProgressDisplay()
{
  if (this->Drawn)
  {
    std::fputs("\r\033[K", stderr);
  }
}

void ProgressDisplay::BeginStep(int step, const std::string& detail)
{
  this->Step = step;
  this->Fraction = 0.0;
  this->Detail = detail;
  if (this->Quiet)
  {
    return;
  }
  if (this->Terminal)
  {
    this->DrawBar();
    return;
  }
  const std::string remaining = this->Remaining();
  std::fprintf(stderr, "%s %d of %d (%s)%s%s\n", this->Unit.c_str(), step + 1, this->Steps,
    detail.c_str(), remaining.empty() ? "" : ", ", remaining.c_str());
}

void ProgressDisplay::Update(double fraction)
{
  this->Fraction = std::clamp(fraction, 0.0, 1.0);
  if (!this->Quiet && this->Terminal && Clock::now() - this->LastDrawn >= BarInterval)
  {
    this->DrawBar();
  }
  else if (!this->Quiet && this->Lines && Clock::now() - this->LastDrawn >= LineInterval)
  {
    this->LastDrawn = Clock::now();
    std::fprintf(stderr, "progress %.3f\n", (this->Step + this->Fraction) / this->Steps);
  }
}

void ProgressDisplay::DrawBar()
{
  this->LastDrawn = Clock::now();
  this->Drawn = true;
  const double done = (this->Step + this->Fraction) / this->Steps;
  const int filled = static_cast<int>(done * BarWidth);
  const std::string bar = std::string(filled, '#') + std::string(BarWidth - filled, '.');
  std::fprintf(stderr, "\r[%s] %3d %%  %s %d of %d (%s)  %s\033[K", bar.c_str(),
    static_cast<int>(100.0 * done), this->Unit.c_str(), this->Step + 1, this->Steps,
    this->Detail.c_str(), this->Remaining().c_str());
  std::fflush(stderr);
}

std::string ProgressDisplay::Remaining() const
{
  const double done = (this->Step + this->Fraction) / this->Steps;
  const std::chrono::duration<double> spent = Clock::now() - this->Start;
  // An estimate from the first moments would jump about.
  if (spent.count() < 1.0 || done < 0.01)
  {
    return {};
  }
  return "about " + Duration(spent.count() * (1.0 - done) / done) + " left";
}
}
