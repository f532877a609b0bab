#include "PhantomTissues.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// Integral of the standard normal density up to x as a polynomial, which the compiler can turn
/// into vector code: exact to 8e-4.
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
}

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
  const int thorax = worldEllipsoid(Vector3(-35.0, 15.0, -30.0),
    Vector3(165.0, 112.0, 900.0) + settings.disease.bodyFat * Vector3(1.0, 1.0, 0.0));
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
  const double upper = AorticRoot::Taper * bore;
  const Vector3 sinuses = root + AorticRoot::Sinuses * up;
  const Vector3 tubularEnd = root + AorticRoot::Tubular * up;
  const Vector3 top = root + AorticRoot::Above * up;
  const Vector3 valve = anatomy.frame.ToWorld(Vector3(12.0, 8.0, 16.0));
  const int outflow = capsule(valve, root - 6.0 * s * up, 10.0 * s, 11.0 * s);
  const int sinus = capsule(root - AorticRoot::Below * up, sinuses, bore, bore);
  const int tubular = capsule(sinuses, tubularEnd, bore, upper);
  const int ascending = capsule(tubularEnd, top, upper, upper);
  const double wall = 1.6;
  const int sinusWall = capsule(root - AorticRoot::Below * up, sinuses, bore + wall, bore + wall);
  const int tubularWall = capsule(sinuses, tubularEnd, bore + wall, upper + wall);
  const int ascendingWall = capsule(tubularEnd, top, upper + wall, upper + wall);
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
void DecideLayers(const Tissues& tissues, const Vector3& world, const Vector3& heart, double ball,
  double blur, TileLayers& result)
{
  result.layers.clear();
  for (std::size_t n = 0; n < tissues.Layers.size(); ++n)
  {
    const Tissues::Layer& layer = tissues.Layers[n];
    const double sigma = std::sqrt(blur * blur + layer.softness * layer.softness);
    TileLayers::Active active{ {}, {}, 0, static_cast<int>(n), static_cast<float>(1.0 / sigma),
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

void CoverRow(
  const Tissues& tissues, const TileLayers::Active& layer, const Tissues::Row& row, float* coverage)
{
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
}
}
