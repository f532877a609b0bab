#include "MesherMessage.h"

#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace coronary
{
namespace
{
constexpr std::uint64_t requestMagic = 0x3151524853454d44; // "DMESHRQ1"
constexpr std::uint64_t answerMagic = 0x314e414853454d44;  // "DMESHAN1"

/// FNV-1a over words of eight bytes, and over bytes at the end.
std::uint64_t Checksum(const char* bytes, std::size_t count)
{
  std::uint64_t sum = 0xcbf29ce484222325;
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8)
  {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + i, 8);
    sum = (sum ^ word) * 0x100000001b3;
  }
  for (; i < count; ++i)
  {
    sum = (sum ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3;
  }
  return sum;
}

class Encoder
{
public:
  explicit Encoder(std::uint64_t magic) { this->operator()(magic); }

  template <typename T>
  void operator()(const T& value)
  {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
    {
      this->Append(&value, sizeof value);
    }
    else
    {
      this->operator()(static_cast<std::uint64_t>(value.size()));
      this->Append(value.data(), value.size() * sizeof(typename T::value_type));
    }
  }

  std::string Finish()
  {
    this->operator()(Checksum(this->Bytes.data(), this->Bytes.size()));
    return std::move(this->Bytes);
  }

private:
  void Append(const void* data, std::size_t size)
  {
    if (size > 0)
    {
      this->Bytes.append(static_cast<const char*>(data), size);
    }
  }

  std::string Bytes;
};

class Decoder
{
public:
  Decoder(const std::string& bytes, std::uint64_t magic)
    : Bytes(bytes)
  {
    std::uint64_t found = 0;
    std::uint64_t sum = 0;
    if (bytes.size() < 16)
    {
      throw std::runtime_error("the message ends after " + std::to_string(bytes.size()) + " bytes");
    }
    std::memcpy(&found, bytes.data(), 8);
    if (found != magic)
    {
      throw std::runtime_error("the message does not begin as one");
    }
    this->End = bytes.size() - 8;
    std::memcpy(&sum, bytes.data() + this->End, 8);
    if (sum != Checksum(bytes.data(), this->End))
    {
      throw std::runtime_error("the message is damaged or cut off");
    }
    this->Place = 8;
  }

  template <typename T>
  void operator()(T& value)
  {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
    {
      this->Take(&value, 1, sizeof value);
    }
    else
    {
      std::uint64_t count = 0;
      this->Take(&count, 1, sizeof count);
      if (count > (this->End - this->Place) / sizeof(typename T::value_type))
      {
        throw std::runtime_error("a list is longer than the message");
      }
      value.resize(count);
      this->Take(value.data(), count, sizeof(typename T::value_type));
    }
  }

  void Finish() const
  {
    if (this->Place != this->End)
    {
      throw std::runtime_error("the message goes on after its end");
    }
  }

private:
  void Take(void* data, std::size_t count, std::size_t size)
  {
    if (count > (this->End - this->Place) / size)
    {
      throw std::runtime_error("a field is missing");
    }
    if (count > 0)
    {
      std::memcpy(data, this->Bytes.data() + this->Place, count * size);
    }
    this->Place += count * size;
  }

  const std::string& Bytes;
  std::size_t Place = 0;
  std::size_t End = 0;
};

template <typename Coder, typename Request>
void CodeRequest(Coder& coder, Request& request)
{
  coder(request.radiusEdgeRatio);
  coder(request.minimumDihedral);
  coder(request.timeLimit);
  coder(request.memoryLimit);
  coder(request.distance);
  coder(request.points);
  coder(request.sizes);
  coder(request.triangles);
  coder(request.segments);
  coder(request.rims);
}

template <typename Coder, typename Answer>
void CodeAnswer(Coder& coder, Answer& answer)
{
  coder(answer.status);
  coder(answer.message);
  coder(answer.points);
  coder(answer.tetrahedra);
  coder(answer.segmentEdges);
}

void CheckIndices(
  const std::vector<std::int64_t>& indices, std::size_t width, std::size_t points, const char* what)
{
  if (indices.size() % width != 0)
  {
    throw std::runtime_error(std::string("the list of ") + what + " has a wrong length");
  }
  for (const std::int64_t index : indices)
  {
    if (index < 0 || static_cast<std::size_t>(index) >= points)
    {
      throw std::runtime_error(
        std::string("one of the ") + what + " has a point that does not exist");
    }
  }
}
}

std::string Encode(const MesherRequest& request)
{
  Encoder encoder(requestMagic);
  CodeRequest(encoder, request);
  return encoder.Finish();
}

std::string Encode(const MesherAnswer& answer)
{
  Encoder encoder(answerMagic);
  CodeAnswer(encoder, answer);
  return encoder.Finish();
}

MesherRequest DecodeMesherRequest(const std::string& bytes)
{
  Decoder decoder(bytes, requestMagic);
  MesherRequest request;
  CodeRequest(decoder, request);
  decoder.Finish();
  const std::size_t points = request.points.size() / 3;
  if (request.points.size() % 3 != 0 || request.sizes.size() != points)
  {
    throw std::runtime_error("the lists of points and sizes do not fit");
  }
  CheckIndices(request.triangles, 3, points, "triangles");
  CheckIndices(request.segments, 2, points, "segments");
  CheckIndices(request.rims, 2, points, "rims");
  return request;
}

MesherAnswer DecodeMesherAnswer(const std::string& bytes)
{
  Decoder decoder(bytes, answerMagic);
  MesherAnswer answer;
  CodeAnswer(decoder, answer);
  decoder.Finish();
  if (answer.points.size() % 3 != 0 || answer.segmentEdges.size() % 3 != 0)
  {
    throw std::runtime_error("the list of points or edges has a wrong length");
  }
  CheckIndices(answer.tetrahedra, 4, answer.points.size() / 3, "tetrahedra");
  return answer;
}
}
