// Our filtered back-projection beside plastimatch's (FDK, Feldkamp, Davis, Kress, J Opt Soc Am A 1984;1:612), of the same
// views of things that stand still: a table in Markdown on stdout; the exit code is 1 when a limit is missed, 125 when
// plastimatch is not installed.
//
// plastimatch 1.9.4 (a program of its own, BSD-like licence) reads flat panels: ours, on an arc, is resampled. What its source and
// impulses that it was given tell: the ramp is |k| of a discrete Fourier transform over the panel's columns times (1 + cos(pi k/K)) / 2,
// 0 at k = 0; views have to be weighted with the cosine of their rays beforehand; a voxel takes the nearest cell, times
// sqrt(3) / views; what comes out is 1000 (v / 40 - 0.167) / 0.167. With --intensity-scale as below these are HU.

#include "ScannerReconstruction.h"

#include <Eigen/Cholesky>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double Pi = 3.14159265358979323846;
constexpr int NotInstalled = 125;
constexpr double BodyRadius = 80.0; // mm
constexpr double RodRadius = 9.0;
const Eigen::Vector2d Rod(31.0, -22.0);
constexpr double HoleRadius = 12.0;
const Eigen::Vector2d Hole(-35.0, 28.0);

// What has to be reached.
constexpr double MaximumUniform = 4.0; // HU, mean difference in water
constexpr double MaximumInserts = 1.0; // % of an insert's contrast
constexpr double MaximumShift = 0.05;  // mm
constexpr double MaximumEdge =
  0.1; // mm, between the widths of the rod's edge, less what the windows differ
constexpr double MinimumAlike = 0.95;   // correlation of balls and oblique vessels
constexpr double MaximumMirrored = 0.8; // the same, of what is mirrored: that the measure can tell

struct Settings
{
  bool quick = false;
  std::string folder;
};

struct Scene
{
  ScannerSettings scanner;
  ImageGrid grid;
  int panelColumns =
    8192; ///< far wider than the body: the ramp's value at frequency 0 is off by 1 / width^2
  int panelRows = 36; ///< a quarter of ours: what the slices need
};

Scene MakeScene(bool quick)
{
  Scene scene;
  ScannerSettings& s = scene.scanner;
  const int coarse = quick ? 2 : 1;
  s.channels /= coarse;
  s.channelPitch *= coarse;
  s.viewsPerTurn = quick ? 360 : 492;
  s.rows = 24 / coarse;
  s.rowPitch *= coarse;
  s.noise = 0;
  s.kernel = ReconstructionKernel::Sharp; // the nearest to plastimatch's window
  const double spacing = quick ? 0.9 : 0.6;
  const int size = quick ? 192 : 288;
  const int slices = quick ? 7 : 5;
  scene.grid.extent = { 0, size - 1, 0, size - 1, 0, slices - 1 };
  scene.grid.spacing = Vector3(spacing, spacing, 1.0);
  scene.grid.origin = -0.5 *
    Vector3(spacing * (size - 1), spacing * (size - 1), scene.grid.spacing[2] * (slices - 1));
  scene.panelColumns /= coarse;

  return scene;
}

/// Water with inserts, none of them at the same place in a mirror.
void Project(const ScannerProjector& projector, const ScannerView& view, ViewPaths& paths)
{
  projector.Clear(paths);
  const auto more = [](float share) { return MaterialAmounts{ share, 0.0F, 0.0F }; };
  const auto along = [](double x, double y, double radius, const MaterialAmounts& amounts) {
    return ScannedTube{ { x, y, -200.0 }, { x, y, 200.0 }, radius, radius, false, amounts };
  };
  projector.Add({ along(0.0, 0.0, BodyRadius, more(1.0F)) }, {}, view, paths);
  // What is within the body is a difference from it: a rod, air, oblique vessels, balls.
  projector.Add({ along(Rod[0], Rod[1], RodRadius, more(0.4F)),
                  along(Hole[0], Hole[1], HoleRadius, more(-0.8F)),
                  { { -10.0, -50.0, -30.0 }, { 25.0, 40.0, 30.0 }, 1.5, 1.5, false, more(0.4F) },
                  { { -60.0, -12.0, -8.0 }, { -5.0, 20.0, 9.0 }, 1.0, 2.5, false, more(0.4F) } },
    { { { 52.0, 24.0, 1.2 }, 4.0, more(0.8F) }, { { 6.0, 58.0, -1.5 }, 3.0, more(0.8F) } }, view,
    paths);
}

/// Between the values at -1, 0, 1 and 2: the polynomial through all four.
double Cubic(double a, double b, double c, double d, double t)
{
  return a * -t * (t - 1.0) * (t - 2.0) / 6.0 + b * (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 -
    c * (t + 1.0) * t * (t - 2.0) / 2.0 + d * (t + 1.0) * t * (t - 1.0) / 6.0;
}

struct Panel
{
  double columnPitch; ///< mm; fine, since a voxel takes the nearest cell
  double rowPitch;
};

Panel PanelOf(const Scene& scene)
{
  return { 0.5 * scene.scanner.channelPitch, 0.25 * scene.scanner.rowPitch };
}

/// What a flat panel behind the same rays has, with the cosine of each ray.
std::vector<float> Flattened(const Scene& scene, const std::vector<float>& values)
{
  const ScannerSettings& s = scene.scanner;
  const Panel panel = PanelOf(scene);
  const auto at = [&](int column, int row)
  {
    // Rows beyond the last are as the last: what is scanned hardly changes along the axis there.
    return column < 0 || column >= s.channels
      ? 0.0
      : static_cast<double>(
          values[static_cast<std::size_t>(column) * s.rows + std::clamp(row, 0, s.rows - 1)]);
  };
  std::vector<float> flat(static_cast<std::size_t>(scene.panelColumns) * scene.panelRows);
  for (int c = 0; c < scene.panelColumns; ++c)
  {
    const double u = (c - 0.5 * (scene.panelColumns - 1)) * panel.columnPitch;
    const double fan = std::atan2(u, s.sourceToDetector);
    const double column = fan / s.ColumnPitch() + s.MiddleColumn();
    if (column < -1.0 || column > s.channels)
    {
      continue;
    }
    const int before = static_cast<int>(std::floor(column));
    for (int r = 0; r < scene.panelRows; ++r)
    {
      const double v = (r - 0.5 * (scene.panelRows - 1)) * panel.rowPitch;
      const double row = v * std::cos(fan) / s.rowPitch + 0.5 * (s.rows - 1);
      const int below = static_cast<int>(std::floor(row));
      double lines[4];
      for (int k = 0; k < 4; ++k)
      {
        lines[k] = Cubic(at(before - 1, below - 1 + k), at(before, below - 1 + k),
          at(before + 1, below - 1 + k), at(before + 2, below - 1 + k), column - before);
      }
      const double cosine = s.sourceToDetector / std::hypot(s.sourceToDetector, u, v);
      flat[static_cast<std::size_t>(r) * scene.panelColumns + c] =
        static_cast<float>(cosine * Cubic(lines[0], lines[1], lines[2], lines[3], row - below));
    }
  }
  return flat;
}

/// An image and the text beside it: its middle, projection matrix, distances, the panel's normal.
void WriteView(const Scene& scene, const std::string& folder, int number, double angle,
  const std::vector<float>& flat)
{
  const ScannerSettings& s = scene.scanner;
  const Panel panel = PanelOf(scene);
  char name[32];
  std::snprintf(name, sizeof name, "/view%04d", number);
  std::ofstream image(folder + name + ".pfm", std::ios::binary);
  image << "Pf\n" << scene.panelColumns << " " << scene.panelRows << "\n-1\n";
  image.write(reinterpret_cast<const char*>(flat.data()),
    static_cast<std::streamsize>(flat.size() * sizeof(float)));
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  // Our columns go with the angle at the tube, from x to y, looking from it to the axis.
  const Vector3 right(sine, -cosine, 0.0);
  std::ofstream text(folder + name + ".txt");
  text.precision(12);
  const auto line = [&text](const Vector3& v, double last)
  { text << v[0] << " " << v[1] << " " << v[2] << " " << last << "\n"; };
  text << 0.5 * (scene.panelColumns - 1) << " " << 0.5 * (scene.panelRows - 1) << "\n";
  line(right / panel.columnPitch, 0.0);
  line(Vector3::UnitZ() / panel.rowPitch, 0.0);
  line(Vector3(-cosine, -sine, 0.0) / s.sourceToDetector, s.sourceToAxis / s.sourceToDetector);
  text << s.sourceToAxis << "\n" << s.sourceToDetector << "\n";
  text << cosine << " " << sine << " 0\n";
  image.close();
  text.close();
  if (!image || !text)
  {
    throw std::runtime_error(folder + name + ": cannot write it");
  }
}

/// 32-bit numbers of an uncompressed MetaImage, x fastest.
std::vector<float> ReadFloats(const std::string& path, std::size_t count)
{
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line) && line.rfind("ElementDataFile", 0) != 0)
  {
  }
  std::vector<float> values(count);
  file.read(
    reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(float)));
  if (!file || file.peek() != std::ifstream::traits_type::eof())
  {
    throw std::runtime_error(path + ": not an image of " + std::to_string(count) + " numbers");
  }
  return values;
}

struct Image
{
  std::array<int, 3> size;
  Vector3 spacing;
  std::vector<float> values; ///< HU, x fastest

  double At(int i, int j, int k) const
  {
    return this->values[(static_cast<std::size_t>(k) * this->size[1] + j) * this->size[0] + i];
  }
  Eigen::Vector2d Place(int i, int j) const
  {
    return { (i - 0.5 * (this->size[0] - 1)) * this->spacing[0],
      (j - 0.5 * (this->size[1] - 1)) * this->spacing[1] };
  }
};

Image EmptyImage(const ImageGrid& grid)
{
  const std::array<int, 6>& e = grid.extent;
  Image image{ { e[1] + 1, e[3] + 1, e[5] + 1 }, grid.spacing, {} };
  image.values.resize(static_cast<std::size_t>(image.size[0]) * image.size[1] * image.size[2]);
  return image;
}

struct Pair
{
  Image ours;
  Image theirs;
};

Pair Reconstruct(const Scene& scene, const std::string& folder)
{
  const ScannerSettings& s = scene.scanner;
  const ScannerProjector projector(s);
  const HalfScanReconstruction reconstruction(s, s.kernel);
  std::vector<FilteredView> views;
  ViewPaths paths;
  for (int v = 0; v < s.viewsPerTurn; ++v)
  {
    const double angle = v * s.ViewAngle();
    Project(projector, { angle, Vector3::Zero() }, paths);
    WriteView(scene, folder, v, angle, Flattened(scene, paths[0]));
    if (v < s.HalfScanViews())
    {
      FilteredView& view =
        views.emplace_back(FilteredView{ angle, 0.0, std::vector<float>(paths[0].size()) });
      reconstruction.Filter(v, 1.0F, paths[0].data(), { 0, s.channels - 1 }, view.values.data());
    }
  }
  Pair pair{ EmptyImage(scene.grid), EmptyImage(scene.grid) };
  const std::array<int, 3>& size = pair.ours.size;
  std::vector<float> lines(pair.ours.values.size());
  reconstruction.BackProject(views, Vector3::Zero(), scene.grid, lines.data(), {});
  for (int k = 0; k < size[2]; ++k)
  {
    for (std::size_t n = 0; n < static_cast<std::size_t>(size[0]) * size[1]; ++n)
    {
      pair.ours.values[k * static_cast<std::size_t>(size[0]) * size[1] + n] =
        1000.0F * (lines[n * size[2] + k] - 1.0F);
    }
  }

  const double columnAtAxis = PanelOf(scene).columnPitch * s.sourceToAxis / s.sourceToDetector;
  const double scale = 40.0 * 0.167 * Pi / (std::sqrt(3.0) * scene.panelColumns * columnAtAxis);
  std::ostringstream command;
  command.precision(9);
  command << "plastimatch fdk -I '" << folder << "' -O '" << folder << "/theirs.mha' -s " << scale
          << " -r '" << size[0] << " " << size[1] << " " << size[2] << "' -z '"
          << size[0] * scene.grid.spacing[0] << " " << size[1] * scene.grid.spacing[1] << " "
          << size[2] * scene.grid.spacing[2] << "' >'" << folder << "/log' 2>&1";
  if (std::system(command.str().c_str()) != 0) // NOLINT(cert-env33-c)
  {
    throw std::runtime_error("failed: " + command.str());
  }
  pair.theirs.values = ReadFloats(folder + "/theirs.mha", pair.theirs.values.size());
  return pair;
}

/// Mean and standard deviation.
struct Spread
{
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;

  void Add(double value)
  {
    this->sum += value;
    this->squares += value * value;
    this->count += 1.0;
  }
  double Mean() const { return this->sum / this->count; }
  double Deviation() const
  {
    return std::sqrt(std::max(0.0, this->squares / this->count - std::pow(this->Mean(), 2)));
  }
};

/// Of the voxels in a circle of the middle slice.
Spread InCircle(const Image& image, const Eigen::Vector2d& middle, double radius)
{
  Spread spread;
  for (int j = 0; j < image.size[1]; ++j)
  {
    for (int i = 0; i < image.size[0]; ++i)
    {
      if ((image.Place(i, j) - middle).norm() <= radius)
      {
        spread.Add(image.At(i, j, image.size[2] / 2));
      }
    }
  }
  return spread;
}

/// Width of the rod's edge from 10 to 90 %, mm, from all voxels around it.
double EdgeWidth(const Image& image)
{
  constexpr double step = 0.1;
  std::vector<Spread> rings(static_cast<std::size_t>(14.0 / step));
  for (int j = 0; j < image.size[1]; ++j)
  {
    for (int i = 0; i < image.size[0]; ++i)
    {
      const auto ring = static_cast<std::size_t>((image.Place(i, j) - Rod).norm() / step);
      if (ring < rings.size())
      {
        rings[ring].Add(image.At(i, j, image.size[2] / 2));
      }
    }
  }
  const double inside = InCircle(image, Rod, 0.6 * RodRadius).Mean();
  Spread outside;
  for (std::size_t n = static_cast<std::size_t>((RodRadius + 3.0) / step); n < rings.size(); ++n)
  {
    outside.Add(rings[n].Mean());
  }
  // From the last ring above a level to the first below.
  const auto crossing = [&](double share)
  {
    const double level = outside.Mean() + share * (inside - outside.Mean());
    std::size_t n = static_cast<std::size_t>((RodRadius - 3.0) / step);
    while (n + 1 < rings.size() && rings[n + 1].Mean() >= level)
    {
      ++n;
    }
    return step *
      (static_cast<double>(n) + 0.5 +
        (rings[n].Mean() - level) / (rings[n].Mean() - rings[n + 1].Mean()));
  };
  return crossing(0.1) - crossing(0.9);
}

/// The same for a straight edge, of what windows and interpolation leave of each frequency.
/// @param modulation  of a frequency, as a share of Nyquist's for our columns
double DesignedEdgeWidth(
  const ScannerSettings& settings, const std::function<double(double)>& modulation)
{
  const double nyquist = 0.5 / (settings.ColumnPitch() * settings.sourceToAxis);
  const auto edge = [&](double x)
  {
    constexpr int steps = 400;
    double sum = 0.5;
    for (int k = 0; k < steps; ++k)
    {
      const double share = 2.0 * (k + 0.5) / steps;
      sum +=
        modulation(share) * std::sin(2.0 * Pi * share * nyquist * x) / (Pi * share) * 2.0 / steps;
    }
    return sum;
  };
  double at = 0.0;
  while (edge(at) < 0.9)
  {
    at += 0.005;
  }
  return 2.0 * at;
}

double Sinc(double x)
{
  return x == 0.0 ? 1.0 : std::sin(Pi * x) / (Pi * x);
}

/// Of the edge's width, theirs and ours.
double DesignedDifference(const ScannerSettings& settings)
{
  const double ours = DesignedEdgeWidth(settings,
    [&](double share)
    {
      const double line = Sinc(0.5 * share);
      return share > 1.0 ? 0.0
                         : line * line * HalfScanReconstruction::Window(settings.kernel, share);
    });
  const double theirs = DesignedEdgeWidth(settings,
    [](double share)
    {
      // Cells of the panel lie about a quarter of a column from one of ours.
      constexpr double t = 0.25;
      const double even = Cubic(std::cos(Pi * share * (1.0 + t)), std::cos(Pi * share * t),
        std::cos(Pi * share * (1.0 - t)), std::cos(Pi * share * (2.0 - t)), t);
      return even * Sinc(0.25 * share) * 0.5 * (1.0 + std::cos(0.5 * Pi * share));
    });
  return theirs - ours;
}

/// How far theirs is off ours, mm: theirs - ours = -shift . gradient in the least squares, and a constant.
Vector3 ShiftOf(const Pair& pair)
{
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  const Image& ours = pair.ours;
  const Image& theirs = pair.theirs;
  for (int k = 1; k + 1 < ours.size[2]; ++k)
  {
    for (int j = 1; j + 1 < ours.size[1]; ++j)
    {
      for (int i = 1; i + 1 < ours.size[0]; ++i)
      {
        if (ours.Place(i, j).norm() > BodyRadius + 4.0)
        {
          continue;
        }
        const auto mean = [&](int a, int b, int c)
        { return 0.5 * (ours.At(i + a, j + b, k + c) + theirs.At(i + a, j + b, k + c)); };
        const Eigen::Vector4d row((mean(1, 0, 0) - mean(-1, 0, 0)) / (2.0 * ours.spacing[0]),
          (mean(0, 1, 0) - mean(0, -1, 0)) / (2.0 * ours.spacing[1]),
          (mean(0, 0, 1) - mean(0, 0, -1)) / (2.0 * ours.spacing[2]), 1.0);
        normal += row * row.transpose();
        right -= row * (theirs.At(i, j, k) - ours.At(i, j, k));
      }
    }
  }
  return normal.ldlt().solve(right).head<3>();
}

/// Of ours with theirs, or with theirs mirrored along an axis; what is the same all along z does not count.
double Correlation(const Pair& pair, int mirrored)
{
  double sums[5] = {};
  double count = 0.0;
  const std::array<int, 3>& n = pair.ours.size;
  const auto flip = [mirrored](Eigen::Vector2d middle)
  {
    if (mirrored == 0 || mirrored == 1)
    {
      middle[mirrored] = -middle[mirrored];
    }
    return middle;
  };
  for (int k = 0; k < n[2]; ++k)
  {
    for (int j = 0; j < n[1]; ++j)
    {
      for (int i = 0; i < n[0]; ++i)
      {
        const Eigen::Vector2d place = pair.ours.Place(i, j);
        const auto near = [&](const Eigen::Vector2d& middle, double radius) {
          return (place - middle).norm() < radius + 4.0 ||
            (place - flip(middle)).norm() < radius + 4.0;
        };
        if (place.norm() > BodyRadius - 4.0 || near(Rod, RodRadius) || near(Hole, HoleRadius))
        {
          continue;
        }
        const double a = pair.ours.At(i, j, k);
        const double b = pair.theirs.At(mirrored == 0 ? n[0] - 1 - i : i,
          mirrored == 1 ? n[1] - 1 - j : j, mirrored == 2 ? n[2] - 1 - k : k);
        sums[0] += a;
        sums[1] += b;
        sums[2] += a * a;
        sums[3] += b * b;
        sums[4] += a * b;
        count += 1.0;
      }
    }
  }
  return (sums[4] - sums[0] * sums[1] / count) /
    std::sqrt((sums[2] - sums[0] * sums[0] / count) * (sums[3] - sums[1] * sums[1] / count));
}

class Table
{
public:
  Table()
  {
    std::printf("| what | ours | plastimatch | between | asked | |\n|---|---|---|---|---|---|\n");
  }

  void Row(const char* what, double ours, double theirs, const char* format, double limit,
    double expected = 0.0)
  {
    const double between = theirs - ours - expected;
    this->Print(what, Word(format, ours), Word(format, theirs), Word(format, between),
      Word(format, limit), std::abs(between) <= limit);
  }
  void Between(const char* what, double value, const char* format, double limit, bool met)
  {
    this->Print(what, "", "", Word(format, value), Word(format, limit), met);
  }
  bool Met() const { return this->AllMet; }

private:
  static std::string Word(const char* format, double value)
  {
    char word[40];
    std::snprintf(word, sizeof word, format, value); // NOLINT(clang-diagnostic-format-nonliteral)
    return word;
  }
  void Print(const char* what, const std::string& ours, const std::string& theirs,
    const std::string& between, const std::string& limit, bool met)
  {
    std::printf("| %s | %s | %s | %s | %s | %s |\n", what, ours.c_str(), theirs.c_str(),
      between.c_str(), limit.c_str(), met ? "met" : "**MISSED**");
    this->AllMet = this->AllMet && met;
  }

  bool AllMet = true;
};

bool Compare(const Pair& pair, const ScannerSettings& scanner)
{
  const Image& ours = pair.ours;
  const Image& theirs = pair.theirs;
  Table table;
  const auto circle = [&](const char* what, double x, double y, double radius, double contrast)
  {
    const double limit =
      contrast == 0.0 ? MaximumUniform : MaximumUniform + 0.01 * MaximumInserts * contrast;
    table.Row(what, InCircle(ours, { x, y }, radius).Mean(),
      InCircle(theirs, { x, y }, radius).Mean(), "%.1f", limit);
  };
  circle("water in the middle, HU", 0.0, 12.0, 5.0, 0.0);
  circle("water, 60 mm to the left", -60.0, 18.0, 6.0, 0.0);
  circle("water, 68 mm down", 20.0, -65.0, 6.0, 0.0);
  circle("air beside the body", 64.0, 64.0, 4.0, 0.0);
  circle("rod of 400 HU", Rod[0], Rod[1], 6.0, 400.0);
  circle("hole of -800 HU", Hole[0], Hole[1], 8.0, 800.0);
  circle("ball of 8 mm, 800 HU", 52.0, 24.0, 1.6, 800.0);
  table.Row("edge of the rod, 10 to 90 %, mm; between: less what the windows differ",
    EdgeWidth(ours), EdgeWidth(theirs), "%.2f", MaximumEdge, DesignedDifference(scanner));
  const Vector3 shift = ShiftOf(pair);
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::string what = std::string("shift along ") + "xyz"[axis] + ", mm";
    table.Between(
      what.c_str(), shift[axis], "%.3f", MaximumShift, std::abs(shift[axis]) <= MaximumShift);
  }
  const double alike = Correlation(pair, -1);
  table.Between("correlation, at least", alike, "%.4f", MinimumAlike, alike >= MinimumAlike);
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::string what = std::string("the same mirrored along ") + "xyz"[axis] + ", at most";
    const double mirrored = Correlation(pair, axis);
    table.Between(what.c_str(), mirrored, "%.4f", MaximumMirrored, mirrored <= MaximumMirrored);
  }
  return table.Met();
}

bool Run(const Settings& settings)
{
  const Scene scene = MakeScene(settings.quick);
  const std::string views = settings.folder + "/views";
  std::filesystem::create_directories(views);
  const Pair pair = Reconstruct(scene, views);
  std::printf("%d views of %d x %d cells, slices of %d x %d pixels of %.1f mm.\n\n",
    scene.scanner.viewsPerTurn, scene.scanner.channels, scene.scanner.rows, pair.ours.size[0],
    pair.ours.size[1], pair.ours.spacing[0]);
  return Compare(pair, scene.scanner);
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Filtered back-projection beside plastimatch's, of the same views");
    Settings settings;
    program.add_flag("--quick", settings.quick, "Coarse views");
    program.add_option("--output", settings.folder, "Existing folder; what is in it stays")
      ->check(CLI::ExistingDirectory);
    CLI11_PARSE(program, argc, argv);
    if (std::system("plastimatch --version >/dev/null 2>&1") != 0) // NOLINT(cert-env33-c)
    {
      std::printf(
        "skipped: plastimatch is not installed (scripts/install-dependencies.sh --developer)\n");
      return NotInstalled;
    }
    std::string made;
    if (settings.folder.empty())
    {
      made = (std::filesystem::temp_directory_path() / "reconstructor-XXXXXX").string();
      if (mkdtemp(made.data()) == nullptr)
      {
        throw std::runtime_error("no room for a folder " + made);
      }
      settings.folder = made;
    }
    const bool met = Run(settings);
    if (!made.empty())
    {
      std::filesystem::remove_all(made);
    }
    return met ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-reconstructor: %s\n", error.what());
    return 2;
  }
}
