#include "AtomicFile.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
constexpr auto Abandoned = std::chrono::hours(1);
}

AtomicFile::AtomicFile(const std::string& path)
  : Final(path)
{
  const fs::path wanted(path);
  std::error_code ignored;
  if (!wanted.has_filename() || fs::is_directory(wanted, ignored))
  {
    throw std::runtime_error("Cannot write '" + path + "': it is a folder.");
  }
  static std::atomic<unsigned> counter{ 0 };
  std::random_device random;
  // "x" refuses a name that exists; a few attempts find a free one.
  for (int attempt = 0; attempt < 10; ++attempt)
  {
    const fs::path candidate = wanted.parent_path() /
      ("." + wanted.stem().string() + "." + std::to_string(random()) + "-" +
        std::to_string(counter++) + wanted.extension().string());
    this->File.reset(std::fopen(candidate.string().c_str(), "wbx"));
    if (this->File)
    {
      this->Temporary = candidate.string();
      return;
    }
    if (errno != EEXIST)
    {
      break;
    }
  }
  this->Fail();
}

void AtomicFile::Fail() const
{
  throw std::runtime_error("Cannot write '" + this->Final + "': " + std::strerror(errno) + ".");
}

AtomicFile::~AtomicFile()
{
  if (!this->Temporary.empty())
  {
    std::error_code ignored;
    fs::remove(this->Temporary, ignored);
  }
}

void AtomicFile::Write(const void* data, std::size_t bytes)
{
  if (std::fwrite(data, 1, bytes, this->File.get()) != bytes)
  {
    this->Fail();
  }
}

void AtomicFile::Overwrite(std::size_t position, const std::string& text)
{
  if (std::fseek(this->File.get(), static_cast<long>(position), SEEK_SET) != 0)
  {
    this->Fail();
  }
  this->Write(text.data(), text.size());
}

void AtomicFile::Commit()
{
  // A full disk may show only when the buffer is flushed.
  if (std::fclose(this->File.release()) != 0)
  {
    this->Fail();
  }
  std::error_code error;
  fs::rename(this->Temporary, this->Final, error);
  if (error)
  {
    throw std::runtime_error("Cannot write '" + this->Final + "': " + error.message() + ".");
  }
  this->Temporary.clear();
}

void RemoveAbandonedFiles(const std::string& path)
{
  const fs::path wanted(path);
  const std::string begin = "." + wanted.stem().string() + ".";
  const std::string end = wanted.extension().string();
  std::vector<fs::path> abandoned;
  std::error_code error;
  const fs::path folder = wanted.has_parent_path() ? wanted.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, error))
  {
    const std::string name = entry.path().filename().string();
    if (name.size() > begin.size() + end.size() && name.rfind(begin, 0) == 0 &&
      name.compare(name.size() - end.size(), end.size(), end) == 0 &&
      std::min(name.find_first_not_of("0123456789-", begin.size()), name.size()) ==
        name.size() - end.size() &&
      entry.last_write_time(error) + Abandoned < fs::file_time_type::clock::now())
    {
      abandoned.push_back(entry.path());
    }
  }
  for (const fs::path& left : abandoned)
  {
    fs::remove(left, error);
  }
}

void WriteFileAtomically(const std::string& path, const std::string& contents)
{
  AtomicFile file(path);
  file.Write(contents.data(), contents.size());
  file.Commit();
}
}
