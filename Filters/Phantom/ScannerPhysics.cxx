#include "ScannerPhysics.h"

#include "CounterRandom.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double BinWidth = 4.0;       // keV
constexpr double MinimumEnergy = 18.0; // keV: nothing below leaves the tube's filter
constexpr double KEdge = 69.5;         // of tungsten, keV
// Tungsten that X-rays pass on their way out at 120 kV, cm: a mean depth of 4 um under 7 degrees.
// Electrons go as deep as the square of the voltage (Thomson and Whiddington).
constexpr double AnodePath = 3.3e-3;
// Photons per mm^2 at 1 m, mAs and keV where E0 / E - 1 is one: calibrated so that a cell of the VCT
// gets 3,120 photons per mAs at 120 kV behind 28 cm of water.
constexpr double Output = 3.71e4;
// K photons of tungsten in the same unit, where E0 is twice the edge: 8 % of all at 120 kV.
constexpr double KYield = 2.75e5;
constexpr double ReferenceWater = 280.0; // mm
constexpr double LongestWater = 600.0;   // mm that the water correction is fitted to
constexpr int CorrectionDegree = 6;
constexpr double NormalFrom = 100.0; // mean of a Poisson number

/// Body bow-tie of the VCT: aluminium in mm at fan angles in degrees.
double BowTie(double angle)
{
  constexpr double degrees[] = { 0.0, 5.5, 9.3, 12.9, 16.7, 20.0, 24.0 };
  constexpr double millimetres[] = { 2.6, 3.5, 8.6, 17.7, 28.7, 35.0, 36.0 };
  const double at = std::abs(angle) * 180.0 / 3.14159265358979323846;
  for (int i = 1; i < 7; ++i)
  {
    if (at < degrees[i])
    {
      const double u = (at - degrees[i - 1]) / (degrees[i] - degrees[i - 1]);
      return millimetres[i - 1] + u * (millimetres[i] - millimetres[i - 1]);
    }
  }
  return millimetres[6];
}

constexpr double AluminiumDensity = 2.699;
constexpr double TungstenDensity = 19.3;

/// 1/mm of water, of 1 mg/mL of iodine, of 1 mg/cm^3 of hydroxyapatite.
Eigen::Array3d BasisCoefficients(double energy)
{
  return { 0.1 * MassAttenuation("H2O", energy), 1e-4 * MassAttenuation("I", energy),
    1e-4 * MassAttenuation("Ca10P6O26H2", energy) };
}

/// Water and hydroxyapatite that attenuate most like a tissue between 40 and 120 keV.
MaterialAmounts Decompose(XRayMaterial material)
{
  Eigen::MatrixXd basis(17, 2);
  Eigen::VectorXd wanted(17);
  for (int i = 0; i < 17; ++i)
  {
    const double energy = 40.0 + 5.0 * i;
    const Eigen::Array3d mu = BasisCoefficients(energy);
    wanted[i] = LinearAttenuation(material, energy);
    basis.row(i) << mu[0], mu[2];
  }
  const Eigen::Vector2d share = basis.colPivHouseholderQr().solve(wanted);
  return { static_cast<float>(share[0]), 0.0f, static_cast<float>(share[1]) };
}

/// Weights of a blur by three neighbours that adds the variance, in cells.
std::vector<float> BlurPasses(double variance)
{
  const int passes = static_cast<int>(std::ceil(variance / 0.5));
  return std::vector<float>(passes, static_cast<float>(0.5 * variance / std::max(1, passes)));
}

/// [outer][inner] values along one axis; edge cells repeat.
void BlurAlong(std::vector<float>& values, int outer, int stride, int count, int jump, float weight)
{
  std::vector<float> line(count + 2);
  for (int o = 0; o < outer; ++o)
  {
    float* first = &values[static_cast<std::size_t>(o) * stride];
    for (int i = 0; i < count; ++i)
    {
      line[i + 1] = first[static_cast<std::size_t>(i) * jump];
    }
    line[0] = line[1];
    line[count + 1] = line[count];
    for (int i = 0; i < count; ++i)
    {
      first[static_cast<std::size_t>(i) * jump] =
        line[i + 1] + weight * (line[i] - 2.0f * line[i + 1] + line[i + 2]);
    }
  }
}
}

TubeSpectrum::TubeSpectrum(double kilovolts, double aluminium)
{
  const double anode = AnodePath * std::pow(kilovolts / 120.0, 2);
  const auto filtered = [&](double energy)
  {
    return std::exp(-MassAttenuation("W", energy) * TungstenDensity * anode -
      MassAttenuation("Al", energy) * AluminiumDensity * 0.1 * aluminium);
  };
  const auto add = [&](double energy, double number)
  {
    const auto bin = static_cast<std::size_t>((energy - MinimumEnergy) / BinWidth);
    while (this->energies.size() <= bin)
    {
      this->energies.push_back(
        MinimumEnergy + BinWidth * (static_cast<double>(this->energies.size()) + 0.5));
      this->photons.push_back(0.0);
    }
    this->photons[bin] += number;
  };
  constexpr double step = 0.5;
  for (double energy = MinimumEnergy + 0.5 * step; energy < kilovolts; energy += step)
  {
    add(energy, Output * (kilovolts / energy - 1.0) * step * filtered(energy));
  }
  if (kilovolts > KEdge)
  {
    // K alpha 1 and 2, K beta 1 and 2.
    constexpr double lines[] = { 59.32, 57.98, 67.24, 69.07 };
    constexpr double shares[] = { 0.50, 0.29, 0.165, 0.045 };
    const double yield = KYield * std::pow(kilovolts / KEdge - 1.0, 1.63);
    for (int i = 0; i < 4; ++i)
    {
      add(lines[i], yield * shares[i] * filtered(lines[i]));
    }
  }
}

ScannerPhysics::ScannerPhysics(const ScannerSettings& settings)
  : Settings(settings)
{
  settings.Validate();
  const TubeSpectrum spectrum(settings.kilovolts, settings.aluminium);
  this->Energies = spectrum.energies;
  const auto bins = static_cast<int>(this->Energies.size());
  this->Coefficients.resize(bins, BasisMaterials);
  this->Weights.resize(bins, settings.channels);
  const double cell = settings.channelPitch * settings.rowPitch * settings.fill * settings.fill;
  const double exposure =
    settings.milliamperes * settings.turnTime / settings.viewsPerTurn; // mAs of a view
  const double nearer = 1000.0 / settings.sourceToDetector;
  for (int k = 0; k < bins; ++k)
  {
    this->Coefficients.row(k) = BasisCoefficients(this->Energies[k]).transpose();
    const double aluminium = 0.1 * MassAttenuation("Al", this->Energies[k]) * AluminiumDensity;
    for (int c = 0; c < settings.channels; ++c)
    {
      this->Weights(k, c) = static_cast<float>(spectrum.photons[k] * exposure * cell * nearer *
        nearer * std::exp(-aluminium * BowTie(settings.ColumnAngle(c))));
    }
  }
  this->AirSignal.resize(settings.channels);
  for (int c = 0; c < settings.channels; ++c)
  {
    this->AirSignal[c] = static_cast<float>(this->Signal(c, MaterialAmounts::Zero()).mean);
  }

  // Behind water on the central ray: what a layer's Hounsfield units are measured with.
  this->Detected.resize(bins);
  const int middle = settings.channels / 2;
  for (int k = 0; k < bins; ++k)
  {
    this->Detected[k] = this->Energies[k] * this->Weights(k, middle) *
      std::exp(-this->Coefficients(k, 0) * ReferenceWater);
  }
  this->Detected /= this->Detected.sum();

  constexpr int samples = 61;
  this->Correction.resize(CorrectionDegree + 2, settings.channels);
  Eigen::MatrixXd powers(samples - 1, CorrectionDegree);
  Eigen::VectorXd wanted(samples - 1);
  for (int c = 0; c < settings.channels; ++c)
  {
    double farthest = 0.0;
    for (int i = 1; i < samples; ++i)
    {
      const double water = LongestWater * i / (samples - 1);
      const double signal = this->Signal(c, { static_cast<float>(water), 0.0f, 0.0f }).mean;
      farthest = std::log(this->AirSignal[c] / signal);
      double power = 1.0;
      for (int d = 0; d < CorrectionDegree; ++d)
      {
        power *= farthest;
        powers(i - 1, d) = power / water; // errors count as shares of the path
      }
      wanted[i - 1] = 1.0;
    }
    this->Correction.col(c).head(CorrectionDegree) = powers.colPivHouseholderQr().solve(wanted);
    this->Correction(CorrectionDegree, c) = farthest;
    // Beyond the fit: straight on.
    double slope = 0.0;
    for (int d = 0; d < CorrectionDegree; ++d)
    {
      slope += (d + 1) * this->Correction(d, c) * std::pow(farthest, d);
    }
    this->Correction(CorrectionDegree + 1, c) = slope;
  }

  const double magnified = settings.sourceToDetector / settings.sourceToAxis - 1.0;
  const auto variance = [&](double pitch, double spot)
  {
    const double width = pitch * settings.fill;
    const double sigma = spot * magnified / 2.3548;
    return (width * width / 12.0 + sigma * sigma) / (pitch * pitch);
  };
  this->ColumnBlur = BlurPasses(variance(settings.channelPitch, settings.focalSpot));
  // The spot is longer than it is wide on the anode, and shorter as the detector sees it.
  this->RowBlur = BlurPasses(variance(settings.rowPitch, 0.62 * settings.focalSpot));
}

double ScannerPhysics::Hounsfield(const MaterialAmounts& amounts) const
{
  const Eigen::Array3d mu =
    (this->Coefficients.colwise() * this->Detected).colwise().sum().transpose();
  return 1000.0 * ((mu * amounts.cast<double>()).sum() / mu[0] - 1.0);
}

CellSignal ScannerPhysics::Signal(int column, const MaterialAmounts& path) const
{
  CellSignal signal{ 0.0, 0.0 };
  for (std::size_t k = 0; k < this->Energies.size(); ++k)
  {
    const double depth = (this->Coefficients.row(k).transpose() * path.cast<double>()).sum();
    const double energy = this->Energies[k] * this->Weights(k, column) * std::exp(-depth);
    signal.mean += energy;
    signal.variance += this->Energies[k] * energy;
  }
  return signal;
}

double ScannerPhysics::DetectedEnergy(int column, const MaterialAmounts& path) const
{
  const CellSignal signal = this->Signal(column, path);
  return signal.variance / signal.mean;
}

double ScannerPhysics::Photons(int column, const MaterialAmounts& path) const
{
  double number = 0.0;
  for (std::size_t k = 0; k < this->Energies.size(); ++k)
  {
    const double depth = (this->Coefficients.row(k).transpose() * path.cast<double>()).sum();
    number += this->Weights(k, column) * std::exp(-depth);
  }
  return number;
}

double ScannerPhysics::WaterPath(int column, double logSignal) const
{
  const double farthest = this->Correction(CorrectionDegree, column);
  const double inside = std::min(logSignal, farthest);
  double path = 0.0;
  for (int d = CorrectionDegree - 1; d >= 0; --d)
  {
    path = (path + this->Correction(d, column)) * inside;
  }
  return path + (logSignal - inside) * this->Correction(CorrectionDegree + 1, column);
}

void ScannerPhysics::Blur(std::vector<float>& values) const
{
  const int rows = this->Settings.rows;
  const int columns = this->Settings.channels;
  for (const float weight : this->ColumnBlur)
  {
    BlurAlong(values, rows, 1, columns, rows, weight);
  }
  for (const float weight : this->RowBlur)
  {
    BlurAlong(values, columns, rows, rows, 1, weight);
  }
}

void ScannerPhysics::Transmit(const ViewPaths& paths, TransmittedView& view) const
{
  const ScannerSettings& s = this->Settings;
  const int rows = s.rows;
  const std::size_t cells = static_cast<std::size_t>(s.channels) * rows;
  view.share.resize(cells);
  view.quantum.resize(cells);
  Eigen::ArrayXf depth(rows);
  Eigen::ArrayXf mean(rows);
  Eigen::ArrayXf variance(rows);
  const Eigen::ArrayXXf mu = this->Coefficients.cast<float>();
  for (int c = 0; c < s.channels; ++c)
  {
    const std::size_t first = static_cast<std::size_t>(c) * rows;
    const auto path = [&](int m)
    { return Eigen::Map<const Eigen::ArrayXf>(paths[m].data() + first, rows); };
    mean.setZero();
    variance.setZero();
    const bool iodine = path(1).maxCoeff() > 0.0f;
    const bool calcium = path(2).abs().maxCoeff() > 0.0f;
    for (int k = 0; k < mu.rows(); ++k)
    {
      const auto energy = static_cast<float>(this->Energies[k]);
      depth = -mu(k, 0) * path(0);
      if (iodine)
      {
        depth -= mu(k, 1) * path(1);
      }
      if (calcium)
      {
        depth -= mu(k, 2) * path(2);
      }
      depth = depth.exp() * (energy * this->Weights(k, c));
      mean += depth;
      variance += energy * depth;
    }
    Eigen::Map<Eigen::ArrayXf>(&view.share[first], rows) = mean / this->AirSignal[c];
    Eigen::Map<Eigen::ArrayXf>(&view.quantum[first], rows) = variance / mean.max(1e-20f);
  }
  this->Blur(view.share);
}

void ScannerPhysics::Detect(
  const TransmittedView& view, double current, std::uint64_t key, float* result) const
{
  const ScannerSettings& s = this->Settings;
  const int rows = s.rows;
  const double electronic = s.electronicNoise / s.electronsPerKeV;
  for (int c = 0; c < s.channels; ++c)
  {
    const double air = this->AirSignal[c] * current;
    for (int r = 0; r < rows; ++r)
    {
      const std::size_t at = static_cast<std::size_t>(c) * rows + r;
      double signal = air * view.share[at];
      if (s.noise != 0)
      {
        const std::uint64_t cellKey = MixBits(key + at);
        signal = view.quantum[at] * PoissonNumber(signal / view.quantum[at], cellKey) +
          electronic * RandomStream(cellKey, 1).Normal();
      }
      // A cell that saw nothing is taken to have seen a photon.
      signal = std::max(signal, static_cast<double>(view.quantum[at]));
      result[at] = static_cast<float>(this->WaterPath(c, std::log(air / signal)));
    }
  }
}

std::array<double, 2> ScannerPhysics::Variance(
  const TransmittedView& view, int column, int row) const
{
  const std::size_t at = static_cast<std::size_t>(column) * this->Settings.rows + row;
  const double air = this->AirSignal[column];
  const double signal = air * view.share[at];
  const double log = std::log(air / signal);
  constexpr double step = 1e-3;
  const double slope = (this->WaterPath(column, log + step) - this->WaterPath(column, log)) / step;
  const double electronic = this->Settings.electronicNoise / this->Settings.electronsPerKeV;
  const double unit = slope * slope / (signal * signal);
  return { unit * signal * view.quantum[at], unit * electronic * electronic };
}

double PoissonNumber(double mean, std::uint64_t key)
{
  RandomStream random(key);
  if (mean > NormalFrom)
  {
    return std::max(0.0, std::round(mean + std::sqrt(mean) * random.Normal()));
  }
  // Events of a unit rate until the time is over.
  int number = -1;
  for (double time = 0.0; time < mean || number < 0; ++number)
  {
    time -= std::log(random.Uniform());
    if (time >= mean)
    {
      ++number;
      break;
    }
  }
  return number;
}

TissueMaterials::TissueMaterials()
  : Reference(ScannerSettings{})
  , Adipose(Decompose(XRayMaterial::Adipose))
  , SoftTissue(Decompose(XRayMaterial::SoftTissue))
  , BloodAmounts(Decompose(XRayMaterial::Blood))
  , Steel(Decompose(XRayMaterial::StainlessSteel))
{
}

MaterialAmounts TissueMaterials::Scaled(const MaterialAmounts& tissue, double hounsfield) const
{
  return tissue *
    static_cast<float>((1000.0 + hounsfield) / (1000.0 + this->Reference.Hounsfield(tissue)));
}

MaterialAmounts TissueMaterials::Lung(double hounsfield) const
{
  return this->Scaled(this->SoftTissue, hounsfield);
}

MaterialAmounts TissueMaterials::Fat(double hounsfield) const
{
  return this->Scaled(this->Adipose, hounsfield);
}

MaterialAmounts TissueMaterials::Soft(double hounsfield) const
{
  return this->Scaled(this->SoftTissue, hounsfield);
}

MaterialAmounts TissueMaterials::Muscle(double hounsfield) const
{
  MaterialAmounts amounts = this->Scaled(this->SoftTissue, std::min(55.0, hounsfield));
  const double rest = hounsfield - this->Reference.Hounsfield(amounts);
  const double unit = this->Reference.Hounsfield({ 0.0f, 1.0f, 0.0f }) + 1000.0;
  amounts[1] = static_cast<float>(std::max(0.0, rest / unit));
  return amounts;
}

MaterialAmounts TissueMaterials::Blood(double hounsfield) const
{
  const double own = this->Reference.Hounsfield(this->BloodAmounts);
  if (hounsfield <= own)
  {
    return this->Scaled(this->BloodAmounts, hounsfield);
  }
  MaterialAmounts amounts = this->BloodAmounts;
  const double unit = this->Reference.Hounsfield({ 0.0f, 1.0f, 0.0f }) + 1000.0;
  amounts[1] = static_cast<float>((hounsfield - own) / unit);
  return amounts;
}

MaterialAmounts TissueMaterials::Calcified(double hounsfield) const
{
  // Of soft tissue the volume that the mineral leaves (3.16 g/cm^3).
  const MaterialAmounts tissue = this->Scaled(this->SoftTissue, 55.0);
  const MaterialAmounts milligram =
    MaterialAmounts(0.0f, 0.0f, 1.0f) - tissue * static_cast<float>(1e-3 / 3.16);
  const double unit = this->Reference.Hounsfield(milligram) + 1000.0;
  return tissue + milligram * static_cast<float>(std::max(0.0, (hounsfield - 55.0) / unit));
}
}
