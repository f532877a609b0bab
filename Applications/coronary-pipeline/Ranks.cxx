#include "Ranks.h"

#include "Command.h"
#include "Interruption.h"
#include "ParallelFor.h"
#include "StagedFolder.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <sstream>
#include <stdexcept>
#include <utility>

#ifdef DYNAMICCORONARY_WITH_MPI
// Without the C++ bindings of old MPIs.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <sched.h>

#include <chrono>
#include <climits>
#include <deque>
#include <thread>
#endif

namespace coronary
{
namespace
{
/// The number of this process, or of all, by the variables of the usual starters; -1: not said.
int FromEnvironment(std::initializer_list<const char*> names)
{
  for (const char* name : names)
  {
    if (const char* value = std::getenv(name))
    {
      return std::atoi(value);
    }
  }
  return -1;
}

int StartedProcesses()
{
  const int count = FromEnvironment(
    { "OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "MV2_COMM_WORLD_SIZE" });
  if (count < 0 && std::getenv("PMIX_RANK"))
  {
    // srun --mpi=pmix does not say it in a variable of PMIx.
    return FromEnvironment({ "SLURM_STEP_NUM_TASKS", "SLURM_NTASKS" });
  }
  return count;
}

std::unique_ptr<RankGroup>& Group()
{
  static std::unique_ptr<RankGroup> group = std::make_unique<RankGroup>();
  return group;
}

#ifdef DYNAMICCORONARY_WITH_MPI
/// How a rank failed, as bytes for the others.
std::string DescribeFailure()
{
  try
  {
    throw;
  }
  catch (const UsageError& error)
  {
    return std::string("U") + error.what();
  }
  catch (const Cancelled&)
  {
    return "C" + std::to_string(Interruption());
  }
  catch (const std::bad_alloc&)
  {
    return "M";
  }
  catch (const std::exception& error)
  {
    return std::string("E") + error.what();
  }
}

[[noreturn]] void ThrowFailure(const std::string& failure)
{
  switch (failure.front())
  {
    case 'U':
      throw UsageError(failure.substr(1));
    case 'C':
      RememberInterruption(std::atoi(failure.c_str() + 1));
      throw Cancelled();
    case 'M':
      throw std::bad_alloc();
    default:
      throw std::runtime_error(failure.substr(1));
  }
}

class MpiRanks : public RankGroup
{
public:
  MpiRanks();
  ~MpiRanks() override;

  int Rank() const override { return this->Own; }
  int Size() const override { return this->Count; }
  std::vector<std::string> Gather(const std::string& own) override;
  void Collect(const void* own, std::size_t size, void* all) override;
  void Agree(const std::function<void()>& work) override;
  std::string Reason(const std::string& own) const override;
  int SharedCores() const override { return this->Shared; }
  int AllCores() const override { return this->All; }
  void Send(int rank, const std::string& message) override;
  bool Receive(int& rank, std::string& message) override;

private:
  enum Tags
  {
    PartTag = 1,
    MessageTag = 2
  };
  /// An MPI library waits at full speed, which would take the cores away from those who work.
  static void Wait(MPI_Request& request);
  /// How many bytes each rank brings to what follows. A rank that has failed says so here, and why.
  /// @throws what a rank failed with
  std::vector<long long> Announce(long long own, const std::string& failure);
  std::vector<std::string> GatherBytes(const std::string& own, const std::vector<long long>& sizes);
  void CountCores();

  int Own = 0;
  int Count = 1;
  int Shared = 1;
  int All = 1;
  std::string Failure; ///< that all know of; empty: none
  std::deque<std::pair<std::string, MPI_Request>> Sent;
};

MpiRanks::MpiRanks()
{
  int provided = 0;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS)
  {
    throw std::runtime_error("MPI can not be started.");
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &this->Own);
  MPI_Comm_size(MPI_COMM_WORLD, &this->Count);
  this->CountCores();
}

MpiRanks::~MpiRanks()
{
  for (auto& [text, request] : this->Sent)
  {
    Wait(request);
  }
  MPI_Finalize();
}

void MpiRanks::CountCores()
{
  cpu_set_t own;
  CPU_ZERO(&own);
  if (sched_getaffinity(0, sizeof(own), &own) != 0)
  {
    return;
  }
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, this->Own, MPI_INFO_NULL, &machine);
  int neighbours = 1;
  MPI_Comm_size(machine, &neighbours);
  std::vector<cpu_set_t> sets(static_cast<std::size_t>(neighbours));
  MPI_Allgather(&own, sizeof(own), MPI_BYTE, sets.data(), sizeof(own), MPI_BYTE, machine);
  MPI_Comm_free(&machine);
  double share = 0.0;
  for (int core = 0; core < CPU_SETSIZE; ++core)
  {
    if (CPU_ISSET(core, &own))
    {
      share += 1.0 /
        static_cast<double>(std::count_if(sets.begin(), sets.end(),
          [core](const cpu_set_t& set) { return CPU_ISSET(core, &set); }));
    }
  }
  this->Shared = std::max(1, static_cast<int>(share + 1e-6));
  this->All = std::max(1, CPU_COUNT(&own));
}

void MpiRanks::Wait(MPI_Request& request)
{
  using namespace std::chrono_literals;
  auto pause = 20us;
  for (int done = 0;;)
  {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done)
    {
      return;
    }
    std::this_thread::sleep_for(pause);
    pause = std::min<std::chrono::microseconds>(2 * pause, 2ms);
  }
}

std::vector<long long> MpiRanks::Announce(long long own, const std::string& failure)
{
  if (!this->Failure.empty())
  {
    ThrowFailure(this->Failure);
  }
  // Below zero: the length of what went wrong.
  const long long word = failure.empty() ? own : -static_cast<long long>(failure.size());
  std::vector<long long> sizes(static_cast<std::size_t>(this->Count));
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgather(&word, 1, MPI_LONG_LONG, sizes.data(), 1, MPI_LONG_LONG, MPI_COMM_WORLD, &request);
  Wait(request);
  // NOLINTNEXTLINE(clang-analyzer-optin.mpi.MPI-Checker): Wait() ends it, with MPI_Test
  if (std::none_of(sizes.begin(), sizes.end(), [](long long size) { return size < 0; }))
  {
    return sizes;
  }
  for (long long& size : sizes)
  {
    size = std::max(0LL, -size);
  }
  const std::vector<std::string> failures = this->GatherBytes(failure, sizes);
  const auto first = std::find_if(
    failures.begin(), failures.end(), [](const std::string& text) { return !text.empty(); });
  this->Failure = *first;
  const auto rank = first - failures.begin();
  if (rank > 0 && this->Failure.front() == 'E')
  {
    this->Failure += " (rank " + std::to_string(rank) + " of " + std::to_string(this->Count) + ")";
  }
  ThrowFailure(this->Failure);
}

std::vector<std::string> MpiRanks::GatherBytes(
  const std::string& own, const std::vector<long long>& sizes)
{
  std::vector<int> counts;
  std::vector<int> places;
  long long total = 0;
  for (const long long size : sizes)
  {
    places.push_back(static_cast<int>(std::min<long long>(total, INT_MAX)));
    counts.push_back(static_cast<int>(std::min<long long>(size, INT_MAX)));
    total += size;
  }
  if (total > INT_MAX)
  {
    throw std::runtime_error("The ranks have more than 2 GB to tell each other at once.");
  }
  std::string all(static_cast<std::size_t>(total), '\0');
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgatherv(own.data(), static_cast<int>(own.size()), MPI_BYTE, all.data(), counts.data(),
    places.data(), MPI_BYTE, MPI_COMM_WORLD, &request);
  Wait(request);
  std::vector<std::string> parts;
  for (std::size_t rank = 0; rank < counts.size(); ++rank)
  {
    parts.push_back(
      all.substr(static_cast<std::size_t>(places[rank]), static_cast<std::size_t>(counts[rank])));
  }
  return parts;
}

std::vector<std::string> MpiRanks::Gather(const std::string& own)
{
  return this->GatherBytes(own, this->Announce(static_cast<long long>(own.size()), {}));
}

void MpiRanks::Collect(const void* own, std::size_t size, void* all)
{
  constexpr std::size_t most = std::size_t{ 1 } << 30; // a count of MPI has 31 bits
  const std::vector<long long> sizes = this->Announce(static_cast<long long>(size), {});
  const auto inPieces = [&](std::size_t bytes, const auto& start)
  {
    // NOLINTNEXTLINE(clang-analyzer-optin.mpi.MPI-Checker): Wait() ends it, with MPI_Test
    for (std::size_t at = 0; at < bytes; at += most)
    {
      MPI_Request request = MPI_REQUEST_NULL;
      start(at, static_cast<int>(std::min(most, bytes - at)), &request);
      Wait(request);
    }
  };
  if (!this->IsFirst())
  {
    inPieces(size,
      [&](std::size_t at, int count, MPI_Request* request)
      {
        MPI_Isend(
          static_cast<const char*>(own) + at, count, MPI_BYTE, 0, PartTag, MPI_COMM_WORLD, request);
      });
    return;
  }
  auto* to = static_cast<char*>(all);
  std::memmove(to, own, size);
  for (int rank = 1; rank < this->Count; ++rank)
  {
    to += sizes[static_cast<std::size_t>(rank) - 1];
    inPieces(static_cast<std::size_t>(sizes[static_cast<std::size_t>(rank)]),
      [&](std::size_t at, int count, MPI_Request* request)
      { MPI_Irecv(to + at, count, MPI_BYTE, rank, PartTag, MPI_COMM_WORLD, request); });
  }
}

void MpiRanks::Agree(const std::function<void()>& work)
{
  std::string failure;
  try
  {
    work();
  }
  catch (...)
  {
    failure = DescribeFailure();
  }
  this->Announce(0, failure);
}

std::string MpiRanks::Reason(const std::string& own) const
{
  return this->Failure.size() > 1 && this->Failure.front() == 'E' ? this->Failure.substr(1) : own;
}

void MpiRanks::Send(int rank, const std::string& message)
{
  for (int done = 1; !this->Sent.empty() && done;)
  {
    MPI_Test(&this->Sent.front().second, &done, MPI_STATUS_IGNORE);
    if (done)
    {
      this->Sent.pop_front();
    }
  }
  this->Sent.emplace_back(message, MPI_REQUEST_NULL);
  auto& [text, request] = this->Sent.back();
  MPI_Isend(text.data(), static_cast<int>(text.size()), MPI_BYTE, rank, MessageTag, MPI_COMM_WORLD,
    &request);
}

bool MpiRanks::Receive(int& rank, std::string& message)
{
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MessageTag, MPI_COMM_WORLD, &there, &status);
  if (!there)
  {
    return false;
  }
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  message.resize(static_cast<std::size_t>(size));
  rank = status.MPI_SOURCE;
  MPI_Recv(message.data(), size, MPI_BYTE, rank, MessageTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return true;
}
#endif
}

std::vector<std::string> RankGroup::Results(const std::vector<std::size_t>& items, const Work& work)
{
  // What each rank did, one after the other, each behind its length.
  std::string own;
  for (const std::size_t item : items)
  {
    if (this->Owns(item))
    {
      const std::string result = work(item);
      const std::uint64_t size = result.size();
      own.append(reinterpret_cast<const char*>(&size), sizeof(size));
      own += result;
    }
  }
  std::vector<std::string> all = this->Gather(own);
  std::vector<std::size_t> next(all.size(), 0);
  std::vector<std::string> results;
  for (const std::size_t item : items)
  {
    const std::size_t rank = item % all.size();
    std::uint64_t size = 0;
    std::memcpy(&size, all[rank].data() + next[rank], sizeof(size));
    results.push_back(all[rank].substr(next[rank] + sizeof(size), size));
    next[rank] += sizeof(size) + size;
  }
  return results;
}

std::vector<std::string> RankGroup::Gather(const std::string& own)
{
  return { own };
}

void RankGroup::Collect(const void* own, std::size_t size, void* all)
{
  std::memmove(all, own, size);
}

std::string RankGroup::FromFirst(const std::string& text)
{
  return this->Gather(this->IsFirst() ? text : std::string()).front();
}

std::unique_ptr<StagedFolder> RankGroup::MakeFolder(const std::string& folder)
{
  if (this->IsFirst())
  {
    auto own = std::make_unique<StagedFolder>(folder);
    this->FromFirst(own->StagingPath());
    return own;
  }
  return std::make_unique<StagedFolder>(folder, this->FromFirst({}));
}

void RankGroup::Agree(const std::function<void()>& work)
{
  work();
}

int RankGroup::SharedCores() const
{
  return 0;
}

int RankGroup::AllCores() const
{
  return 0;
}

void RankGroup::Send(int, const std::string&)
{
  throw std::logic_error("there is no other rank");
}

bool RankGroup::Receive(int&, std::string&)
{
  return false;
}

RankGroup& Ranks()
{
  return *Group();
}

bool IsFirstProcess()
{
  return StartedProcesses() < 2 ||
    FromEnvironment({ "OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "MV2_COMM_WORLD_RANK" }) <=
    0;
}

void StartRanks()
{
  const int count = StartedProcesses();
  if (count < 2)
  {
    return;
  }
#ifdef DYNAMICCORONARY_WITH_MPI
  Group() = std::make_unique<MpiRanks>();
  if (Ranks().Size() != count)
  {
    throw std::runtime_error(std::to_string(count) + " processes were started, but MPI knows of " +
      std::to_string(Ranks().Size()) + ": mpirun is of another MPI than the program.");
  }
#else
  throw std::runtime_error(
    std::to_string(count) + " processes were started, but the program was built without MPI.");
#endif
}

void FinishRanks()
{
  Group() = std::make_unique<RankGroup>();
}

std::vector<std::string> LinesOfAll(const std::vector<std::string>& own)
{
  std::string text;
  for (const std::string& line : own)
  {
    text += line + '\n';
  }
  const std::vector<std::string> all = Ranks().Gather(text);
  std::vector<std::string> lines;
  for (std::size_t rank = 0; Ranks().IsFirst() && rank < all.size(); ++rank)
  {
    std::istringstream stream(all[rank]);
    for (std::string line; std::getline(stream, line);)
    {
      if (std::find(lines.begin(), lines.end(), line) == lines.end())
      {
        lines.push_back(line);
      }
    }
  }
  return lines;
}

OthersWait::OthersWait(int threads)
  : Threads(threads)
{
  SetNumberOfThreads(threads > 0 ? threads : Ranks().AllCores());
}

OthersWait::~OthersWait()
{
  UseThreads(this->Threads);
}

void UseThreads(int threads)
{
  SetNumberOfThreads(threads > 0 ? threads : Ranks().SharedCores());
}
}
