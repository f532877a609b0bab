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

INLINE const Pack& Load(const float* from)
{
  return *reinterpret_cast<const Pack*>(from);
}

INLINE Pack Affine(const float* row, const Pack& x, const Pack& y, const Pack& z)
{
  return row[0] * x + (row[1] * y + (row[2] * z + row[3]));
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
  const Pack turns = (angle * 0.159154943F + Rounder) - Rounder;
  const Pack y = ((angle - turns * 6.28125F) - turns * 1.93530717958e-3F) * 0.25F;
  const Pack q = y * y;
  const Pack s = y *
    (1.0F +
      q * (-1.66666667e-1F + q * (8.33333333e-3F + q * (-1.98412698e-4F + q * 2.75573192e-6F))));
  const Pack c =
    1.0F + q * (-0.5F + q * (4.16666667e-2F + q * (-1.38888889e-3F + q * 2.48015873e-5F)));
  const Pack s2 = 2.0F * s * c;
  const Pack c2 = 1.0F - 2.0F * s * s;
  sine = 2.0F * s2 * c2;
  cosine = 1.0F - 2.0F * s2 * s2;
}

/// Factors of SkinBone::section and SkinBone::turned.
INLINE void SectionFactors(const SkinBone& bone, const Pack& t, Pack& along, Pack& across)
{
  const Pack calibre = bone.calibre[0] + bone.calibre[1] * t;
  Pack sine;
  Pack cosine;
  SineCosine(bone.twist * t, sine, cosine);
  along = calibre * cosine - 1.0F;
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

template <bool Sections>
void Linear(const SkinBlocks& blocks, const SkinBone* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* result)
{
  for (std::int64_t block = first; block < last; ++block)
  {
    for (int p = 0; p < Packs; ++p)
    {
      const std::int64_t at = block * SkinLanes + p * PackLanes;
      const Pack x = Load(blocks.x + at);
      const Pack y = Load(blocks.y + at);
      const Pack z = Load(blocks.z + at);
      Pack sum[3] = {};
      for (std::int32_t e = blocks.offset[block]; e < blocks.offset[block + 1]; ++e)
      {
        const SkinBone& bone = bones[blocks.bone[e]];
        const Pack weight =
          Load(blocks.weight + static_cast<std::int64_t>(e) * SkinLanes + p * PackLanes);
        const Pack t = Limited(Affine(bone.along, x, y, z));
        Pack moved[3];
        for (int c = 0; c < 3; ++c)
        {
          const float* row = bone.rigid + 4 * c;
          moved[c] = row[0] * x + (row[1] * y + (row[2] * z + (bone.stretch[c] * t + row[3])));
        }
        if (Sections)
        {
          Pack along;
          Pack across;
          SectionFactors(bone, t, along, across);
          for (int c = 0; c < 3; ++c)
          {
            moved[c] += along * Affine(bone.section + 4 * c, x, y, z) +
              across * Affine(bone.turned + 4 * c, x, y, z);
          }
        }
        for (int c = 0; c < 3; ++c)
        {
          sum[c] += weight * moved[c];
        }
      }
      Write(blocks, at, centre, sum[0], sum[1], sum[2], result);
    }
  }
}

template <bool Sections>
void Dual(const SkinBlocks& blocks, const SkinBone* bones, const float* centre, std::int64_t first,
  std::int64_t last, float* result)
{
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
        const float* real = bones[blocks.pivot[at + n]].rigid;
        for (int c = 0; c < 4; ++c)
        {
          lanes[c][n] = real[c];
        }
      }
      const Pack pivot[4] = { Load(lanes[0]), Load(lanes[1]), Load(lanes[2]), Load(lanes[3]) };
      Pack blend[8] = {};
      Pack place[3] = { x, y, z };
      for (std::int32_t e = blocks.offset[block]; e < blocks.offset[block + 1]; ++e)
      {
        const SkinBone& bone = bones[blocks.bone[e]];
        const Pack weight =
          Load(blocks.weight + static_cast<std::int64_t>(e) * SkinLanes + p * PackLanes);
        const Pack t = Limited(Affine(bone.along, x, y, z));
        const Pack stretched = weight * t;
        for (int c = 0; c < 3; ++c)
        {
          place[c] += bone.stretch[c] * stretched;
        }
        if (Sections)
        {
          Pack along;
          Pack across;
          SectionFactors(bone, t, along, across);
          for (int c = 0; c < 3; ++c)
          {
            place[c] += weight *
              (along * Affine(bone.section + 4 * c, x, y, z) +
                across * Affine(bone.turned + 4 * c, x, y, z));
          }
        }
        // q and -q are the same rotation: the one on the side of the greatest weight's bone.
        const float* q = bone.rigid;
        const Pack side = q[0] * pivot[0] + (q[1] * pivot[1] + (q[2] * pivot[2] + q[3] * pivot[3]));
        const Pack signedWeight = side < Pack{} ? -weight : weight;
        for (int c = 0; c < 8; ++c)
        {
          blend[c] += signedWeight * q[c];
        }
      }
      const Pack& w = blend[0];
      const Pack* r = blend + 1;
      const Pack& dw = blend[4];
      const Pack* d = blend + 5;
      const Pack twice = 2.0F / (w * w + r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
      Pack inner[3];
      Pack moved[3];
      for (int c = 0; c < 3; ++c)
      {
        const int i = (c + 1) % 3;
        const int j = (c + 2) % 3;
        inner[c] = (r[i] * place[j] - r[j] * place[i]) + w * place[c];
      }
      for (int c = 0; c < 3; ++c)
      {
        const int i = (c + 1) % 3;
        const int j = (c + 2) % 3;
        const Pack turn = r[i] * inner[j] - r[j] * inner[i];
        const Pack shift = (w * d[c] - dw * r[c]) + (r[i] * d[j] - r[j] * d[i]);
        moved[c] = place[c] + twice * (turn + shift);
      }
      Write(blocks, at, centre, moved[0], moved[1], moved[2], result);
    }
  }
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
  Linear<false>, Linear<true>, Dual<false>, Dual<true>
};
}
