#include "StagedFolder.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include <cstdlib> // for mkdtemp
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
constexpr const char* StagingName = ".unfinished-";

[[noreturn]] void Fail(const fs::path& path, const std::string& reason)
{
  throw std::runtime_error("Cannot write '" + path.string() + "': " + reason + ".");
}

// "a/./b/" as "a/b".
std::string Normalized(const std::string& folder)
{
  const fs::path path = fs::path(folder).lexically_normal();
  return (path.has_filename() || !path.has_relative_path() ? path : path.parent_path()).string();
}

/// Makes the folder and its parents; gives those that were not there, outermost first.
std::vector<std::string> MakeFolders(const fs::path& folder)
{
  std::vector<std::string> created;
  fs::path path;
  for (const fs::path& part : folder)
  {
    path /= part;
    std::error_code error;
    if (fs::create_directory(path, error))
    {
      created.push_back(path.string());
      continue;
    }
    std::error_code ignored;
    if (!fs::is_directory(path, ignored))
    {
      Fail(folder,
        fs::exists(path, ignored) ? "'" + path.string() + "' is not a folder" : error.message());
    }
  }
  return created;
}

void RemoveEmptyFolders(const std::vector<std::string>& folders)
{
  for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder)
  {
    std::error_code ignored;
    fs::remove(*folder, ignored);
  }
}

/// -1 when another process has it, it is gone, or the file system knows no locks.
int LockFolder(const std::string& folder)
{
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0)
  {
    close(file);
    return -1;
  }
  return file;
}

/// Removes what killed processes left: whoever works on a folder of ours holds its lock.
void RemoveAbandoned(const std::string& folder, const std::string& except)
{
  constexpr auto Settled = std::chrono::minutes(1); // a folder is locked a moment after it is made
  std::vector<fs::path> abandoned;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
  {
    const std::string name = entry.path().filename().string();
    if (name.rfind(StagingName, 0) == 0 && entry.path() != except &&
      entry.last_write_time(error) + Settled < fs::file_time_type::clock::now())
    {
      abandoned.push_back(entry.path());
    }
  }
  for (const fs::path& path : abandoned)
  {
    const int lock = LockFolder(path.string());
    if (lock >= 0)
    {
      fs::remove_all(path, error);
      close(lock);
    }
  }
}
}

StagedFolder::StagedFolder(const std::string& folder)
  : Folder(Normalized(folder))
  , Created(MakeFolders(this->Folder))
{
  std::string name = (fs::path(this->Folder) / (std::string(StagingName) + "XXXXXX")).string();
  if (!mkdtemp(name.data()))
  {
    const std::string reason = std::strerror(errno);
    RemoveEmptyFolders(this->Created);
    Fail(this->Folder, reason);
  }
  this->Staging = name;
  this->Lock = LockFolder(name);
  RemoveAbandoned(this->Folder, name);
}

StagedFolder::StagedFolder(const std::string& folder, const std::string& staging)
  : Folder(Normalized(folder))
  , Staging(staging)
  , Owner(false)
{
}

StagedFolder::~StagedFolder()
{
  this->Discard();
}

void StagedFolder::Discard()
{
  if (this->Owner && !this->Staging.empty())
  {
    std::error_code ignored;
    fs::remove_all(this->Staging, ignored);
    RemoveEmptyFolders(this->Created);
  }
  this->Unlock();
}

void StagedFolder::Unlock()
{
  if (this->Lock >= 0)
  {
    close(this->Lock);
    this->Lock = -1;
  }
}

std::string StagedFolder::Add(const std::string& name)
{
  const fs::path wanted = fs::path(this->Folder) / name;
  std::error_code ignored;
  if (fs::is_directory(wanted, ignored))
  {
    Fail(wanted, "it is a folder");
  }
  const fs::path parent = wanted.parent_path();
  if (fs::exists(parent, ignored) && !fs::is_directory(parent, ignored))
  {
    Fail(wanted, "'" + parent.string() + "' is not a folder");
  }
  const fs::path staged = fs::path(this->Staging) / name;
  std::error_code error;
  fs::create_directories(staged.parent_path(), error);
  if (error)
  {
    Fail(wanted, error.message());
  }
  this->Names.push_back(name);
  return staged.string();
}

std::string StagedFolder::PathOf(const std::string& name) const
{
  return (fs::path(this->Staging.empty() ? this->Folder : this->Staging) / name).string();
}

void StagedFolder::Commit()
{
  const fs::path folder(this->Folder);
  const fs::path staging(this->Staging);
  std::error_code error;
  const auto move = [&](const std::string& name)
  {
    fs::create_directories((folder / name).parent_path(), error);
    fs::rename(staging / name, folder / name, error);
    if (error)
    {
      Fail(folder / name, error.message());
    }
  };
  if (!this->Names.empty() && !this->LastStays)
  {
    fs::remove(folder / this->Names.back(), error);
  }
  for (std::size_t n = 0; n + 1 < this->Names.size(); ++n)
  {
    move(this->Names[n]);
  }
  this->RemoveOlder();
  if (!this->Names.empty())
  {
    move(this->Names.back());
  }
  fs::remove_all(staging, error);
  this->Staging.clear();
  this->Unlock();
}

void StagedFolder::RemoveOlder()
{
  const fs::path folder(this->Folder);
  std::error_code error;
  for (const std::string& name : this->Older)
  {
    if (std::find(this->Names.begin(), this->Names.end(), name) != this->Names.end())
    {
      continue;
    }
    const fs::path old = folder / name;
    if (fs::is_regular_file(fs::symlink_status(old, error)))
    {
      fs::remove(old, error);
      for (fs::path below = fs::path(name).parent_path(); !below.empty();
           below = below.parent_path())
      {
        if (!fs::remove(folder / below, error))
        {
          break;
        }
      }
    }
  }
}

void StagedFolder::TakePlaceOf(const std::vector<std::string>& names)
{
  for (const std::string& name : names)
  {
    const fs::path path = fs::path(name).lexically_normal();
    if (path.is_relative() && !path.empty() && *path.begin() != "..")
    {
      this->Older.push_back(path.string());
    }
  }
}

std::string StagedFolder::Translate(const std::string& message) const
{
  std::string result = message;
  if (this->Staging.empty())
  {
    return result;
  }
  for (std::size_t at = 0; (at = result.find(this->Staging, at)) != std::string::npos;)
  {
    result.replace(at, this->Staging.size(), this->Folder);
    at += this->Folder.size();
  }
  return result;
}
}
