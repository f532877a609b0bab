#include "PhantomImage.h"

#include "CounterRandom.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Root2 = 1.41421356237309505;
constexpr std::int64_t NoiseMargin = 1024; ///< voxels around the image that the noise may reach
constexpr float Saturated = 4.0f; ///< standard deviations beyond which a blurred edge is flat

/// Integral of the standard normal density up to x, tabulated: exact to 1e-5, flat beyond 4.
class NormalIntegral
{
public:
  static float Of(float x)
  {
    if (x <= -Saturated)
    {
      return 0.0f;
    }
    if (x >= Saturated)
    {
      return 1.0f;
    }
    static const NormalIntegral table;
    const float position = (x + Saturated) * Scale;
    const int i = static_cast<int>(position);
    const float f = position - static_cast<float>(i);
    return table.Values[i] + f * (table.Values[i + 1] - table.Values[i]);
  }

private:
  static constexpr int Count = 1024;
  static constexpr float Scale = Count / (2.0f * Saturated);
  NormalIntegral()
  {
    for (int i = 0; i <= Count + 1; ++i)
    {
      const double x = i / static_cast<double>(Scale) - Saturated;
      this->Values[i] = static_cast<float>(0.5 * std::erfc(-x / Root2));
    }
    this->Values[0] = 0.0f;
    this->Values[Count] = this->Values[Count + 1] = 1.0f;
  }
  float Values[Count + 2];
};

/// The same as a polynomial, which the compiler can turn into vector code: exact to 8e-4.
inline float NormalIntegralPolynomial(float x)
{
  constexpr float end = 3.2f;
  x = x < -end ? -end : x;
  x = x > end ? end : x;
  const float y = x * x;
  return 0.5f +
    x *
    (0.39881853f +
      y *
        (-0.06597480f +
          y * (0.00940719f + y * (-9.2600785e-4f + y * (5.4292321e-5f - y * 1.3860833e-6f)))));
}

/// DiscResponse over disc radius and distance from the disc's rim.
class DiscTable
{
public:
  static constexpr double SmallestRadius = 0.25;
  static constexpr double LargestRadius = 8.0;
  static constexpr int RadiusSteps = 62; // of 0.125
  static constexpr int RimSteps = 96;    // of 0.125, from -8 to 4

  static const DiscTable& Instance()
  {
    static const DiscTable table;
    return table;
  }

  float operator()(float offset, float radius) const
  {
    if (radius > static_cast<float>(LargestRadius))
    {
      // Towards the half space the difference goes with the curvature.
      const float half = NormalIntegral::Of(radius - offset);
      const auto largest = static_cast<float>(LargestRadius);
      return half +
        ((*this)(std::max(0.0f, offset - radius + largest), largest) - half) * largest / radius;
    }
    float scale = 1.0f;
    if (radius < static_cast<float>(SmallestRadius))
    {
      // A thin disc answers in proportion to its area.
      const float ratio = radius / static_cast<float>(SmallestRadius);
      scale = ratio * ratio;
      offset += static_cast<float>(SmallestRadius) - radius;
      radius = static_cast<float>(SmallestRadius);
    }
    const float rim = (offset - radius + 8.0f) * 8.0f;
    if (rim >= static_cast<float>(RimSteps))
    {
      return 0.0f;
    }
    const float r = (radius - static_cast<float>(SmallestRadius)) * 8.0f;
    const int i = static_cast<int>(r);
    const int j = static_cast<int>(std::max(0.0f, rim));
    const float f = r - static_cast<float>(i);
    const float g = std::max(0.0f, rim) - static_cast<float>(j);
    const auto at = [this](int a, int b) { return this->Values[a * (RimSteps + 1) + b]; };
    return scale *
      ((1.0f - f) * ((1.0f - g) * at(i, j) + g * at(i, j + 1)) +
        f * ((1.0f - g) * at(i + 1, j) + g * at(i + 1, j + 1)));
  }

private:
  DiscTable()
  {
    this->Values.resize((RadiusSteps + 2) * (RimSteps + 1));
    for (int i = 0; i <= RadiusSteps + 1; ++i)
    {
      for (int j = 0; j <= RimSteps; ++j)
      {
        const double radius = SmallestRadius + 0.125 * i;
        const double offset = std::max(0.0, radius - 8.0 + 0.125 * j);
        this->Values[i * (RimSteps + 1) + j] =
          j == RimSteps ? 0.0f : static_cast<float>(Integrate(offset, radius));
      }
    }
  }

  static double Integrate(double offset, double radius)
  {
    // Rows of the disc: normal density across times the normal integral along.
    constexpr int rows = 128;
    double sum = 0.0;
    for (int row = 0; row < rows; ++row)
    {
      // Cosine spacing resolves the disc's flat top and bottom.
      const double angle = 3.14159265358979323846 * (row + 0.5) / rows;
      const double y = -radius * std::cos(angle);
      const double width = radius * std::sin(angle) * 3.14159265358979323846 / rows;
      const double half = radius * std::sin(angle);
      const double along =
        0.5 * (std::erf((half - offset) / Root2) + std::erf((half + offset) / Root2));
      sum += width * along * std::exp(-0.5 * y * y) * 0.3989422804014327;
    }
    return sum;
  }

  std::vector<float> Values;
};

constexpr float Muscle = 110.0f; // HU, enhanced myocardium
constexpr float Fat = -95.0f;

/**
 * The tissues around the vessels as a stack of layers in material coordinates. A shape gives a
 * signed distance (first order) and bounds of it over a ball, so that whole tiles inside or outside
 * a shape cost nothing.
 */
class Tissues
{
public:
  /// Neighbouring samples of a tile, in steps of four so that the compiler needs no rests.
  struct Row
  {
    static constexpr int Longest = 16;
    int count;
    float world[3][Longest];
    float heart[3][Longest];
  };

  struct Shape
  {
    enum Kind
    {
      Ellipsoid,
      Capsule, ///< round cone between two points
      Slab,    ///< half space
      Ring     ///< torus around the AV plane's section of the heart
    } kind;
    Vector3 a;      ///< centre | start | outward normal
    Vector3 b;      ///< radii | end | -
    double radius;  ///< - | start radius | offset along the normal | tube radius
    double radius2; ///< - | end radius | - | -
    bool heart;     ///< in heart coordinates (else world)
  };
  /// What a layer is of. Coronary arteries have a coat of fat or muscle that goes over the first two.
  enum class Content
  {
    Tissue,
    Chamber,
    GreatVessel
  };

  /// Product of shapes, each possibly its complement, painted with one value.
  struct Layer
  {
    int shapes[4];
    bool complement[4];
    int count;
    float value;
    float softness; ///< mm, added to the blur: trabeculae, fat septa
    Content content;
  };

  Tissues(const PhantomSettings& settings, const PhantomAnatomy& anatomy);

  /// Signed distance to a shape, mm, first order.
  double Distance(int shape, const Vector3& world, const Vector3& heart) const;

  /// The same for all samples of a row, in units of 1 / inverseBlur and with the given sign.
  void Distances(int shape, const Row& row, float factor, float* result) const;

  /// Bounds of the distance within `ball` mm of a point: +1 surely outside, -1 surely inside.
  int Classify(int shape, const Vector3& world, const Vector3& heart, double ball) const;

  std::vector<Shape> Shapes;
  std::vector<Layer> Layers;
  static constexpr float Background = -820.0f; // lung

private:
  int Add(const Shape& shape)
  {
    this->Shapes.push_back(shape);
    return static_cast<int>(this->Shapes.size()) - 1;
  }
  void Paint(float value, float softness, Content content, std::initializer_list<int> shapes)
  {
    // A negative number -1 - n stands for "not inside shape n".
    Layer layer{ {}, {}, 0, value, softness, content };
    for (const int shape : shapes)
    {
      layer.complement[layer.count] = shape < 0;
      layer.shapes[layer.count++] = shape < 0 ? -1 - shape : shape;
    }
    this->Layers.push_back(layer);
  }
};

Tissues::Tissues(const PhantomSettings& settings, const PhantomAnatomy& anatomy)
{
  const double s = anatomy.frame.size;
  const auto ellipsoid = [&](const Vector3& centre, const Vector3& radii) {
    return this->Add({ Shape::Ellipsoid, centre, radii, 0.0, 0.0, true });
  };
  const auto worldEllipsoid = [&](const Vector3& centre, const Vector3& radii) {
    return this->Add({ Shape::Ellipsoid, centre, radii, 0.0, 0.0, false });
  };
  const auto capsule = [&](const Vector3& from, const Vector3& to, double r0, double r1) {
    return this->Add({ Shape::Capsule, from, to, r0, r1, false });
  };
  const Vector3& c = HeartFrame::Centre;
  const Vector3& r = HeartFrame::Radii;

  // Thorax, in world coordinates: it does not move.
  const int thorax = worldEllipsoid(Vector3(-35.0, 15.0, -30.0), Vector3(165.0, 112.0, 900.0));
  const int pleura = worldEllipsoid(Vector3(-35.0, 12.0, -30.0), Vector3(142.0, 90.0, 900.0));
  const int spine = capsule(Vector3(-35.0, 84.0, -400.0), Vector3(-35.0, 84.0, 400.0), 19.0, 19.0);
  const int sternum = worldEllipsoid(Vector3(-35.0, -82.0, -20.0), Vector3(20.0, 6.5, 120.0));
  const int mediastinum = worldEllipsoid(Vector3(-24.0, 22.0, 20.0), Vector3(38.0, 62.0, 110.0));
  const int heartFat = ellipsoid(c, r + Vector3::Constant(5.5));
  const int myocardium = ellipsoid(c, r - Vector3::Constant(3.2));
  const int basal = this->Add({ Shape::Slab, Vector3(0, 0, -1), Vector3::Zero(), -1.5, 0.0, true });
  const int groove = this->Add({ Shape::Ring, c, r, 6.2, 0.0, true });
  const int leftVentricle = ellipsoid(Vector3(15.0, -4.0, 26.0), Vector3(21.5, 22.0, 43.0));
  const int leftVentricleWall = ellipsoid(Vector3(15.0, -4.0, 27.0), Vector3(31.5, 32.0, 53.5));
  const int rightVentricle = ellipsoid(c, r - Vector3::Constant(7.2));
  const int rightInlet =
    this->Add({ Shape::Slab, Vector3(0, 0, -1), Vector3::Zero(), -6.0, 0.0, true });
  const int rightApex =
    this->Add({ Shape::Slab, Vector3(0.25, 0, 0.97), Vector3::Zero(), 62.0, 0.0, true });
  const int leftAtrium = ellipsoid(Vector3(12.0, -14.0, -23.0), Vector3(25.0, 20.0, 18.0));
  const int leftAtriumWall = ellipsoid(Vector3(12.0, -14.0, -23.0), Vector3(27.2, 22.2, 20.2));
  const int rightAtrium = ellipsoid(Vector3(-31.0, -3.0, -20.0), Vector3(17.0, 22.0, 15.5));
  const int rightAtriumWall = ellipsoid(Vector3(-31.0, -3.0, -20.0), Vector3(19.0, 24.0, 17.5));

  const Vector3& root = anatomy.root.centre;
  const Vector3& up = anatomy.root.axis;
  const double bore = anatomy.root.radius;
  const double upper = 0.85 * bore;
  const Vector3 valve = anatomy.frame.ToWorld(Vector3(12.0, 8.0, 16.0));
  const int outflow = capsule(valve, root - 6.0 * s * up, 10.0 * s, 11.0 * s);
  const int sinus = capsule(root - AorticRoot::Below * up, root + 8.0 * up, bore, bore);
  const int tubular = capsule(root + 8.0 * up, root + 38.0 * up, bore, upper);
  const int ascending = capsule(root + 38.0 * up, root + AorticRoot::Above * up, upper, upper);
  const double wall = 1.6;
  const int sinusWall =
    capsule(root - AorticRoot::Below * up, root + 8.0 * up, bore + wall, bore + wall);
  const int tubularWall = capsule(root + 8.0 * up, root + 38.0 * up, bore + wall, upper + wall);
  const int ascendingWall =
    capsule(root + 38.0 * up, root + AorticRoot::Above * up, upper + wall, upper + wall);
  const Vector3& trunk = anatomy.pulmonaryBase;
  const Vector3& trunkAxis = anatomy.pulmonaryAxis;
  const int pulmonary = capsule(trunk - 14.0 * trunkAxis, trunk + 120.0 * trunkAxis, 11.5, 11.5);
  const int pulmonaryWall =
    capsule(trunk - 14.0 * trunkAxis, trunk + 120.0 * trunkAxis, 13.0, 13.0);
  const Vector3 descending(-12.0, 55.0, 0.0);
  const Vector3 tall(0.0, 0.0, 400.0);
  const int descendingAorta = capsule(descending - tall, descending + tall, 12.0, 12.0);
  const int descendingWall = capsule(descending - tall, descending + tall, 13.6, 13.6);

  const auto no = [](int shape) { return -1 - shape; };
  const auto hu = [](double value) { return static_cast<float>(value); };
  this->Paint(Fat, 1.0f, Content::Tissue, { thorax, no(pleura) });
  this->Paint(55.0f, 1.0f, Content::Tissue, { thorax, no(pleura), sternum });
  this->Paint(480.0f, 0.5f, Content::Tissue, { sternum });
  this->Paint(-90.0f, 1.0f, Content::Tissue, { mediastinum });
  this->Paint(330.0f, 0.6f, Content::Tissue, { spine });
  this->Paint(Fat, 0.5f, Content::Tissue, { heartFat });
  this->Paint(95.0f, 0.3f, Content::Tissue, { leftAtriumWall });
  this->Paint(90.0f, 0.3f, Content::Tissue, { rightAtriumWall });
  this->Paint(Muscle, 0.3f, Content::Tissue, { myocardium, basal });
  this->Paint(60.0f, 0.1f, Content::Tissue, { pulmonaryWall });
  this->Paint(60.0f, 0.1f, Content::Tissue, { descendingWall });
  this->Paint(Fat, 0.4f, Content::Tissue, { groove });
  this->Paint(60.0f, 0.1f, Content::Tissue, { sinusWall });
  this->Paint(60.0f, 0.1f, Content::Tissue, { tubularWall });
  this->Paint(60.0f, 0.1f, Content::Tissue, { ascendingWall });

  const double left = settings.lumenHU;
  this->Paint(hu(0.45 * left), 0.3f, Content::Chamber, { rightAtrium, no(groove) });
  this->Paint(hu(left), 0.3f, Content::Chamber, { leftAtrium, no(groove) });
  this->Paint(hu(0.48 * left), 0.7f, Content::Chamber,
    { rightVentricle, no(leftVentricleWall), rightInlet, rightApex });
  this->Paint(hu(left), 0.7f, Content::Chamber, { leftVentricle });
  this->Paint(hu(0.6 * left), 0.1f, Content::Chamber, { pulmonary });
  this->Paint(hu(left), 0.3f, Content::Chamber, { outflow }); // the first septal branch passes it
  this->Paint(hu(left + 10.0), 0.1f, Content::GreatVessel, { sinus });
  this->Paint(hu(left + 10.0), 0.1f, Content::GreatVessel, { tubular });
  this->Paint(hu(left + 10.0), 0.1f, Content::GreatVessel, { ascending });
  this->Paint(hu(left), 0.1f, Content::GreatVessel, { descendingAorta });
}

double Tissues::Distance(int number, const Vector3& world, const Vector3& heart) const
{
  const Shape& shape = this->Shapes[number];
  const Vector3& p = shape.heart ? heart : world;
  switch (shape.kind)
  {
    case Shape::Ellipsoid:
    {
      const Vector3 u = (p - shape.a).cwiseQuotient(shape.b);
      const double level = u.norm();
      return (level - 1.0) * level / std::max(1e-9, u.cwiseQuotient(shape.b).norm());
    }
    case Shape::Capsule:
    {
      const Vector3 axis = shape.b - shape.a;
      const double u = std::clamp((p - shape.a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
      return (p - shape.a - u * axis).norm() - (shape.radius + u * (shape.radius2 - shape.radius));
    }
    case Shape::Slab:
      return p.dot(shape.a) - shape.radius;
    case Shape::Ring:
    default:
    {
      const double section = std::sqrt(1.0 - std::pow(shape.a[2] / shape.b[2], 2));
      const double x = (p[0] - shape.a[0]) / (shape.b[0] * section);
      const double y = (p[1] - shape.a[1]) / (shape.b[1] * section);
      const double mean = 0.5 * section * (shape.b[0] + shape.b[1]);
      const double across = (std::sqrt(x * x + y * y) - 1.0) * mean;
      return std::sqrt(across * across + p[2] * p[2]) - shape.radius;
    }
  }
}

void Tissues::Distances(int number, const Row& row, float factor, float* result) const
{
  const Shape& shape = this->Shapes[number];
  const float* x = shape.heart ? row.heart[0] : row.world[0];
  const float* y = shape.heart ? row.heart[1] : row.world[1];
  const float* z = shape.heart ? row.heart[2] : row.world[2];
  const Eigen::Vector3f a = shape.a.cast<float>();
  switch (shape.kind)
  {
    case Shape::Ellipsoid:
    {
      const Eigen::Vector3f inverse = shape.b.cwiseInverse().cast<float>();
      for (int i = 0; i < row.count; ++i)
      {
        const float u = (x[i] - a[0]) * inverse[0];
        const float v = (y[i] - a[1]) * inverse[1];
        const float w = (z[i] - a[2]) * inverse[2];
        const float level = std::sqrt(u * u + v * v + w * w);
        const float gu = u * inverse[0];
        const float gv = v * inverse[1];
        const float gw = w * inverse[2];
        const float slope = std::sqrt(gu * gu + gv * gv + gw * gw) + 1e-12f;
        result[i] = factor * (level - 1.0f) * level / slope;
      }
      break;
    }
    case Shape::Capsule:
    {
      const Eigen::Vector3f axis = (shape.b - shape.a).cast<float>();
      const Eigen::Vector3f along = axis / axis.squaredNorm();
      const auto radius = static_cast<float>(shape.radius);
      const auto widening = static_cast<float>(shape.radius2 - shape.radius);
      for (int i = 0; i < row.count; ++i)
      {
        const float u = x[i] - a[0];
        const float v = y[i] - a[1];
        const float w = z[i] - a[2];
        float f = u * along[0] + v * along[1] + w * along[2];
        f = f < 0.0f ? 0.0f : f;
        f = f > 1.0f ? 1.0f : f;
        const float du = u - f * axis[0];
        const float dv = v - f * axis[1];
        const float dw = w - f * axis[2];
        result[i] = factor * (std::sqrt(du * du + dv * dv + dw * dw) - radius - f * widening);
      }
      break;
    }
    case Shape::Slab:
    {
      const auto offset = static_cast<float>(shape.radius);
      for (int i = 0; i < row.count; ++i)
      {
        result[i] = factor * (x[i] * a[0] + y[i] * a[1] + z[i] * a[2] - offset);
      }
      break;
    }
    case Shape::Ring:
    {
      const double section = std::sqrt(1.0 - std::pow(shape.a[2] / shape.b[2], 2));
      const auto scaleX = static_cast<float>(1.0 / (shape.b[0] * section));
      const auto scaleY = static_cast<float>(1.0 / (shape.b[1] * section));
      const auto mean = static_cast<float>(0.5 * section * (shape.b[0] + shape.b[1]));
      const auto radius = static_cast<float>(shape.radius);
      for (int i = 0; i < row.count; ++i)
      {
        const float u = (x[i] - a[0]) * scaleX;
        const float v = (y[i] - a[1]) * scaleY;
        const float across = (std::sqrt(u * u + v * v) - 1.0f) * mean;
        result[i] = factor * (std::sqrt(across * across + z[i] * z[i]) - radius);
      }
      break;
    }
  }
}

int Tissues::Classify(int number, const Vector3& world, const Vector3& heart, double ball) const
{
  const Shape& shape = this->Shapes[number];
  double distance = this->Distance(number, world, heart);
  double slope = 1.0;
  if (shape.kind == Shape::Ellipsoid)
  {
    // The level changes by at most 1 / (least radius) a millimetre; the first-order distance has
    // no such bound.
    const Vector3& p = shape.heart ? heart : world;
    distance = ((p - shape.a).cwiseQuotient(shape.b).norm() - 1.0) * shape.b.minCoeff();
  }
  else if (shape.kind == Shape::Ring)
  {
    slope = 1.4;
  }
  return distance > slope * ball ? 1 : (distance < -slope * ball ? -1 : 0);
}

/// Layers of the stack that are not decided for a whole tile.
struct TileLayers
{
  struct Active
  {
    int shapes[4];
    bool complement[4];
    int count; ///< 0: covers the whole tile
    float value;
    float inverseBlur;
    Tissues::Content content;
  };
  std::vector<Active> layers;
};

void DecideLayers(const Tissues& tissues, const Vector3& world, const Vector3& heart, double ball,
  double blur, TileLayers& result)
{
  result.layers.clear();
  for (const Tissues::Layer& layer : tissues.Layers)
  {
    const double sigma = std::sqrt(blur * blur + layer.softness * layer.softness);
    TileLayers::Active active{ {}, {}, 0, layer.value, static_cast<float>(1.0 / sigma),
      layer.content };
    bool outside = false;
    for (int i = 0; i < layer.count && !outside; ++i)
    {
      int side = tissues.Classify(layer.shapes[i], world, heart, ball + Saturated * sigma);
      side = layer.complement[i] ? -side : side;
      outside = side > 0;
      if (side == 0)
      {
        active.shapes[active.count] = layer.shapes[i];
        active.complement[active.count++] = layer.complement[i];
      }
    }
    if (outside)
    {
      continue;
    }
    if (active.count == 0 && layer.content == Tissues::Content::Tissue)
    {
      result.layers.clear(); // hides all below
    }
    result.layers.push_back(active);
  }
}

/// Paints one layer over the values of a row.
void PaintRow(
  const Tissues& tissues, const TileLayers::Active& layer, const Tissues::Row& row, float* values)
{
  float coverage[Tissues::Row::Longest];
  std::fill(coverage, coverage + row.count, 1.0f);
  for (int s = 0; s < layer.count; ++s)
  {
    float distance[Tissues::Row::Longest];
    tissues.Distances(
      layer.shapes[s], row, layer.complement[s] ? layer.inverseBlur : -layer.inverseBlur, distance);
    for (int i = 0; i < row.count; ++i)
    {
      coverage[i] *= NormalIntegralPolynomial(distance[i]);
    }
  }
  for (int i = 0; i < row.count; ++i)
  {
    values[i] += coverage[i] * (layer.value - values[i]);
  }
}

/// A small sphere of calcium, or one step of the vein.
struct Extra
{
  Vector3 start;
  Vector3 axis;
  double radius;
  double reach;
};

float Gaussian(std::uint64_t key, std::uint64_t counter)
{
  // Sum of four uniform 16-bit numbers: close to normal, and the kernel's sum closer still.
  const std::uint64_t bits = MixBits(key + counter);
  const auto sum = static_cast<float>(
    (bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  // Mean 4 * 32767.5, variance 4 * (65536^2 - 1) / 12.
  return (sum - 131070.0f) * (1.0f / 37837.2f);
}

/// Kernel with unit sum of squares: filtered unit white noise keeps its standard deviation.
std::vector<float> NoiseKernel(double sigma)
{
  const int radius = sigma < 0.2 ? 0 : static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<float> kernel(2 * radius + 1, 1.0f);
  double squares = 0.0;
  for (int i = -radius; i <= radius; ++i)
  {
    const double w = radius == 0 ? 1.0 : std::exp(-0.5 * i * i / (sigma * sigma));
    kernel[i + radius] = static_cast<float>(w);
    squares += w * w;
  }
  for (float& w : kernel)
  {
    w = static_cast<float>(w / std::sqrt(squares));
  }
  return kernel;
}
}

double DiscResponse(double offset, double discRadius)
{
  return DiscTable::Instance()(static_cast<float>(offset), static_cast<float>(discRadius));
}

PhantomImage::PhantomImage(
  const PhantomSettings& settings, const PhantomAnatomy& anatomy, const PhantomMotion& motion)
  : Settings(settings)
  , Anatomy(anatomy)
  , Motion(motion)
{
}

double PhantomImage::NoiseLevel(double t, double wholePhaseLost) const
{
  const double cycle = t - std::floor(t);
  const double fullDose =
    SmoothStep((cycle - 0.55) / 0.08) * (1.0 - SmoothStep((cycle - 0.88) / 0.08));
  return this->Settings.noise * (1.0 + (this->Settings.systolicNoise - 1.0) * (1.0 - fullDose)) *
    (1.0 + 1.5 * wholePhaseLost);
}

void RequireGrid(const ImageGrid& grid, const std::array<int, 6>& part)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!(grid.spacing[axis] > 0.0) || !std::isfinite(grid.spacing[axis]) ||
      !std::isfinite(grid.origin[axis]) || part[2 * axis] < grid.extent[2 * axis] ||
      part[2 * axis + 1] > grid.extent[2 * axis + 1])
    {
      throw std::invalid_argument(
        "CoronaryPhantom: the image grid needs positive spacing, a finite origin and a part inside "
        "its extent");
    }
  }
  if ((grid.direction * grid.direction.transpose() - Matrix3::Identity()).norm() > 1e-6 ||
    !grid.direction.allFinite())
  {
    throw std::invalid_argument("CoronaryPhantom: the direction matrix is not orthonormal");
  }
}

void PhantomImage::Render(const ImageGrid& grid, const std::array<int, 6>& part, double t,
  const std::vector<PhantomMoment>& moments, const std::vector<double>& lost, double wholePhaseLost,
  std::int16_t* values, const ProgressCallback& progress) const
{
  RequireGrid(grid, part);
  if (part[1] < part[0] || part[3] < part[2] || part[5] < part[4])
  {
    return;
  }

  const Tissues tissues(this->Settings, this->Anatomy);
  const HeartFrame& frame = this->Anatomy.frame;
  const DiscTable& disc = DiscTable::Instance();

  // The voxel is an average over its box: that blurs like a standard deviation of spacing/sqrt(12).
  Vector3 variance;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double psf = this->Settings.pointSpread[axis];
    variance[axis] = psf * psf + grid.spacing[axis] * grid.spacing[axis] / 12.0;
  }
  const Matrix3 covariance = grid.direction * variance.asDiagonal() * grid.direction.transpose();
  const double meanBlur = std::sqrt(variance.mean());
  const double widestBlur = std::sqrt(variance.maxCoeff());

  // Tiles lie on the whole image's index grid, so that any part of it gets the same values.
  int tile[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    tile[axis] = std::clamp(static_cast<int>(4.0 / grid.spacing[axis]), 3, 16);
  }
  const auto tileOf = [&](int axis, int index)
  { return (index - grid.extent[2 * axis]) / tile[axis]; };
  const int firstTile[3] = { tileOf(0, part[0]), tileOf(1, part[2]), tileOf(2, part[4]) };
  const int lastTile[3] = { tileOf(0, part[1]), tileOf(1, part[3]), tileOf(2, part[5]) };
  const int tileCount[3] = { lastTile[0] - firstTile[0] + 1, lastTile[1] - firstTile[1] + 1,
    lastTile[2] - firstTile[2] + 1 };
  const int cornerCount[3] = { tileCount[0] + 1, tileCount[1] + 1, tileCount[2] + 1 };
  const auto cornerWorld = [&](int i, int j, int k)
  {
    return grid.IndexToWorld(grid.extent[0] + (firstTile[0] + i) * tile[0] - 0.0,
      grid.extent[2] + (firstTile[1] + j) * tile[1], grid.extent[4] + (firstTile[2] + k) * tile[2]);
  };

  // Where the material at the tile corners rests; in between the field is near linear.
  const std::size_t momentCount = moments.size();
  const std::int64_t allCorners =
    static_cast<std::int64_t>(cornerCount[0]) * cornerCount[1] * cornerCount[2];
  std::vector<Eigen::Vector3f> rest(allCorners * momentCount);
  ParallelFor(
    static_cast<std::int64_t>(cornerCount[1]) * cornerCount[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t row = first; row < last; ++row)
      {
        const int j = static_cast<int>(row % cornerCount[1]);
        const int k = static_cast<int>(row / cornerCount[1]);
        for (int i = 0; i < cornerCount[0]; ++i)
        {
          const Vector3 world = cornerWorld(i, j, k);
          Vector3 guess = world;
          for (std::size_t m = 0; m < momentCount; ++m)
          {
            guess = this->Motion.ReferencePosition(world, moments[m].t, guess, 2e-3);
            rest[(row * cornerCount[0] + i) * momentCount + m] = (guess - world).cast<float>();
          }
        }
      }
    },
    progress ? ProgressCallback([&progress](double fraction) { return progress(0.15 * fraction); })
             : ProgressCallback());

  // The vessels of each moment.
  const double reach = std::max(3.4, Saturated * widestBlur + 0.5);
  std::vector<std::unique_ptr<PhantomLumen>> lumens;
  std::vector<std::vector<Extra>> veins;
  for (const PhantomMoment& moment : moments)
  {
    lumens.push_back(std::make_unique<PhantomLumen>(
      this->Anatomy, moment.tree.points, moment.tree.radius, moment.endNormals, reach));
    veins.emplace_back();
    const PhantomTree& vein = moment.vein;
    for (std::size_t p = 0; p + 1 < vein.points.size(); p += 2)
    {
      const std::size_t q = std::min(p + 2, vein.points.size() - 1);
      veins.back().push_back({ vein.points[p], vein.points[q] - vein.points[p], vein.radius[p],
        vein.radius[p] + reach });
    }
  }

  const double noise = this->NoiseLevel(t, wholePhaseLost);
  std::vector<float> kernels[3];
  int halo[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    kernels[axis] = NoiseKernel(this->Settings.noiseCorrelation / grid.spacing[axis]);
    halo[axis] = static_cast<int>(kernels[axis].size()) / 2;
  }
  std::uint64_t momentKey = 0;
  const double exactTime = t == 0.0 ? 0.0 : t; // one zero
  std::memcpy(&momentKey, &exactTime, sizeof(momentKey));
  const std::uint64_t noiseKey = MixBits(MixBits(this->Settings.seed + 77) ^ momentKey);
  const std::int64_t wholeX = grid.extent[1] - grid.extent[0] + 1 + 2 * NoiseMargin;
  const std::int64_t wholeY = grid.extent[3] - grid.extent[2] + 1 + 2 * NoiseMargin;

  const std::int64_t rowStride = part[1] - part[0] + 1;
  const std::int64_t sliceStride = rowStride * (part[3] - part[2] + 1);

  // A band: tiles of one z and a few y, all x. Big enough that the noise's halo stays small.
  const int bandTiles = std::max(1, 48 / tile[1]);
  const int bandsInY = (tileCount[1] + bandTiles - 1) / bandTiles;

  const auto renderBand = [&](std::int64_t band)
  {
    const int tz = static_cast<int>(band / bandsInY);
    const int ty0 = static_cast<int>(band % bandsInY) * bandTiles;
    const int ty1 = std::min(tileCount[1], ty0 + bandTiles);
    const auto range = [&](int axis, int t0, int t1, int& low, int& high)
    {
      low = std::max(part[2 * axis], grid.extent[2 * axis] + (firstTile[axis] + t0) * tile[axis]);
      high = std::min(
        part[2 * axis + 1], grid.extent[2 * axis] + (firstTile[axis] + t1) * tile[axis] - 1);
    };
    int y0 = 0;
    int y1 = 0;
    int z0 = 0;
    int z1 = 0;
    range(1, ty0, ty1, y0, y1);
    range(2, tz, tz + 1, z0, z1);
    const int nx = part[1] - part[0] + 1;
    const int ny = y1 - y0 + 1;
    const int nz = z1 - z0 + 1;
    std::vector<float> signal(static_cast<std::size_t>(nx) * ny * nz, 0.0f);

    TileLayers layers;
    PhantomLumen::Candidates candidates;
    Tissues::Row samples;
    std::vector<Extra> nearVein;
    for (int ty = ty0; ty < ty1; ++ty)
    {
      for (int tx = 0; tx < tileCount[0]; ++tx)
      {
        int ix0 = 0;
        int ix1 = 0;
        int iy0 = 0;
        int iy1 = 0;
        range(0, tx, tx + 1, ix0, ix1);
        range(1, ty, ty + 1, iy0, iy1);
        const Vector3 low = cornerWorld(tx, ty, tz);
        const Vector3 high = cornerWorld(tx + 1, ty + 1, tz + 1);
        const Vector3 centre = 0.5 * (low + high);
        const double ball = 0.5 * (high - low).norm();

        for (std::size_t m = 0; m < momentCount; ++m)
        {
          const PhantomMoment& moment = moments[m];
          const PhantomLumen& lumen = *lumens[m];
          const auto weight = static_cast<float>(moment.weight);
          Vector3 corner[8];
          Vector3 middle = Vector3::Zero();
          for (int n = 0; n < 8; ++n)
          {
            const std::int64_t at =
              ((tz + (n >> 2)) * static_cast<std::int64_t>(cornerCount[1]) + ty + ((n >> 1) & 1)) *
                cornerCount[0] +
              tx + (n & 1);
            corner[n] = rest[at * momentCount + m].cast<double>();
            middle += corner[n] / 8.0;
          }
          double spread = 0.0;
          for (const Vector3& c : corner)
          {
            spread = std::max(spread, (c - middle).norm());
          }
          const Vector3 restCentre = centre + middle;
          // Heart coordinates are in units of the heart's size: distances grow by 1 / size.
          DecideLayers(tissues, restCentre, frame.ToHeart(restCentre),
            (ball + spread) / std::min(1.0, frame.size), meanBlur, layers);
          lumen.Collect(centre, ball, candidates);
          nearVein.clear();
          for (const Extra& piece : veins[m])
          {
            if ((piece.start + 0.5 * piece.axis - centre).norm() <
              ball + piece.reach + 0.5 * piece.axis.norm())
            {
              nearVein.push_back(piece);
            }
          }
          std::vector<Extra> nearPlaque;
          for (std::size_t p = 0; p < moment.plaques.size(); ++p)
          {
            const double radius = this->Anatomy.plaques[p].radius;
            if ((moment.plaques[p] - centre).norm() < ball + radius + reach)
            {
              nearPlaque.push_back({ moment.plaques[p], Vector3::Zero(), radius, 0.0 });
            }
          }

          const bool plain = candidates.Empty() && nearVein.empty() && nearPlaque.empty() &&
            (layers.layers.empty() ||
              std::all_of(layers.layers.begin(), layers.layers.end(),
                [](const TileLayers::Active& layer) { return layer.count == 0; }));
          if (plain)
          {
            const float value =
              weight * (layers.layers.empty() ? Tissues::Background : layers.layers.back().value);
            for (int k = z0; k <= z1; ++k)
            {
              for (int j = iy0; j <= iy1; ++j)
              {
                float* row = &signal[(static_cast<std::size_t>(k - z0) * ny + (j - y0)) * nx];
                for (int i = ix0; i <= ix1; ++i)
                {
                  row[i - part[0]] += value;
                }
              }
            }
            continue;
          }

          const int base[3] = { grid.extent[0] + (firstTile[0] + tx) * tile[0],
            grid.extent[2] + (firstTile[1] + ty) * tile[1],
            grid.extent[4] + (firstTile[2] + tz) * tile[2] };
          for (int k = z0; k <= z1; ++k)
          {
            const double fz = static_cast<double>(k - base[2]) / tile[2];
            for (int j = iy0; j <= iy1; ++j)
            {
              const double fy = static_cast<double>(j - base[1]) / tile[1];
              Vector3 ends[2];
              for (int n = 0; n < 2; ++n)
              {
                ends[n] = (1.0 - fz) * ((1.0 - fy) * corner[n] + fy * corner[2 + n]) +
                  fz * ((1.0 - fy) * corner[4 + n] + fy * corner[6 + n]);
              }
              // All samples of the tile's row, whatever part of it is asked for.
              const Vector3 firstWorld = grid.IndexToWorld(base[0], j, k);
              const Vector3 worldStep = grid.direction.col(0) * grid.spacing[0];
              const Vector3 firstMaterial = firstWorld + ends[0];
              const Vector3 materialStep = worldStep + (ends[1] - ends[0]) / tile[0];
              const Vector3 firstHeart = frame.ToHeart(firstMaterial);
              const Vector3 heartStep = frame.ToHeart(firstMaterial + materialStep) - firstHeart;
              samples.count = (tile[0] + 3) / 4 * 4;
              for (int axis = 0; axis < 3; ++axis)
              {
                const auto w0 = static_cast<float>(firstMaterial[axis]);
                const auto w1 = static_cast<float>(materialStep[axis]);
                const auto h0 = static_cast<float>(firstHeart[axis]);
                const auto h1 = static_cast<float>(heartStep[axis]);
                for (int i = 0; i < samples.count; ++i)
                {
                  samples.world[axis][i] = w0 + static_cast<float>(i) * w1;
                  samples.heart[axis][i] = h0 + static_cast<float>(i) * h1;
                }
              }
              float painted[Tissues::Row::Longest];
              std::fill(painted, painted + samples.count, Tissues::Background);
              std::size_t layer = 0;
              for (; layer < layers.layers.size() &&
                   layers.layers[layer].content != Tissues::Content::GreatVessel;
                   ++layer)
              {
                PaintRow(tissues, layers.layers[layer], samples, painted);
              }

              PhantomLumen::Sample vessel[Tissues::Row::Longest];
              if (!candidates.Empty())
              {
                for (int i = ix0; i <= ix1; ++i)
                {
                  PhantomLumen::Sample& sample = vessel[i - base[0]];
                  sample = lumen.Evaluate(grid.IndexToWorld(i, j, k), candidates);
                  if (sample.step < 0)
                  {
                    continue;
                  }
                  // Epicardial vessels lie in fat, intramural ones in muscle: where they touch a chamber, too.
                  const bool inMuscle =
                    this->Anatomy.intramural[this->Anatomy.steps[sample.step].vessel];
                  float& value = painted[i - base[0]];
                  const auto d = static_cast<float>(sample.distance);
                  if (!inMuscle || value > Muscle)
                  {
                    const float coat =
                      NormalIntegral::Of(inMuscle ? (2.0f - d) / 0.45f : (1.9f - d) / 0.35f);
                    value += coat * ((inMuscle ? Muscle : Fat) - value);
                  }
                }
              }
              for (; layer < layers.layers.size(); ++layer)
              {
                PaintRow(tissues, layers.layers[layer], samples, painted);
              }
              float* row = &signal[(static_cast<std::size_t>(k - z0) * ny + (j - y0)) * nx];
              if (candidates.Empty() && nearVein.empty() && nearPlaque.empty())
              {
                for (int i = ix0; i <= ix1; ++i)
                {
                  row[i - part[0]] += weight * painted[i - base[0]];
                }
                continue;
              }
              for (int i = ix0; i <= ix1; ++i)
              {
                const Vector3 world = grid.IndexToWorld(i, j, k);
                const PhantomLumen::Sample& sample = vessel[i - base[0]];
                const AxisStep* step =
                  sample.step >= 0 ? &this->Anatomy.steps[sample.step] : nullptr;
                float value = painted[i - base[0]];
                if (!nearVein.empty())
                {
                  double nearest = reach;
                  double radius = 1.0;
                  for (const Extra& piece : nearVein)
                  {
                    const Vector3 offset = world - piece.start;
                    const double u =
                      std::clamp(offset.dot(piece.axis) / piece.axis.squaredNorm(), 0.0, 1.0);
                    const double d = (offset - u * piece.axis).norm() - piece.radius;
                    if (d < nearest)
                    {
                      nearest = d;
                      radius = piece.radius;
                    }
                  }
                  const auto scale = static_cast<float>(1.0 / meanBlur);
                  value += disc(static_cast<float>(std::max(0.0, nearest + radius)) * scale,
                             static_cast<float>(radius) * scale) *
                    (static_cast<float>(this->Settings.veinHU) - value);
                }
                for (const Extra& plaque : nearPlaque)
                {
                  // Dense calcium blooms.
                  const double blur = std::sqrt(meanBlur * meanBlur + 0.3 * 0.3);
                  const double d = (world - plaque.start).norm() - plaque.radius;
                  value +=
                    NormalIntegral::Of(static_cast<float>(-d / blur)) * (Plaque::Value - value);
                }
                if (step)
                {
                  // Blur across the vessel: the covariance seen along its axis.
                  const Vector3 axis =
                    (moment.tree.points[step->second] - moment.tree.points[step->first])
                      .normalized();
                  const double across = 0.5 * (variance.sum() - axis.dot(covariance * axis));
                  const auto scale = static_cast<float>(1.0 / std::sqrt(across));
                  const auto radius = static_cast<float>(sample.radius);
                  const float offset = std::max(0.0f, radius + static_cast<float>(sample.distance));
                  const double u = sample.fraction;
                  const double path = moment.tree.abscissa[step->first] * (1.0 - u) +
                    moment.tree.abscissa[step->second] * u;
                  const double hidden = lost[step->first] * (1.0 - u) + lost[step->second] * u;
                  const auto contrast = static_cast<float>(
                    this->Settings.lumenHU + this->Settings.attenuationGradient * path / 10.0);
                  value += static_cast<float>(1.0 - 0.92 * hidden) *
                    disc(offset * scale, radius * scale) * (contrast - value);
                }
                row[i - part[0]] += weight * value;
              }
            }
          }
        }
      }
    }

    // Noise: white noise named by the voxel's place in the whole image, then the kernel.
    if (noise > 0.0)
    {
      const int hx = halo[0];
      const int hy = halo[1];
      const int hz = halo[2];
      const int wx = nx + 2 * hx;
      const int wy = ny + 2 * hy;
      const int wz = nz + 2 * hz;
      std::vector<float> white(static_cast<std::size_t>(wx) * wy * wz);
      for (int k = 0; k < wz; ++k)
      {
        for (int j = 0; j < wy; ++j)
        {
          const std::int64_t row =
            ((static_cast<std::int64_t>(z0 - hz + k) - grid.extent[4] + NoiseMargin) * wholeY +
              (y0 - hy + j - grid.extent[2] + NoiseMargin)) *
            wholeX;
          float* out = &white[(static_cast<std::size_t>(k) * wy + j) * wx];
          for (int i = 0; i < wx; ++i)
          {
            out[i] = Gaussian(noiseKey,
              static_cast<std::uint64_t>(row + part[0] - hx + i - grid.extent[0] + NoiseMargin));
          }
        }
      }
      // z, then y, then x; each pass shortens its axis by the halo.
      std::vector<float> pass(static_cast<std::size_t>(wx) * wy * nz, 0.0f);
      const std::size_t plane = static_cast<std::size_t>(wx) * wy;
      for (int k = 0; k < nz; ++k)
      {
        float* out = &pass[k * plane];
        for (std::size_t n = 0; n < kernels[2].size(); ++n)
        {
          const float w = kernels[2][n];
          const float* in = &white[(k + n) * plane];
          for (std::size_t i = 0; i < plane; ++i)
          {
            out[i] += w * in[i];
          }
        }
      }
      std::vector<float> pass2(static_cast<std::size_t>(wx) * ny * nz, 0.0f);
      for (int k = 0; k < nz; ++k)
      {
        for (int j = 0; j < ny; ++j)
        {
          float* out = &pass2[(static_cast<std::size_t>(k) * ny + j) * wx];
          for (std::size_t n = 0; n < kernels[1].size(); ++n)
          {
            const float w = kernels[1][n];
            const float* in = &pass[k * plane + (j + n) * wx];
            for (int i = 0; i < wx; ++i)
            {
              out[i] += w * in[i];
            }
          }
        }
      }
      for (int row = 0; row < ny * nz; ++row)
      {
        float* out = &signal[static_cast<std::size_t>(row) * nx];
        for (std::size_t n = 0; n < kernels[0].size(); ++n)
        {
          const float w = kernels[0][n] * static_cast<float>(noise);
          const float* in = &pass2[static_cast<std::size_t>(row) * wx + n];
          for (int i = 0; i < nx; ++i)
          {
            out[i] += w * in[i];
          }
        }
      }
    }

    for (int k = z0; k <= z1; ++k)
    {
      for (int j = y0; j <= y1; ++j)
      {
        const float* in = &signal[(static_cast<std::size_t>(k - z0) * ny + (j - y0)) * nx];
        std::int16_t* out = values + (k - part[4]) * sliceStride + (j - part[2]) * rowStride;
        for (int i = 0; i < nx; ++i)
        {
          out[i] = static_cast<std::int16_t>(std::lround(std::clamp(in[i], -1024.0f, 3071.0f)));
        }
      }
    }
  };
  ParallelFor(
    static_cast<std::int64_t>(tileCount[2]) * bandsInY, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t band = first; band < last; ++band)
      {
        renderBand(band);
      }
    },
    progress
      ? ProgressCallback([&progress](double fraction) { return progress(0.15 + 0.85 * fraction); })
      : ProgressCallback());
}
}
