#include "InstrumentProjector.h"

#include "TubeProjection.h"

#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr const char* InstrumentWords = "instrument";
}

void AddInstrument(const InstrumentChain& chain, const CArmGeometry& geometry, LineIntegrals& image)
{
  RequireFormat(InstrumentWords, geometry, image);
  if (chain.points.size() != chain.segments.size() + (chain.points.empty() ? 0 : 1))
  {
    throw std::invalid_argument("instrument: " + std::to_string(chain.points.size()) +
      " points do not bound " + std::to_string(chain.segments.size()) + " segments");
  }
  RequirePoints(InstrumentWords, chain.points);
  std::vector<TubeSection> sections;
  sections.reserve(chain.segments.size());
  for (const InstrumentSegment& segment : chain.segments)
  {
    RequireWithin(InstrumentWords, "an outer radius (mm)", segment.outerRadius, 0.0, 1000.0);
    RequireWithin(
      InstrumentWords, "an inner radius (mm)", segment.innerRadius, 0.0, segment.outerRadius);
    RequireWithin(InstrumentWords, "an attenuation (1/mm)", segment.attenuation, 0.0, 1000.0);
    sections.push_back({ { segment.outerRadius, segment.outerRadius },
      { segment.innerRadius, segment.innerRadius }, segment.attenuation });
  }
  AddTubes(chain.points, sections, geometry, image);
}
}
