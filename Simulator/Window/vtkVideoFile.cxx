#include "vtkVideoFile.h"

#include "AtomicFile.h"

#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkOggTheoraWriter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace coronary
{
namespace
{
constexpr std::size_t MostWaiting = 8; // pictures: 30 MB at 1500 x 860

struct Picture
{
  int width = 0;
  int height = 0;
  double seconds = 0.0;
  std::vector<std::uint8_t> pixels; // from the bottom, as VTK has them
};
}

struct vtkVideoFile::Internals
{
  Internals(const std::string& path, double rate)
    : File(path)
    , Name(path)
    , Rate(rate)
  {
  }

  void Run();
  void Write(const Picture& picture);

  AtomicFile File;
  std::string Name;
  double Rate;
  vtkNew<vtkOggTheoraWriter> Writer;
  vtkNew<vtkImageData> Image;
  bool Started = false;
  std::int64_t Written = 0; ///< pictures of the film
  std::mutex Mutex;
  std::condition_variable Condition;
  std::deque<Picture> Waiting;
  bool Over = false;
  bool Failed = false;
  std::atomic<std::uint64_t> Dropped{ 0 };
  std::thread Thread;
};

void vtkVideoFile::Internals::Write(const Picture& picture)
{
  if (!this->Started)
  {
    // Theora wants even sizes.
    this->Image->SetDimensions(picture.width & ~1, picture.height & ~1, 1);
    this->Image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
    this->Writer->SetInputData(this->Image);
    this->Writer->SetFileName(this->File.TemporaryPath().c_str());
    this->Writer->SetRate(static_cast<int>(std::lround(this->Rate)));
    this->Writer->SetQuality(1);
    this->Writer->SetSubsampling(1);
    this->Writer->Start();
    this->Started = true;
  }
  // The picture before stays until this one's time.
  const std::int64_t place = std::llround(picture.seconds * this->Rate);
  for (; this->Written > 0 && this->Written < place; ++this->Written)
  {
    this->Writer->Write();
  }
  if (this->Written > place)
  {
    return; // two for one place
  }
  const int* size = this->Image->GetDimensions();
  auto* to = static_cast<std::uint8_t*>(this->Image->GetScalarPointer());
  const auto row = static_cast<std::size_t>(size[0]) * 3;
  const std::size_t width = static_cast<std::size_t>(picture.width) * 3;
  for (int y = 0; y < size[1]; ++y)
  {
    std::uint8_t* line = to + static_cast<std::size_t>(y) * row;
    std::memset(line, 0, row);
    const int from = y + picture.height - size[1]; // the tops are together
    if (from >= 0 && from < picture.height)
    {
      std::memcpy(
        line, &picture.pixels[static_cast<std::size_t>(from) * width], std::min(row, width));
    }
  }
  this->Image->Modified();
  this->Writer->Write();
  ++this->Written;
  this->Failed = this->Failed || this->Writer->GetError() != 0;
}

void vtkVideoFile::Internals::Run()
{
  while (true)
  {
    Picture picture;
    {
      std::unique_lock<std::mutex> lock(this->Mutex);
      this->Condition.wait(lock, [this] { return this->Over || !this->Waiting.empty(); });
      if (this->Waiting.empty())
      {
        break;
      }
      picture = std::move(this->Waiting.front());
      this->Waiting.pop_front();
    }
    this->Write(picture);
  }
  if (this->Started)
  {
    this->Writer->End();
    this->Failed = this->Failed || this->Writer->GetError() != 0;
  }
}

vtkVideoFile::vtkVideoFile(const std::string& path, double rate)
{
  if (!(rate >= 1.0 && rate <= 60.0))
  {
    throw std::invalid_argument("A film has 1 to 60 pictures a second.");
  }
  this->Data = std::make_unique<Internals>(path, rate);
  this->Data->Thread = std::thread([this] { this->Data->Run(); });
}

vtkVideoFile::~vtkVideoFile()
{
  if (this->Data->Thread.joinable())
  {
    {
      const std::lock_guard<std::mutex> lock(this->Data->Mutex);
      this->Data->Waiting.clear();
      this->Data->Over = true;
    }
    this->Data->Condition.notify_one();
    this->Data->Thread.join();
  }
}

void vtkVideoFile::Add(
  const std::uint8_t* pixels, int width, int height, std::size_t stride, double seconds)
{
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.seconds = seconds;
  const auto row = static_cast<std::size_t>(width) * 3;
  picture.pixels.resize(row * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
  {
    std::memcpy(&picture.pixels[static_cast<std::size_t>(height - 1 - y) * row],
      pixels + static_cast<std::size_t>(y) * stride, row);
  }
  {
    const std::lock_guard<std::mutex> lock(this->Data->Mutex);
    if (this->Data->Waiting.size() >= MostWaiting)
    {
      ++this->Data->Dropped;
      return;
    }
    this->Data->Waiting.push_back(std::move(picture));
  }
  this->Data->Condition.notify_one();
}

std::uint64_t vtkVideoFile::Dropped() const
{
  return this->Data->Dropped;
}

void vtkVideoFile::Finish()
{
  {
    const std::lock_guard<std::mutex> lock(this->Data->Mutex);
    this->Data->Over = true;
  }
  this->Data->Condition.notify_one();
  this->Data->Thread.join();
  if (!this->Data->Started)
  {
    return; // a film of no picture is no file
  }
  if (this->Data->Failed)
  {
    throw std::runtime_error("Cannot write '" + this->Data->Name + "'.");
  }
  this->Data->File.Commit();
}
}
