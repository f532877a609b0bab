#ifndef DynamicCoronary_ThreadRanks_h
#define DynamicCoronary_ThreadRanks_h

#include "RankGroup.h"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace coronary
{
/// Ranks that are threads of the test: work(ranks) on each of them at once. Messages of those that failed.
class ThreadRanks
{
public:
  static std::vector<std::string> Run(int size, const std::function<void(RankGroup&)>& work)
  {
    ThreadRanks all(size);
    std::vector<std::string> failures(static_cast<std::size_t>(size));
    std::vector<std::thread> threads;
    for (int rank = 0; rank < size; ++rank)
    {
      threads.emplace_back(
        [&, rank]
        {
          Member member(all, rank);
          try
          {
            work(member);
          }
          catch (const std::exception& error)
          {
            failures[static_cast<std::size_t>(rank)] = error.what();
            all.Fail();
          }
        });
    }
    for (std::thread& thread : threads)
    {
      thread.join();
    }
    return failures;
  }

private:
  class Member : public RankGroup
  {
  public:
    Member(ThreadRanks& all, int rank)
      : All(all)
      , Own(rank)
    {
    }
    int Rank() const override { return this->Own; }
    int Size() const override { return static_cast<int>(this->All.Parts.size()); }
    std::vector<std::string> Gather(const std::string& own) override
    {
      return this->All.Exchange(this->Own, own);
    }

  private:
    ThreadRanks& All;
    const int Own;
  };

  explicit ThreadRanks(int size)
    : Parts(static_cast<std::size_t>(size))
  {
  }

  void Fail()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Failed = true;
    this->Changed.notify_all();
  }

  std::vector<std::string> Exchange(int rank, const std::string& own)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Parts[static_cast<std::size_t>(rank)] = own;
    const int round = this->Round;
    if (++this->Arrived == static_cast<int>(this->Parts.size()))
    {
      this->Arrived = 0;
      this->Result = this->Parts;
      ++this->Round;
      this->Changed.notify_all();
    }
    this->Changed.wait(lock, [&] { return this->Round != round || this->Failed; });
    if (this->Round == round)
    {
      throw std::runtime_error("another rank failed");
    }
    return this->Result; // the next round ends when all have come here again
  }

  std::mutex Mutex;
  std::condition_variable Changed;
  std::vector<std::string> Parts;
  std::vector<std::string> Result;
  int Arrived = 0;
  int Round = 0;
  bool Failed = false;
};
}

#endif
