#include "WireInGuide.h"

#include "Fnv1a.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double StraightBehind = 40.0; // mm behind the bends, so that the wire can lie down there
constexpr double WallStiffness = 60.0;  // N/mm of a node
constexpr double Ground = 1e-7; // N/mm to the middle: where nothing else says where the wire lies
constexpr double FirstGround = 1.0; // N/mm, from which it is let down to that
constexpr int FirstSteps = 8;       // each a tenth of the one before, down to Ground
constexpr double LayInterval = 0.5; // mm that the wire is advanced before it lies otherwise
constexpr double LayTurn = 0.1;     // rad, likewise, of a wire that is curved
constexpr int FirstIterations = 50;
constexpr int Iterations = 4;     // from where it lay before
constexpr int Passes = 3;         // for what slides and what sticks
constexpr double ShaftStep = 5.0; // mm

/// Mean over a piece, so that no place of a bend falls between two nodes.
Eigen::Vector2d MeanCurvature(const GuideCatheter& guide, double from, double to)
{
  constexpr int Parts = 8;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 0; i < Parts; ++i)
  {
    sum += CurvatureAt(guide.shape, from + (i + 0.5) / Parts * (to - from));
  }
  return sum / Parts;
}

/// The wire's curvature at rest is about its first axis: it bends across that.
Eigen::Vector2d Across(double angle)
{
  return { -std::sin(angle), std::cos(angle) };
}

double BendingStiffness(const WireSection& section)
{
  return 0.5 * (section.bendingStiffness1 + section.bendingStiffness2);
}

double TorsionalStiffness(const WireSection& section)
{
  return section.torsionalStiffness;
}
}

WireInGuide::WireInGuide(const Guidewire& wire, const GuideCatheter& guide, double from)
  : Wire(wire)
  , Guide(guide)
  , From(from)
  , Radius(AlongWire(wire, 0.5 * wire.length, [](const WireSection& s) { return s.radius; }))
  , Clearance(guide.innerRadius - this->Radius)
{
  double shape = 0.0;
  for (const CatheterArc& arc : guide.shape)
  {
    shape += arc.length;
  }
  const auto cells = static_cast<std::size_t>(std::ceil(std::max(0.0, shape - from) / CellLength));
  this->Length = cells > 0 ? (shape - from) / static_cast<double>(cells) : 0.0;
  this->Cells.resize(cells);
  for (std::size_t i = 0; i < cells; ++i)
  {
    // A bend in the middle of a cell counts as well.
    constexpr int parts = 8;
    for (int part = 0; part < parts; ++part)
    {
      const double behind = from + (static_cast<double>(i) + (part + 0.5) / parts) * this->Length;
      this->Cells[i].turn += CurvatureAt(guide.shape, behind).norm() * this->Length / parts;
    }
  }
  this->Curved = std::any_of(wire.sections.begin(), wire.sections.end(),
    [](const WireSection& section) { return section.restCurvature != 0.0; });

  const double whole = std::min(shape + StraightBehind, std::max(guide.length, shape));
  const auto nodes = static_cast<std::size_t>(std::ceil(whole / NodeSpacing)) + 1;
  for (std::size_t i = 0; i < nodes; ++i)
  {
    const double behind = static_cast<double>(i) * NodeSpacing;
    this->Curvature.push_back(
      MeanCurvature(guide, behind - 0.5 * NodeSpacing, behind + 0.5 * NodeSpacing));
  }
  this->Places.assign(nodes, Vector2::Zero());
  this->Trial = this->Places;
  this->Bends = this->Curvature;
  this->Bending.assign(nodes, 0.0);
  this->Band.resize(2 * nodes);
  this->Right.resize(2 * nodes);
}

// ---- across the lumen ----

/// Where the wire lies in the guide, and what depends on which of its parts is where.
void WireInGuide::Lay()
{
  const bool first = !this->Laid;
  this->Laid = true;
  this->LaidAngle = this->Far;
  this->CurvedWithin = false;
  for (std::size_t i = 0; i < this->Places.size(); ++i)
  {
    const double behind = static_cast<double>(i) * NodeSpacing;
    const double fromTip = this->Inserted + behind;
    this->Bending[i] = AlongWire(this->Wire, fromTip, BendingStiffness);
    this->Bends[i] = this->Curvature[i];
    if (const double curved = this->Curved ? RestCurvature(this->Wire, fromTip) : 0.0;
        curved != 0.0)
    {
      this->CurvedWithin = this->CurvedWithin || behind >= this->From;
      const double cell = this->Length > 0.0 ? (behind - this->From) / this->Length : 0.0;
      const double angle = this->Cells.empty()
        ? this->Far
        : this
            ->Cells[static_cast<std::size_t>(
              std::clamp(cell, 0.0, static_cast<double>(this->Cells.size() - 1)))]
            .angle;
      this->Bends[i] -= curved * Across(angle);
    }
  }
  double ground = first ? FirstGround : Ground;
  for (int step = first ? FirstSteps : 1; step > 0; --step)
  {
    for (int n = first ? FirstIterations : Iterations; n > 0 && this->Relax(ground); --n)
    {
    }
    ground *= 0.1;
  }
  this->Press();
  this->Couple();
}

double WireInGuide::BendingEnergy(const std::vector<Vector2>& places, double ground) const
{
  double energy = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i)
  {
    if (i > 0 && i + 1 < places.size())
    {
      const Vector2 bent = this->Bends[i] +
        (places[i - 1] - 2.0 * places[i] + places[i + 1]) / (NodeSpacing * NodeSpacing);
      energy += 0.5 * NodeSpacing * this->Bending[i] * bent.squaredNorm();
    }
    const double distance = places[i].norm();
    const double depth = std::max(0.0, distance - this->Clearance);
    energy += 0.5 * WallStiffness * depth * depth + 0.5 * ground * distance * distance;
  }
  return energy;
}

/// Of Newton's method for the least energy.
void WireInGuide::Assemble(double ground)
{
  for (std::size_t n = 0; n < this->Band.size(); ++n)
  {
    this->Band[n].fill(0.0);
    this->Right[n] = 0.0;
  }
  constexpr std::array<double, 3> Difference{ 1.0, -2.0, 1.0 };
  const std::size_t nodes = this->Places.size();
  for (std::size_t i = 0; i < nodes; ++i)
  {
    if (i > 0 && i + 1 < nodes)
    {
      const double weight = this->Bending[i] / (NodeSpacing * NodeSpacing * NodeSpacing);
      const Vector2 bent = this->Bends[i] * (NodeSpacing * NodeSpacing) + this->Places[i - 1] -
        2.0 * this->Places[i] + this->Places[i + 1];
      for (std::size_t a = 0; a < 3; ++a)
      {
        for (int axis = 0; axis < 2; ++axis)
        {
          const std::size_t row = 2 * (i + a - 1) + static_cast<std::size_t>(axis);
          this->Right[row] -= weight * Difference[a] * bent[axis];
          for (std::size_t b = 0; b <= a; ++b)
          {
            this->Band[row][5 - 2 * (a - b)] += weight * Difference[a] * Difference[b];
          }
        }
      }
    }
    const Vector2& place = this->Places[i];
    const double distance = place.norm();
    Eigen::Matrix2d held = ground * Eigen::Matrix2d::Identity();
    Vector2 pushed = -ground * place;
    if (distance > this->Clearance)
    {
      const Vector2 outwards = place / distance;
      const Eigen::Matrix2d along = outwards * outwards.transpose();
      held += WallStiffness *
        (along + (1.0 - this->Clearance / distance) * (Eigen::Matrix2d::Identity() - along));
      pushed -= WallStiffness * (distance - this->Clearance) * outwards;
    }
    this->Band[2 * i][5] += held(0, 0);
    this->Band[2 * i + 1][5] += held(1, 1);
    this->Band[2 * i + 1][4] += held(1, 0);
    this->Right[2 * i] += pushed.x();
    this->Right[2 * i + 1] += pushed.y();
  }
}

/// Cholesky; five below the diagonal.
void WireInGuide::SolveBand()
{
  const std::size_t count = this->Band.size();
  for (std::size_t row = 0; row < count; ++row)
  {
    std::array<double, 6>& own = this->Band[row];
    const std::size_t first = row > 5 ? row - 5 : 0;
    for (std::size_t column = first; column <= row; ++column)
    {
      double sum = own[5 - (row - column)];
      for (std::size_t k = std::max(first, column > 5 ? column - 5 : 0); k < column; ++k)
      {
        sum -= own[5 - (row - k)] * this->Band[column][5 - (column - k)];
      }
      own[5 - (row - column)] =
        column == row ? std::sqrt(std::max(sum, 1e-12)) : sum / this->Band[column][5];
    }
    double right = this->Right[row];
    for (std::size_t k = first; k < row; ++k)
    {
      right -= own[5 - (row - k)] * this->Right[k];
    }
    this->Right[row] = right / own[5];
  }
  for (std::size_t row = count; row-- > 0;)
  {
    this->Right[row] /= this->Band[row][5];
    for (std::size_t k = row > 5 ? row - 5 : 0; k < row; ++k)
    {
      this->Right[k] -= this->Band[row][5 - (row - k)] * this->Right[row];
    }
  }
}

/// A step of Newton's method. @return false: it lies where it has to
bool WireInGuide::Relax(double ground)
{
  this->Assemble(ground);
  this->SolveBand();
  const double before = this->BendingEnergy(this->Places, ground);
  double share = 1.0;
  double most = 0.0;
  for (int n = 0; n < 12; ++n, share *= 0.5)
  {
    most = 0.0;
    for (std::size_t i = 0; i < this->Places.size(); ++i)
    {
      const Vector2 change = share * Vector2(this->Right[2 * i], this->Right[2 * i + 1]);
      this->Trial[i] = this->Places[i] + change;
      most = std::max(most, change.norm());
    }
    if (this->BendingEnergy(this->Trial, ground) <= before)
    {
      this->Places.swap(this->Trial);
      return most > 1e-7;
    }
  }
  return false;
}

void WireInGuide::Press()
{
  for (Cell& cell : this->Cells)
  {
    cell.bent = 0.0;
  }
  for (std::size_t i = 0; i < this->Places.size() && !this->Cells.empty(); ++i)
  {
    const double behind = static_cast<double>(i) * NodeSpacing;
    if (behind >= this->From)
    {
      const auto cell = static_cast<std::size_t>((behind - this->From) / this->Length);
      this->Cells[std::min(cell, this->Cells.size() - 1)].bent +=
        WallStiffness * std::max(0.0, this->Places[i].norm() - this->Clearance);
    }
  }
}

double WireInGuide::Pressing() const
{
  double sum = 0.0;
  for (const Cell& cell : this->Cells)
  {
    sum += cell.bent;
  }
  return sum;
}

// ---- torsion ----

/// Torsional stiffness and curvature at rest of what is in the cells now.
void WireInGuide::Couple()
{
  const auto twist = [this](double behind)
  { return AlongWire(this->Wire, this->Inserted + behind, TorsionalStiffness); };
  double behind = this->From;
  double compliance = 0.0;
  for (Cell& cell : this->Cells)
  {
    const double half = 0.5 * this->Length / twist(behind + 0.5 * this->Length);
    cell.link = 1.0 / (compliance + half);
    compliance = half;
    const double middle = behind + 0.5 * this->Length;
    const double fromTip = this->Inserted + middle;
    const double curved = this->Curved ? RestCurvature(this->Wire, fromTip) : 0.0;
    cell.curving = curved * this->Length * AlongWire(this->Wire, fromTip, BendingStiffness) *
      MeanCurvature(this->Guide, behind, behind + this->Length);
    behind += this->Length;
  }
  // Straight from here to the hand.
  const double straight = std::max(this->Guide.length - behind, this->Cells.empty() ? 1.0 : 0.0);
  const int steps = static_cast<int>(std::ceil(straight / ShaftStep));
  for (int i = 0; i < steps; ++i)
  {
    compliance += straight / steps / twist(behind + (i + 0.5) * straight / steps);
  }
  this->HandLink = 1.0 / compliance;
}

/// As if nothing slid in this step.
WireInGuide::Vector2 WireInGuide::Strained(const Cell& cell) const
{
  return cell.strain + Vector2(this->Way, this->Radius * (cell.moved - this->GuideTurned));
}

/// The chain without its far end. @param whole  with what makes it unstable  @return false: it is
bool WireInGuide::Eliminate(bool whole)
{
  double link = this->HandLink;
  double pivot = 0.0;
  double right = 0.0;
  for (std::size_t i = this->Cells.size(); i-- > 0;)
  {
    Cell& cell = this->Cells[i];
    const double rubs =
      this->Guide.friction * cell.pressed / StickLength * cell.kept * this->Radius;
    const Vector2 across = Across(cell.angle);
    const double turns = cell.curving.dot(Vector2(across.y(), -across.x())); // dE/d angle
    double stiffens = cell.curving.dot(across);                              // its derivative
    stiffens = whole ? stiffens : std::max(0.0, stiffens);
    const bool last = i + 1 == this->Cells.size();
    cell.pivot =
      cell.link + link + rubs * this->Radius + stiffens - (last ? 0.0 : link * link / pivot);
    cell.right = rubs * (this->Radius * (cell.angle + this->GuideTurned) - cell.strain.y()) -
      turns + stiffens * cell.angle + (last ? link * this->Hand : link * right / pivot);
    if (!(cell.pivot > cell.link * (1.0 + 1e-12)))
    {
      return false;
    }
    pivot = cell.pivot;
    right = cell.right;
    link = cell.link;
  }
  return true;
}

void WireInGuide::Eliminate()
{
  if (!this->Eliminate(true))
  {
    this->Eliminate(false);
  }
}

void WireInGuide::Drive(double inserted, double way, double hand, double turned)
{
  this->Way = way;
  this->Hand = hand;
  this->GuideTurned = turned;
  if (!this->Laid || std::abs(inserted - this->Inserted) > LayInterval ||
    (this->CurvedWithin && std::abs(this->Far - this->LaidAngle) > LayTurn))
  {
    this->Inserted = inserted;
    this->Lay();
  }
  for (Cell& cell : this->Cells)
  {
    cell.kept = std::min(1.0, StickLength / std::max(this->Strained(cell).norm(), 1e-30));
  }
  this->Eliminate();
  if (this->Cells.empty())
  {
    this->EndStiffness = this->HandLink;
    this->EndAngle = hand;
    return;
  }
  const Cell& first = this->Cells.front();
  this->EndStiffness = first.link * (1.0 - first.link / first.pivot);
  this->EndAngle = first.link * first.right / first.pivot / this->EndStiffness;
}

void WireInGuide::Settle(double force, double angle)
{
  this->Far = angle;
  for (int n = 0; n < Passes; ++n)
  {
    if (n > 0)
    {
      this->Eliminate();
    }
    double before = angle;
    double most = 0.0;
    for (Cell& cell : this->Cells)
    {
      const double now = (cell.right + cell.link * before) / cell.pivot;
      cell.moved = now - cell.angle;
      before = now;
      const double kept = std::min(1.0, StickLength / std::max(this->Strained(cell).norm(), 1e-30));
      most = std::max(most, std::abs(kept - cell.kept));
      cell.kept = kept;
    }
    if (most < 1e-3)
    {
      break;
    }
  }
  this->Felt = { force, 0.0 };
  const double friction = this->Guide.friction;
  for (Cell& cell : this->Cells)
  {
    cell.angle += cell.moved;
    const Vector2 strained = this->Strained(cell);
    cell.strain = cell.kept * strained;
    const double axial = this->Felt.force;
    const double along = friction * cell.strain.x() / StickLength;
    const double grows = 0.5 * along * cell.turn * (axial < 0.0 ? -1.0 : 1.0);
    const double next = (axial * (1.0 + grows) + along * cell.bent) / (1.0 - grows);
    cell.pressed = 0.5 * std::abs(axial + next) * cell.turn + cell.bent;
    this->Work += friction * cell.pressed / StickLength * cell.strain.dot(strained - cell.strain);
    this->Felt.force += along * cell.pressed;
  }
  const double last = this->Cells.empty() ? angle : this->Cells.back().angle;
  this->Felt.torque = this->HandLink * (this->Hand - last);
}

void WireInGuide::Rest(double hand, double angle)
{
  this->Hand = hand;
  this->Far = angle;
  for (Cell& cell : this->Cells)
  {
    cell.strain.setZero();
    cell.moved = 0.0;
    cell.pressed = 0.0;
  }
  // The chain is wound up by the same torque everywhere.
  double compliance = 1.0 / this->HandLink;
  for (const Cell& cell : this->Cells)
  {
    compliance += 1.0 / cell.link;
  }
  const double torque = (hand - angle) / compliance;
  double at = angle;
  for (Cell& cell : this->Cells)
  {
    at += torque / cell.link;
    cell.angle = at;
  }
}

double WireInGuide::ElasticEnergy() const
{
  double energy = 0.0;
  double before = this->Far;
  for (const Cell& cell : this->Cells)
  {
    energy += 0.5 * cell.link * (cell.angle - before) * (cell.angle - before) -
      cell.curving.dot(Across(cell.angle)) +
      0.5 * this->Guide.friction * cell.pressed / StickLength * cell.strain.squaredNorm();
    before = cell.angle;
  }
  return energy + 0.5 * this->HandLink * (this->Hand - before) * (this->Hand - before);
}

std::uint64_t WireInGuide::Hash(std::uint64_t hash) const
{
  for (const Cell& cell : this->Cells)
  {
    hash = Fnv1a(&cell.angle, sizeof(double), hash);
    hash = Fnv1a(cell.strain.data(), 2 * sizeof(double), hash);
    hash = Fnv1a(&cell.pressed, sizeof(double), hash);
  }
  return hash;
}
}
