#include "SkinWeightCache.h"

#include "AtomicFile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace coronary
{
namespace
{
// The second half tells byte orders apart. Another number whenever the solver or this format changes.
constexpr std::array<char, 8> Magic{ 'D', 'C', 'W', 'G', 'H', 'T', 'S', '2' };
constexpr std::uint64_t ByteOrder = 0x0102030405060708;

/// Of eight bytes at a time; for telling contents apart, not against intent.
class ContentHash
{
public:
  explicit ContentHash(std::uint64_t seed)
    : State(seed)
  {
  }

  void Add(const void* data, std::size_t size)
  {
    const char* bytes = static_cast<const char*>(data);
    while (size > 0)
    {
      std::uint64_t word = 0;
      const std::size_t part = std::min<std::size_t>(size, sizeof(word));
      std::memcpy(&word, bytes, part);
      this->Mix(word);
      bytes += part;
      size -= part;
    }
  }

  template <typename Value>
  void Add(const Value& value)
  {
    static_assert(std::is_arithmetic_v<Value>, "padding would be hashed too");
    this->Add(&value, sizeof(value));
  }

  std::uint64_t Value() const { return this->State; }

private:
  /// The finisher of SplitMix64 (Steele, Lea, Flood 2014).
  void Mix(std::uint64_t word)
  {
    std::uint64_t x = (this->State ^ word) + 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    this->State = x ^ (x >> 31);
  }

  std::uint64_t State;
};

void AddContents(
  ContentHash& hash, const SkinWeightInput& input, const SkinWeightSettings& settings)
{
  const auto addPoints = [&](const std::vector<Vector3>& points)
  {
    hash.Add(points.size());
    for (const Vector3& p : points)
    {
      hash.Add(p.data(), 3 * sizeof(double));
    }
  };
  addPoints(input.points);
  hash.Add(input.tetrahedra.size());
  for (const auto& t : input.tetrahedra)
  {
    hash.Add(t.data(), sizeof(t));
  }
  addPoints(input.joints);
  hash.Add(input.bones.size());
  for (const auto& [first, second] : input.bones)
  {
    hash.Add(first);
    hash.Add(second);
  }
  hash.Add(static_cast<int>(settings.mode));
  hash.Add(settings.tolerance);
  hash.Add(settings.iterations);
  hash.Add(settings.polish);
  hash.Add(settings.neighbourhood);
  hash.Add(settings.widen);
  hash.Add(settings.leaveOutside);
  hash.Add(settings.penalty);
}

/// Calls visit for every member, in the order of the file.
template <typename Weights, typename Visit>
void ForMembers(Weights& w, const Visit& visit)
{
  visit(w.offset);
  visit(w.bone);
  visit(w.weight);
  visit(w.lengthOutside);
  visit(w.bones);
  visit(w.converged);
  visit(w.iterations);
  visit(w.factorizations);
  visit(w.polishSteps);
  visit(w.neighbourhood);
  visit(w.penaltyParameter);
  visit(w.residual);
  visit(w.residualEverywhere);
  visit(w.energy);
  visit(w.energyGap);
  visit(w.maximumSum);
  visit(w.minimumSum);
  visit(w.constraintResidual);
  visit(w.fixedPoints);
  visit(w.samples);
  visit(w.maximumDomainShare);
  visit(w.leftOut);
}

struct Writer
{
  std::string& bytes;

  template <typename Value>
  void operator()(const Value& value) const
  {
    this->bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  template <typename Value>
  void operator()(const std::vector<Value>& values) const
  {
    (*this)(static_cast<std::uint64_t>(values.size()));
    this->bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
  }
};

struct Reader
{
  const std::string& bytes;
  std::size_t& at;

  void Take(void* to, std::size_t size) const
  {
    if (size > this->bytes.size() - this->at)
    {
      throw std::runtime_error("it is too short");
    }
    if (size > 0)
    {
      std::memcpy(to, this->bytes.data() + this->at, size);
    }
    this->at += size;
  }
  template <typename Value>
  void operator()(Value& value) const
  {
    this->Take(&value, sizeof(value));
  }
  void operator()(bool& value) const
  {
    unsigned char byte = 0;
    this->Take(&byte, 1);
    value = byte != 0;
  }
  template <typename Value>
  void operator()(std::vector<Value>& values) const
  {
    std::uint64_t size = 0;
    this->Take(&size, sizeof(size));
    if (size > (this->bytes.size() - this->at) / sizeof(Value))
    {
      throw std::runtime_error("it is too short");
    }
    values.resize(size);
    this->Take(values.data(), size * sizeof(Value));
  }
};

std::uint64_t Checksum(const char* bytes, std::size_t size)
{
  ContentHash hash(size);
  hash.Add(bytes, size);
  return hash.Value();
}

bool Fits(const SkinWeights& w, const SkinWeightInput& input)
{
  bool fits = w.bones == static_cast<std::int64_t>(input.bones.size()) &&
    w.lengthOutside.size() == input.bones.size() && w.offset.size() == input.points.size() + 1 &&
    w.offset.front() == 0 && w.offset.back() == static_cast<std::int64_t>(w.bone.size()) &&
    w.bone.size() == w.weight.size() &&
    std::all_of(w.leftOut.begin(), w.leftOut.end(),
      [&](std::int64_t bone) { return bone >= 0 && bone < w.bones; });
  for (std::size_t i = 1; fits && i < w.offset.size(); ++i)
  {
    fits = w.offset[i] >= w.offset[i - 1];
  }
  for (std::size_t e = 0; fits && e < w.bone.size(); ++e)
  {
    fits = w.bone[e] >= 0 && w.bone[e] < w.bones && std::isfinite(w.weight[e]);
  }
  return fits;
}
}

std::string SkinWeightCachePath(
  const std::string& folder, const SkinWeightInput& input, const SkinWeightSettings& settings)
{
  std::array<char, 64> name{};
  ContentHash one(1);
  ContentHash two(2);
  AddContents(one, input, settings);
  AddContents(two, input, settings);
  std::snprintf(name.data(), name.size(), "skin-weights-%016llx%016llx.bin",
    static_cast<unsigned long long>(one.Value()), static_cast<unsigned long long>(two.Value()));
  return (std::filesystem::path(folder) / name.data()).string();
}

bool ReadSkinWeights(const std::string& path, const SkinWeightInput& input, SkinWeights& weights)
{
  std::error_code error;
  if (!std::filesystem::exists(path, error))
  {
    return false;
  }
  const auto fail = [&](const std::string& reason)
  { return std::runtime_error("cannot use the skin weights in " + path + ": " + reason); };
  if (!std::filesystem::is_regular_file(path, error))
  {
    throw fail("it is no file");
  }
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::filesystem::file_size(path, error), '\0');
  if (error || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
  {
    throw fail("it cannot be read");
  }
  const std::size_t head = Magic.size() + sizeof(ByteOrder);
  if (bytes.size() < head + sizeof(std::uint64_t) ||
    std::memcmp(bytes.data(), Magic.data(), Magic.size()) != 0 ||
    std::memcmp(bytes.data() + Magic.size(), &ByteOrder, sizeof(ByteOrder)) != 0)
  {
    throw fail("it is no such file, or one of another version or computer");
  }
  const std::size_t size = bytes.size() - sizeof(std::uint64_t);
  const std::uint64_t sum = Checksum(bytes.data(), size);
  if (std::memcmp(&sum, bytes.data() + size, sizeof(sum)) != 0)
  {
    throw fail("it is damaged");
  }
  bytes.resize(size);
  SkinWeights result;
  std::size_t at = head;
  try
  {
    ForMembers(result, Reader{ bytes, at });
  }
  catch (const std::runtime_error& reason)
  {
    throw fail(reason.what());
  }
  if (at != bytes.size() || !Fits(result, input))
  {
    throw fail("it is of another mesh");
  }
  weights = std::move(result);
  return true;
}

std::string WithSkinWeightChecksum(std::string bytes)
{
  if (bytes.size() >= sizeof(std::uint64_t))
  {
    const std::size_t size = bytes.size() - sizeof(std::uint64_t);
    const std::uint64_t sum = Checksum(bytes.data(), size);
    std::memcpy(&bytes[size], &sum, sizeof(sum));
  }
  return bytes;
}

void WriteSkinWeights(const std::string& path, const SkinWeights& weights)
{
  std::string bytes(Magic.begin(), Magic.end());
  const Writer writer{ bytes };
  writer(ByteOrder);
  ForMembers(weights, writer);
  writer(Checksum(bytes.data(), bytes.size()));
  RemoveAbandonedFiles(path);
  WriteFileAtomically(path, bytes);
}

SkinWeights CachedSkinWeights(const std::string& folder, const SkinWeightInput& input,
  const SkinWeightSettings& settings, const ProgressCallback& progress,
  std::vector<std::string>& warnings)
{
  settings.Validate();
  if (folder.empty())
  {
    return ComputeSkinWeights(input, settings, progress);
  }
  const std::string path = SkinWeightCachePath(folder, input, settings);
  SkinWeights weights;
  bool found = false;
  try
  {
    found = ReadSkinWeights(path, input, weights);
  }
  catch (const std::runtime_error& error)
  {
    warnings.push_back(std::string(error.what()) + "; they are computed anew");
  }
  if (found)
  {
    Report(progress, 1.0);
    return weights;
  }
  weights = ComputeSkinWeights(input, settings, progress);
  if (weights.converged)
  {
    try
    {
      std::error_code ignored; // that it could not be made shows when the file is written
      std::filesystem::create_directories(folder, ignored);
      WriteSkinWeights(path, weights);
    }
    catch (const std::runtime_error& error)
    {
      warnings.push_back(std::string("the skin weights are not kept: ") + error.what());
    }
  }
  return weights;
}
}
