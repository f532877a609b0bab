/**
 * @file Ranks.h
 * @brief The processes that mpirun or srun started of this program, or the one that was started plainly.
 *
 * MPI is there only when the program was built with it, and is started only when the environment says that
 * several processes were: a plain start must neither wait for it nor need a network.
 */
#ifndef DynamicCoronary_Ranks_h
#define DynamicCoronary_Ranks_h

#include "ItemSharing.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
class StagedFolder;

/// The base class is a process that works alone.
class RankGroup : public ItemSharing
{
public:
  /// Number of this process, from 0.
  virtual int Rank() const { return 0; }

  virtual int Size() const { return 1; }

  bool IsFirst() const { return this->Rank() == 0; }

  /// Whether an item is of this rank's share: they are dealt out in turn.
  bool Owns(std::size_t item) const
  {
    return item % static_cast<std::size_t>(this->Size()) == static_cast<std::size_t>(this->Rank());
  }

  std::size_t AtOnce() const override { return static_cast<std::size_t>(this->Size()); }

  /// All ranks have to call it. @throws as Gather
  std::vector<std::string> Results(
    const std::vector<std::size_t>& items, const Work& work) override;

  /**
   * Bytes of every rank, in the order of the ranks, on every rank. All ranks have to call it.
   * @throws std::runtime_error, Cancelled: another rank failed instead of coming here, and why
   */
  virtual std::vector<std::string> Gather(const std::string& own);

  /// Bytes of every rank one after the other on the first one. `all` has room for them; the others do not use it.
  /// All ranks have to call it. @throws as Gather
  virtual void Collect(const void* own, std::size_t size, void* all);

  /// The text of the first rank on every rank. All ranks have to call it. @throws as Gather
  std::string FromFirst(const std::string& text);

  /**
   * Unfinished files of all ranks, for a folder that all see; the first one owns and commits them. All ranks have to
   * call it. @throws as StagedFolder and Gather
   */
  std::unique_ptr<StagedFolder> MakeFolder(const std::string& folder);

  /**
   * Does `work`, and comes back, or throws, on all ranks together: what one of them throws, all throw. All ranks
   * have to call it.
   * @throws what `work` throws here or on another rank
   */
  virtual void Agree(const std::function<void()>& work);

  /// Why the ranks stop, where one of them has failed; else `own`.
  virtual std::string Reason(const std::string& own) const { return own; }

  /// Threads for what all ranks do at once: a fair share of the cores of this machine that the process may use.
  virtual int SharedCores() const;

  /// Threads for what this rank does while the others wait: all of these cores.
  virtual int AllCores() const;

  ///@{
  /// Messages, in the order in which they were sent. Receive() gives false when there is none.
  virtual void Send(int rank, const std::string& message);
  virtual bool Receive(int& rank, std::string& message);
  ///@}
};

/// Those of this process; before StartRanks() it is alone.
RankGroup& Ranks();

/// Whether this process is the first, or the only one, as far as the environment says: also before StartRanks().
bool IsFirstProcess();

/// Starts MPI when the environment says that there are several processes.
/// @throws std::runtime_error when that is not possible
void StartRanks();

/// Ends MPI, where it was started.
void FinishRanks();

/// Lines of every rank on the first one, each once, those of the first rank first; the others get none.
std::vector<std::string> LinesOfAll(const std::vector<std::string>& own);

/// While it lives the other ranks of this machine wait: with `threads` 0, all cores work for this one.
class OthersWait
{
public:
  explicit OthersWait(int threads);
  ~OthersWait();
  OthersWait(const OthersWait&) = delete;
  OthersWait& operator=(const OthersWait&) = delete;

private:
  const int Threads;
};

/// Sets the number of threads; 0: SharedCores().
void UseThreads(int threads);
}

#endif
