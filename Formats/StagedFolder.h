/**
 * @file StagedFolder.h
 * @brief A set of files that appears in a folder only when all of them are whole.
 */
#ifndef DynamicCoronary_StagedFolder_h
#define DynamicCoronary_StagedFolder_h

#include <string>
#include <vector>

namespace coronary
{
/**
 * Files that belong together are written to a hidden folder inside the wanted one and moved out of
 * it by Commit(): an older set of the same names is never mixed with half of a new one.
 * Without Commit() (an exception, an interruption) the destructor removes what was written, and
 * the folders that were made for it. What a process left that was killed, the next one in this folder removes; a lock
 * tells it from what is in the making.
 */
class StagedFolder
{
public:
  /// Makes the folder, and its parents.
  /// @throws std::runtime_error naming `folder` when it can not be made or written to.
  explicit StagedFolder(const std::string& folder);

  /**
   * The same for a process that helps another one, whose unfinished files are in `staging`: files may be added and
   * written. That process, after it has added their names too, commits them or takes them away.
   */
  StagedFolder(const std::string& folder, const std::string& staging);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /**
   * Where to write the file that is to become folder/name; makes its subfolder.
   * @throws std::runtime_error naming folder/name when that can not be a file.
   */
  std::string Add(const std::string& name);

  /// Where its files are until they are committed.
  const std::string& StagingPath() const { return this->Staging; }

  /// False: it is another process's.
  bool IsOwner() const { return this->Owner; }

  /// What was added, in its order.
  const std::vector<std::string>& Added() const { return this->Names; }

  /// Where a file is now that was added.
  std::string PathOf(const std::string& name) const;

  /**
   * Moves the files to their place in the order of their Add(), replacing older ones.
   * The last one describes the others: an older one of its name is removed first, so that it never
   * stands beside files that it does not describe.
   * @throws std::runtime_error naming the file that could not be moved.
   */
  void Commit();

  /// The older file of the last one's name describes none of the others: it stays until it is replaced.
  void KeepLast() { this->LastStays = true; }

  /**
   * Files of an older set that this one takes the place of: Commit() removes those that it does not replace, and the
   * folders that are empty then. Only plain files below the folder are removed, whatever the names say.
   */
  void TakePlaceOf(const std::vector<std::string>& names);

  /// A message about a staged file, with the name that the user knows.
  std::string Translate(const std::string& message) const;

private:
  /// Removes what is not committed.
  void Discard();
  void RemoveOlder();
  void Unlock();

  std::string Folder;
  std::string Staging; ///< empty once committed
  int Lock = -1;       ///< file that holds the lock of Staging; -1: none
  std::vector<std::string> Names;
  std::vector<std::string> Older;
  std::vector<std::string> Created; ///< folders to remove again, outermost first
  bool LastStays = false;
  const bool Owner = true; ///< of what is in Staging; false: another process is
};
}

#endif
