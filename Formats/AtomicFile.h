/**
 * @file AtomicFile.h
 * @brief Files that appear under their name only when they are whole.
 */
#ifndef DynamicCoronary_AtomicFile_h
#define DynamicCoronary_AtomicFile_h

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

namespace coronary
{
/**
 * A temporary file beside the wanted one, renamed to it by Commit().
 *
 * Until Commit() the wanted name is untouched: an older file of that name stays readable. Without
 * Commit() (an exception, an abort) the destructor removes the temporary file.
 * The folder must exist. The temporary name keeps the extension, for writers that look at it.
 */
class AtomicFile
{
public:
  /// @throws std::runtime_error naming `path` when its folder can not be written to.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where others may write instead of Write(): an existing, empty file in the folder of Path().
  const std::string& TemporaryPath() const { return this->Temporary; }

  /// The name that Commit() gives it.
  const std::string& Path() const { return this->Final; }

  ///@{
  /// Behind what was written, or over what is at a byte of the file already.
  /// @throws std::runtime_error naming Path() and the reason (disk full, ...).
  void Write(const void* data, std::size_t bytes);
  void Overwrite(std::size_t position, const std::string& text);
  ///@}

  /**
   * Renames the temporary file to Path(), replacing what was there. Others who write to it close it first.
   * @throws std::runtime_error naming Path() and the reason when that fails.
   */
  void Commit();

private:
  [[noreturn]] void Fail() const;

  std::string Final;
  std::string Temporary; ///< empty once committed
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> File{ nullptr, &std::fclose };
};

/**
 * Removes what killed processes left of AtomicFiles of this path: those that nobody has written to for an hour. For
 * folders that many runs write to, as caches; what can not be removed stays.
 */
void RemoveAbandonedFiles(const std::string& path);

/**
 * Writes `contents` to `path` atomically.
 * @throws std::runtime_error naming `path` and the reason (no such folder, disk full, ...).
 */
void WriteFileAtomically(const std::string& path, const std::string& contents);
}

#endif
