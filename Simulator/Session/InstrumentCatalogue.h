/**
 * @file InstrumentCatalogue.h
 * @brief Guidewires, guide catheters, balloons, stents and microcatheters by name, read from JSON. docs/simulator-files.md has the format.
 */
#ifndef DynamicCoronary_InstrumentCatalogue_h
#define DynamicCoronary_InstrumentCatalogue_h

#include "Instrument.h"

#include <map>
#include <string>
#include <vector>

namespace coronary
{
/// Property (its key in the file, "friction") to where its value is from.
using ValueSources = std::map<std::string, std::string>;

/// What a stiffness was computed from: a round core or a ribbon, and a jacket that fills the outer diameter.
struct WireCore
{
  double diameter = 0.0;        ///< mm; 0: a ribbon
  double ribbonWidth = 0.0;     ///< mm
  double ribbonThickness = 0.0; ///< mm
  double modulus = 0.0;         ///< Young's, MPa; 0: not known
  double jacketModulus = 0.0;   ///< MPa; 0: no jacket
};

struct CatalogueWire
{
  Guidewire wire;
  std::string description;
  double tipLoad = 0.0;                  ///< nominal, N; 0: not given
  std::vector<std::string> sectionNames; ///< may be empty texts
  std::vector<WireCore> cores;           ///< a section each
  std::vector<ValueSources> sources;     ///< a section each; those of the whole wire included
};

struct CatalogueCatheter
{
  GuideCatheter catheter;
  std::string description;
  std::vector<double>
    moduli; ///< MPa, a section each, that stiffness was computed from; 0: not known
  ValueSources sources;
};

struct CatalogueBalloon
{
  BalloonCatheter balloon;
  std::string description;
  std::vector<double> moduli; ///< MPa, a microcatheter's section each, as a catheter's
  ValueSources sources;
};

struct InstrumentCatalogue
{
  std::string origin; ///< for messages: the file's name in quotes
  std::vector<CatalogueWire> wires;
  std::vector<CatalogueCatheter> catheters;
  std::vector<CatalogueBalloon> balloons;
  std::vector<CatalogueBalloon> microcatheters;

  ///@{
  /// @throws std::invalid_argument naming the catalogue, the name and the names that there are
  const CatalogueWire& Wire(const std::string& name) const;
  const CatalogueCatheter& Catheter(const std::string& name) const;
  const CatalogueBalloon& Balloon(const std::string& name) const; ///< or microcatheter
  ///@}
};

/**
 * @param origin  of the text, for messages: a file's name in quotes
 * @throws std::runtime_error: no JSON; std::invalid_argument naming origin, instrument, section and property
 */
InstrumentCatalogue CatalogueFromText(const std::string& text, const std::string& origin);

/// @throws std::runtime_error naming a file that can not be read; as CatalogueFromText
InstrumentCatalogue ReadCatalogue(const std::string& path);

/// The one that is compiled in: Simulator/Session/instruments.json.
const InstrumentCatalogue& BuiltInCatalogue();

/**
 * A wire with the stiffnesses that follow from a core by beam theory; the rest is kept.
 *
 * Round: EI = E pi d^4 / 64, GJ = G pi d^4 / 32. Ribbon (w wide, t thick): EI = E w t^3 / 12 and E t w^3 / 12,
 * GJ = G w t^3 (1 - 0.63 t / w (1 - (t / w)^4 / 12)) / 3 (Roark). A jacket adds its modulus times what the core
 * leaves of the round section. Poisson's ratio: 0.3 of the core, 0.45 of the jacket.
 */
void SetStiffness(const WireCore& core, WireSection& section);

/**
 * Force that deflects the wire's tip sideways by `deflection` where the wire is clamped `length` behind it, about
 * its softer axis, N: F = deflection / integral of s^2 / EI(s), s from the tip; of a wire of one section
 * 3 EI deflection / length^3. The shape at rest does not count.
 * @param length, deflection  mm, positive
 */
double TipLoad(const Guidewire& wire, double length = 10.0, double deflection = 2.0);
}

#endif
