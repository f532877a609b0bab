/**
 * @file PhantomTissues.h
 * @brief What lies around the phantom's vessels, and how it looks in a blurred image.
 */
#ifndef DynamicCoronary_PhantomTissues_h
#define DynamicCoronary_PhantomTissues_h

#include "PhantomAnatomy.h"

#include <initializer_list>
#include <vector>

namespace coronary
{
constexpr float Muscle = 110.0f; // HU, enhanced myocardium
constexpr float Fat = -95.0f;
constexpr float Saturated = 4.0f; ///< standard deviations beyond which a blurred edge is flat

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
/// Layers of the stack that are not decided for a whole tile.
struct TileLayers
{
  struct Active
  {
    int shapes[4];
    bool complement[4];
    int count; ///< 0: covers the whole tile
    int layer; ///< of Tissues::Layers
    float inverseBlur;
    Tissues::Content content;
  };
  std::vector<Active> layers;
};
/**
 * Layers that matter within `ball` mm of a material point.
 * @param world, heart  the point in both coordinates
 * @param blur          of the image, mm
 */
void DecideLayers(const Tissues& tissues, const Vector3& world, const Vector3& heart, double ball,
  double blur, TileLayers& result);

/// Share of each sample of a row that one layer covers.
void CoverRow(const Tissues& tissues, const TileLayers::Active& layer, const Tissues::Row& row,
  float* coverage);
}

#endif
