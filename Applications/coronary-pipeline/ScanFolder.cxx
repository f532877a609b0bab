#include "ScanFolder.h"

#include "AtomicFile.h"
#include "TextFile.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;

constexpr const char* KeyName = "scan.txt";
constexpr const char* PartEnd = ".part";
}

ScanFolder::ScanFolder(const std::string& folder, const std::string& description)
  : Folder(folder)
{
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
  {
    throw std::runtime_error("'" + folder + "' can not be made: " + error.message());
  }
  const std::string key = (fs::path(folder) / KeyName).string();
  const bool same = fs::exists(key) && ReadTextFile(key, "a scan's settings") == description;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
  {
    if (entry.path().extension() == PartEnd)
    {
      if (same)
      {
        ++this->Before;
      }
      else
      {
        fs::remove(entry.path());
      }
    }
  }
  if (!same)
  {
    WriteFileAtomically(key, description);
  }
}

std::string ScanFolder::PathOf(const std::string& name) const
{
  return (fs::path(this->Folder) / (name + PartEnd)).string();
}

bool ScanFolder::Has(const std::string& name) const
{
  return fs::exists(this->PathOf(name));
}

void ScanFolder::Put(const std::string& name, const std::vector<std::int16_t>& part)
{
  AtomicFile file(this->PathOf(name));
  file.Write(part.data(), part.size() * sizeof(part[0]));
  file.Commit();
}

std::vector<std::int16_t> ScanFolder::Get(const std::string& name) const
{
  const std::string path = this->PathOf(name);
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto bytes = static_cast<std::streamoff>(file.tellg());
  std::vector<std::int16_t> part(bytes > 0 ? bytes / sizeof(std::int16_t) : 0);
  file.seekg(0);
  if (bytes <= 0 ||
    !file.read(reinterpret_cast<char*>(part.data()),
      static_cast<std::streamsize>(part.size() * sizeof(part[0]))))
  {
    throw std::runtime_error("'" + path + "' can not be read");
  }
  return part;
}

void ScanFolder::Remove()
{
  std::error_code error;
  fs::remove_all(this->Folder, error);
}
}
