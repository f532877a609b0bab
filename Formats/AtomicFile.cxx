#include "AtomicFile.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <stdexcept>
#include <system_error>

namespace coronary
{
namespace fs = std::filesystem;

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
    if (std::FILE* file = std::fopen(candidate.string().c_str(), "wbx"))
    {
      std::fclose(file);
      this->Temporary = candidate.string();
      return;
    }
    if (errno != EEXIST)
    {
      break;
    }
  }
  throw std::runtime_error("Cannot write '" + path + "': " + std::strerror(errno) + ".");
}

AtomicFile::~AtomicFile()
{
  if (!this->Temporary.empty())
  {
    std::error_code ignored;
    fs::remove(this->Temporary, ignored);
  }
}

void AtomicFile::Commit()
{
  std::error_code error;
  fs::rename(this->Temporary, this->Final, error);
  if (error)
  {
    throw std::runtime_error("Cannot write '" + this->Final + "': " + error.message() + ".");
  }
  this->Temporary.clear();
}

void WriteFileAtomically(const std::string& path, const std::string& contents)
{
  AtomicFile target(path);
  std::FILE* file = std::fopen(target.TemporaryPath().c_str(), "wb");
  bool good = file != nullptr;
  if (file)
  {
    good = std::fwrite(contents.data(), 1, contents.size(), file) == contents.size();
    const int reason = errno;
    // A full disk may show only when the buffer is flushed.
    if (std::fclose(file) != 0)
    {
      good = false;
    }
    else
    {
      errno = reason;
    }
  }
  if (!good)
  {
    throw std::runtime_error("Cannot write '" + path + "': " + std::strerror(errno) + ".");
  }
  target.Commit();
}
}
