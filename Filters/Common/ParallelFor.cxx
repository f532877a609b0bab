#include "ParallelFor.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace coronary
{
namespace
{
int DefaultNumberOfThreads()
{
  int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (const char* limit = std::getenv("VTK_SMP_MAX_THREADS"))
  {
    const long value = std::strtol(limit, nullptr, 10);
    if (value > 0)
    {
      threads = static_cast<int>(std::min<long>(threads, value));
    }
  }
  return threads;
}

std::atomic<int> RequestedThreads{ 0 };
thread_local bool InsideLoop = false;

struct Loop
{
  std::int64_t count = 0;
  std::int64_t grain = 1;
  const std::function<void(std::int64_t, std::int64_t)>* body = nullptr;
  std::atomic<std::int64_t> next{ 0 };
  std::atomic<std::int64_t> done{ 0 };
  std::atomic<bool> stop{ false };
  std::mutex mutex;
  std::exception_ptr error;

  bool RunOne()
  {
    if (this->stop)
    {
      return false;
    }
    const std::int64_t first = this->next.fetch_add(this->grain);
    if (first >= this->count)
    {
      return false;
    }
    const std::int64_t last = std::min(this->count, first + this->grain);
    try
    {
      (*this->body)(first, last);
    }
    catch (...)
    {
      const std::lock_guard<std::mutex> lock(this->mutex);
      if (!this->error)
      {
        this->error = std::current_exception();
      }
      this->stop = true;
    }
    this->done += last - first;
    return true;
  }
};

/// Sleeping workers that help whichever thread calls Run.
class Pool
{
public:
  static Pool& Instance()
  {
    static Pool pool;
    return pool;
  }

  ~Pool()
  {
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      this->Quit = true;
    }
    this->Wake.notify_all();
    for (std::thread& worker : this->Workers)
    {
      worker.join();
    }
  }

  /// One loop at a time has the workers; a second caller is told to go on alone.
  bool Start(Loop& loop, int helpers)
  {
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      if (this->Current)
      {
        return false;
      }
      while (static_cast<int>(this->Workers.size()) < helpers)
      {
        this->Workers.emplace_back([this] { this->Work(); });
      }
      this->Current = &loop;
      this->Wanted = helpers;
    }
    this->Wake.notify_all();
    return true;
  }

  void Finish()
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Wanted = 0;
    this->Idle.wait(lock, [this] { return this->Running == 0; });
    this->Current = nullptr;
  }

private:
  void Work()
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    for (;;)
    {
      this->Wake.wait(lock, [this] { return this->Quit || this->Wanted > 0; });
      if (this->Quit)
      {
        return;
      }
      Loop* loop = this->Current;
      --this->Wanted;
      ++this->Running;
      lock.unlock();
      InsideLoop = true;
      while (loop->RunOne())
      {
      }
      InsideLoop = false;
      lock.lock();
      if (--this->Running == 0)
      {
        this->Idle.notify_all();
      }
    }
  }

  std::mutex Mutex;
  std::condition_variable Wake;
  std::condition_variable Idle;
  std::vector<std::thread> Workers;
  Loop* Current = nullptr;
  int Wanted = 0;
  int Running = 0;
  bool Quit = false;
};
}

void Report(const ProgressCallback& progress, double fraction)
{
  if (progress && !progress(fraction))
  {
    throw Cancelled();
  }
}

int NumberOfThreads()
{
  const int requested = RequestedThreads;
  return requested > 0 ? requested : DefaultNumberOfThreads();
}

void SetNumberOfThreads(int threads)
{
  RequestedThreads = std::max(0, threads);
}

void ParallelFor(std::int64_t count, std::int64_t grain,
  const std::function<void(std::int64_t, std::int64_t)>& body, const ProgressCallback& progress)
{
  if (count <= 0)
  {
    return;
  }
  Loop loop;
  loop.count = count;
  loop.grain = std::max<std::int64_t>(1, grain);
  loop.body = &body;

  const std::int64_t ranges = (count + loop.grain - 1) / loop.grain;
  const bool nested = InsideLoop;
  const int helpers =
    nested ? 0 : static_cast<int>(std::min<std::int64_t>(NumberOfThreads(), ranges)) - 1;
  const bool shared = helpers > 0 && Pool::Instance().Start(loop, helpers);

  InsideLoop = true;
  bool cancelled = false;
  double reported = 0.0;
  while (loop.RunOne())
  {
    const double fraction = static_cast<double>(loop.done) / static_cast<double>(count);
    // Every half per cent is enough for a progress bar, and cheap.
    if (progress && fraction >= reported + 0.005)
    {
      reported = fraction;
      bool goOn = false;
      try
      {
        goOn = progress(fraction);
      }
      catch (...)
      {
        const std::lock_guard<std::mutex> lock(loop.mutex);
        loop.error = std::current_exception();
      }
      if (!goOn)
      {
        cancelled = true;
        loop.stop = true;
      }
    }
  }
  InsideLoop = nested;
  if (shared)
  {
    Pool::Instance().Finish();
  }
  if (loop.error)
  {
    std::rethrow_exception(loop.error);
  }
  if (cancelled)
  {
    throw Cancelled();
  }
  // The helpers may have done it all before this thread came to its first range.
  if (reported < 1.0)
  {
    Report(progress, 1.0);
  }
}
}
