#ifndef DynamicCoronary_ThreadSharing_h
#define DynamicCoronary_ThreadSharing_h

#include "ItemSharing.h"

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace coronary
{
/// Items that are shared by threads of the test: work(sharing, number) in each of them at once. Messages of those that
/// failed.
class ThreadSharing
{
public:
  static std::vector<std::string> Run(
    std::size_t size, const std::function<void(ItemSharing&, std::size_t)>& work)
  {
    ThreadSharing all(size);
    std::vector<std::string> failures(size);
    std::vector<std::thread> threads;
    for (std::size_t own = 0; own < size; ++own)
    {
      threads.emplace_back(
        [&, own]
        {
          Member member(all, own);
          try
          {
            work(member, own);
          }
          catch (const std::exception& error)
          {
            failures[own] = error.what();
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
  class Member : public ItemSharing
  {
  public:
    Member(ThreadSharing& all, std::size_t own)
      : All(all)
      , Own(own)
    {
    }
    std::size_t AtOnce() const override { return this->All.Size; }
    std::vector<std::string> Results(
      const std::vector<std::size_t>& items, const Work& work) override
    {
      std::map<std::size_t, std::string> done;
      for (const std::size_t item : items)
      {
        if (item % this->All.Size == this->Own)
        {
          done[item] = work(item);
        }
      }
      const std::map<std::size_t, std::string> all = this->All.Exchange(done);
      std::vector<std::string> results;
      for (const std::size_t item : items)
      {
        results.push_back(all.at(item));
      }
      return results;
    }

  private:
    ThreadSharing& All;
    const std::size_t Own;
  };

  explicit ThreadSharing(std::size_t size)
    : Size(size)
  {
  }

  void Fail()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Failed = true;
    this->Changed.notify_all();
  }

  std::map<std::size_t, std::string> Exchange(const std::map<std::size_t, std::string>& done)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Done.insert(done.begin(), done.end());
    const int round = this->Round;
    if (++this->Arrived == this->Size)
    {
      this->Arrived = 0;
      this->Result = std::move(this->Done);
      this->Done.clear();
      ++this->Round;
      this->Changed.notify_all();
    }
    this->Changed.wait(lock, [&] { return this->Round != round || this->Failed; });
    if (this->Round == round)
    {
      throw std::runtime_error("another one failed");
    }
    return this->Result; // the next round ends when all have come here again
  }

  const std::size_t Size;
  std::mutex Mutex;
  std::condition_variable Changed;
  std::map<std::size_t, std::string> Done;
  std::map<std::size_t, std::string> Result;
  std::size_t Arrived = 0;
  int Round = 0;
  bool Failed = false;
};
}

#endif
