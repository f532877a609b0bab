// The inner loops of the skin deformation. Compiled once for each set of vector instructions, so it
// may include nothing that emits shared inline functions: the linker could keep the widest of them.

#include "SkinKernels.h"

#define INLINE __attribute__((always_inline)) inline

namespace coronary
{
namespace
{
/// As many floats as a register holds.
#if defined(__AVX512F__)
constexpr int PackBytes = 64;
#elif defined(__AVX2__)
constexpr int PackBytes = 32;
#else
constexpr int PackBytes = 16;
#endif
constexpr int PackLanes = PackBytes / static_cast<int>(sizeof(float));
constexpr int Packs = SkinLanes / PackLanes;
using Pack [[gnu::vector_size(PackBytes), gnu::may_alias]] = float;
using IntPack [[gnu::vector_size(PackBytes)]] = std::int32_t;

INLINE Pack Constant(float value)
{
  return value - Pack{}; // the compiler knows that this is the value; of + it does not
}

INLINE const Pack& Constant(const Pack& value)
{
  return value;
}

/// a b + c, rounded once where the processor can. The compiler does not do that by itself: which of the products of a
/// sum it takes would depend on what else is computed.
template <typename A, typename B, typename C>
INLINE Pack MultiplyAdd(const A& a, const B& b, const C& c)
{
  const Pack x = Constant(a);
  const Pack y = Constant(b);
  const Pack z = Constant(c);
#if defined(__AVX512F__)
  return __builtin_ia32_vfmaddps512_mask(x, y, z, -1, 4); // 4: rounding as it is set
#elif defined(__FMA__)
  return __builtin_ia32_vfmaddps256(x, y, z);
#else
  return x * y + z;
#endif
}

/// Packs with their derivatives by time: what is computed with them has its derivative beside it.
struct MovingPack
{
  Pack value;
  Pack rate;
};

INLINE MovingPack operator-(const MovingPack& a)
{
  return { -a.value, -a.rate };
}

INLINE MovingPack operator+(const MovingPack& a, const MovingPack& b)
{
  return { a.value + b.value, a.rate + b.rate };
}

INLINE MovingPack operator*(const MovingPack& a, const MovingPack& b)
{
  return { a.value * b.value, MultiplyAdd(a.rate, b.value, a.value * b.rate) };
}

INLINE MovingPack operator/(float a, const MovingPack& b)
{
  const Pack quotient = a / b.value;
  return { quotient, -(quotient * b.rate / b.value) };
}

/// `c` is a MovingPack or a MovingFloat.
template <typename C>
INLINE MovingPack MultiplyAdd(const MovingFloat& a, const Pack& b, const C& c)
{
  return { MultiplyAdd(a.value, b, c.value), MultiplyAdd(a.rate, b, c.rate) };
}

INLINE MovingPack MultiplyAdd(const Pack& a, const MovingPack& b, const MovingPack& c)
{
  return { MultiplyAdd(a, b.value, c.value), MultiplyAdd(a, b.rate, c.rate) };
}

INLINE MovingPack MultiplyAdd(const MovingPack& a, const MovingPack& b, const MovingPack& c)
{
  return { MultiplyAdd(a.value, b.value, c.value),
    MultiplyAdd(a.rate, b.value, MultiplyAdd(a.value, b.rate, c.rate)) };
}

INLINE MovingPack MultiplyAdd(const MovingPack& a, const MovingPack& b, float c)
{
  return { MultiplyAdd(a.value, b.value, c), MultiplyAdd(a.rate, b.value, a.value * b.rate) };
}

/// Results are computed in packs alone, or with their derivatives.
template <typename Number>
struct ValueOf;

template <>
struct ValueOf<float>
{
  using Type = Pack;
  static INLINE Pack Still(const Pack& value) { return value; }
  static INLINE float Now(float number) { return number; }
};

template <>
struct ValueOf<MovingFloat>
{
  using Type = MovingPack;
  static INLINE MovingPack Still(const Pack& value) { return { value, Pack{} }; }
  static INLINE float Now(const MovingFloat& number) { return number.value; }
};

INLINE const Pack& Load(const float* from)
{
  return *reinterpret_cast<const Pack*>(from);
}

template <typename Number>
INLINE typename ValueOf<Number>::Type Affine(
  const Number* row, const Pack& x, const Pack& y, const Pack& z)
{
  return MultiplyAdd(row[0], x, MultiplyAdd(row[1], y, MultiplyAdd(row[2], z, row[3])));
}

INLINE Pack Limited(const Pack& t)
{
  const Pack zero{};
  const Pack one = zero + 1.0F;
  const Pack low = t > zero ? t : zero;
  return low < one ? low : one;
}

/// To a few units in the last place; the angle may be any that a bone is twisted by.
INLINE void SineCosine(const Pack& angle, Pack& sine, Pack& cosine)
{
  // The nearest whole turn: adding and taking away 3 * 2^22 rounds to an integer.
  constexpr float Rounder = 12582912.0F;
  const Pack turns = MultiplyAdd(angle, 0.159154943F, Rounder) - Rounder;
  const Pack rest = MultiplyAdd(-turns, 6.28125F, angle);
  const Pack y = MultiplyAdd(-turns, 1.93530717958e-3F, rest) * 0.25F;
  const Pack q = y * y;
  Pack s = MultiplyAdd(q, 2.75573192e-6F, -1.98412698e-4F);
  s = MultiplyAdd(q, s, 8.33333333e-3F);
  s = MultiplyAdd(q, s, -1.66666667e-1F);
  s = y * MultiplyAdd(q, s, 1.0F);
  Pack c = MultiplyAdd(q, 2.48015873e-5F, -1.38888889e-3F);
  c = MultiplyAdd(q, c, 4.16666667e-2F);
  c = MultiplyAdd(q, c, -0.5F);
  c = MultiplyAdd(q, c, 1.0F);
  const Pack s2 = 2.0F * s * c;
  const Pack c2 = MultiplyAdd(-2.0F * s, s, 1.0F);
  sine = 2.0F * s2 * c2;
  cosine = MultiplyAdd(-2.0F * s2, s2, 1.0F);
}

INLINE void SineCosine(const MovingPack& angle, MovingPack& sine, MovingPack& cosine)
{
  SineCosine(angle.value, sine.value, cosine.value);
  sine.rate = cosine.value * angle.rate;
  cosine.rate = -(sine.value * angle.rate);
}

INLINE Pack Times(float a, const Pack& b)
{
  return a * b;
}

INLINE MovingPack Times(const MovingFloat& a, const Pack& b)
{
  return { a.value * b, a.rate * b };
}

/// Factors of SkinBone::section and SkinBone::turned.
template <typename Number, typename Value>
INLINE void SectionFactors(
  const BasicSkinBone<Number>& bone, const Pack& t, Value& along, Value& across)
{
  const Value calibre = MultiplyAdd(bone.calibre[1], t, bone.calibre[0]);
  Value sine;
  Value cosine;
  SineCosine(Times(bone.twist, t), sine, cosine);
  along = MultiplyAdd(calibre, cosine, -1.0F);
  across = calibre * sine;
}

INLINE void Write(const SkinBlocks& blocks, std::int64_t at, const float* centre, const Pack& x,
  const Pack& y, const Pack& z, float* result)
{
  const std::int32_t* point = blocks.point + at;
  const std::int64_t left = blocks.points - at;
  const Pack px = x + centre[0];
  const Pack py = y + centre[1];
  const Pack pz = z + centre[2];
  if (left >= PackLanes)
  {
    for (int n = 0; n < PackLanes; ++n)
    {
      float* to = result + 3 * static_cast<std::int64_t>(point[n]);
      to[0] = px[n];
      to[1] = py[n];
      to[2] = pz[n];
    }
    return;
  }
  for (int n = 0; n < left; ++n)
  {
    float* to = result + 3 * static_cast<std::int64_t>(point[n]);
    to[0] = px[n];
    to[1] = py[n];
    to[2] = pz[n];
  }
}

INLINE void WriteMoved(const SkinBlocks& blocks, std::int64_t at, const float* centre,
  const Pack* moved, float* positions, float*)
{
  Write(blocks, at, centre, moved[0], moved[1], moved[2], positions);
}

INLINE void WriteMoved(const SkinBlocks& blocks, std::int64_t at, const float* centre,
  const MovingPack* moved, float* positions, float* velocities)
{
  const float still[3] = {};
  Write(blocks, at, centre, moved[0].value, moved[1].value, moved[2].value, positions);
  Write(blocks, at, still, moved[0].rate, moved[1].rate, moved[2].rate, velocities);
}

template <bool Sections, typename Number>
INLINE void Linear(const SkinBlocks& blocks, const BasicSkinBone<Number>* bones,
  const float* centre, std::int64_t first, std::int64_t last, float* positions, float* velocities)
{
  using Value = typename ValueOf<Number>::Type;
  for (std::int64_t block = first; block < last; ++block)
  {
    for (int p = 0; p < Packs; ++p)
    {
      const std::int64_t at = block * SkinLanes + p * PackLanes;
      const Pack x = Load(blocks.x + at);
      const Pack y = Load(blocks.y + at);
      const Pack z = Load(blocks.z + at);
      Value sum[3] = {};
      for (std::int32_t e = blocks.offset[block]; e < blocks.offset[block + 1]; ++e)
      {
        const BasicSkinBone<Number>& bone = bones[blocks.bone[e]];
        const Pack weight =
          Load(blocks.weight + static_cast<std::int64_t>(e) * SkinLanes + p * PackLanes);
        const Pack t = Limited(Affine(bone.along, x, y, z));
        Value moved[3];
        for (int c = 0; c < 3; ++c)
        {
          const Number* row = bone.rigid + 4 * c;
          moved[c] = MultiplyAdd(row[0], x,
            MultiplyAdd(
              row[1], y, MultiplyAdd(row[2], z, MultiplyAdd(bone.stretch[c], t, row[3]))));
        }
        if (Sections)
        {
          Value along;
          Value across;
          SectionFactors(bone, t, along, across);
          for (int c = 0; c < 3; ++c)
          {
            moved[c] = moved[c] +
              MultiplyAdd(along, Affine(bone.section + 4 * c, x, y, z),
                across * Affine(bone.turned + 4 * c, x, y, z));
          }
        }
        for (int c = 0; c < 3; ++c)
        {
          sum[c] = MultiplyAdd(weight, moved[c], sum[c]);
        }
      }
      WriteMoved(blocks, at, centre, sum, positions, velocities);
    }
  }
}

template <bool Sections, typename Number>
INLINE void Dual(const SkinBlocks& blocks, const BasicSkinBone<Number>* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* positions, float* velocities)
{
  using Value = typename ValueOf<Number>::Type;
  for (std::int64_t block = first; block < last; ++block)
  {
    for (int p = 0; p < Packs; ++p)
    {
      const std::int64_t at = block * SkinLanes + p * PackLanes;
      const Pack x = Load(blocks.x + at);
      const Pack y = Load(blocks.y + at);
      const Pack z = Load(blocks.z + at);
      alignas(64) float lanes[4][PackLanes];
      for (int n = 0; n < PackLanes; ++n)
      {
        const Number* real = bones[blocks.pivot[at + n]].rigid;
        for (int c = 0; c < 4; ++c)
        {
          lanes[c][n] = ValueOf<Number>::Now(real[c]);
        }
      }
      const Pack pivot[4] = { Load(lanes[0]), Load(lanes[1]), Load(lanes[2]), Load(lanes[3]) };
      Value blend[8] = {};
      Value place[3] = { ValueOf<Number>::Still(x), ValueOf<Number>::Still(y),
        ValueOf<Number>::Still(z) };
      for (std::int32_t e = blocks.offset[block]; e < blocks.offset[block + 1]; ++e)
      {
        const BasicSkinBone<Number>& bone = bones[blocks.bone[e]];
        const Pack weight =
          Load(blocks.weight + static_cast<std::int64_t>(e) * SkinLanes + p * PackLanes);
        const Pack t = Limited(Affine(bone.along, x, y, z));
        const Pack stretched = weight * t;
        for (int c = 0; c < 3; ++c)
        {
          place[c] = MultiplyAdd(bone.stretch[c], stretched, place[c]);
        }
        if (Sections)
        {
          Value along;
          Value across;
          SectionFactors(bone, t, along, across);
          for (int c = 0; c < 3; ++c)
          {
            place[c] = MultiplyAdd(weight,
              MultiplyAdd(along, Affine(bone.section + 4 * c, x, y, z),
                across * Affine(bone.turned + 4 * c, x, y, z)),
              place[c]);
          }
        }
        // q and -q are the same rotation: the one on the side of the greatest weight's bone.
        const Number* q = bone.rigid;
        float real[4];
        for (int c = 0; c < 4; ++c)
        {
          real[c] = ValueOf<Number>::Now(q[c]);
        }
        const Pack side = MultiplyAdd(real[0], pivot[0],
          MultiplyAdd(real[1], pivot[1], MultiplyAdd(real[2], pivot[2], real[3] * pivot[3])));
        const Pack signedWeight = side < Pack{} ? -weight : weight;
        for (int c = 0; c < 8; ++c)
        {
          blend[c] = MultiplyAdd(q[c], signedWeight, blend[c]);
        }
      }
      const Value& w = blend[0];
      const Value* r = blend + 1;
      const Value& dw = blend[4];
      const Value* d = blend + 5;
      const Value square =
        MultiplyAdd(r[2], r[2], MultiplyAdd(r[1], r[1], MultiplyAdd(w, w, r[0] * r[0])));
      const Value twice = 2.0F / square;
      Value inner[3];
      Value moved[3];
      for (int c = 0; c < 3; ++c)
      {
        const int i = (c + 1) % 3;
        const int j = (c + 2) % 3;
        inner[c] = MultiplyAdd(w, place[c], MultiplyAdd(r[i], place[j], -(r[j] * place[i])));
      }
      for (int c = 0; c < 3; ++c)
      {
        const int i = (c + 1) % 3;
        const int j = (c + 2) % 3;
        const Value turn = MultiplyAdd(r[i], inner[j], -(r[j] * inner[i]));
        const Value shift =
          MultiplyAdd(w, d[c], -(dw * r[c])) + MultiplyAdd(r[i], d[j], -(r[j] * d[i]));
        moved[c] = MultiplyAdd(twice, turn + shift, place[c]);
      }
      WriteMoved(blocks, at, centre, moved, positions, velocities);
    }
  }
}

template <bool DualQuaternions, bool Sections, typename Number>
INLINE void Move(const SkinBlocks& blocks, const BasicSkinBone<Number>* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* positions, float* velocities)
{
  if (DualQuaternions)
  {
    Dual<Sections>(blocks, bones, centre, first, last, positions, velocities);
  }
  else
  {
    Linear<Sections>(blocks, bones, centre, first, last, positions, velocities);
  }
}

template <bool DualQuaternions, bool Sections>
void Positions(const SkinBlocks& blocks, const SkinBone* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* positions)
{
  Move<DualQuaternions, Sections>(blocks, bones, centre, first, last, positions, nullptr);
}

template <bool DualQuaternions, bool Sections>
void Motion(const SkinBlocks& blocks, const MovingSkinBone* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* positions, float* velocities)
{
  Move<DualQuaternions, Sections>(blocks, bones, centre, first, last, positions, velocities);
}
}

#if defined(__AVX512F__)
const SkinKernels SkinKernelsAvx512
{
#elif defined(__AVX2__)
const SkinKernels SkinKernelsAvx2
{
#else
const SkinKernels SkinKernelsBaseline{
#endif
  { { Positions<false, false>, Positions<false, true> },
    { Positions<true, false>, Positions<true, true> } },
  {
    { Motion<false, false>, Motion<false, true> },
    {
      Motion<true, false>, Motion<true, true>
    }
  }
};
}
