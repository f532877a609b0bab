/**
 * @file MeasuredProcess.h
 * @brief Time and memory of a piece of work, each measurement in a process of its own.
 *
 * A peak of resident memory belongs to a process and never falls; and what one library leaves in
 * the allocator must not help or hinder the next. So each measurement is a forked child.
 */
#ifndef DynamicCoronary_MeasuredProcess_h
#define DynamicCoronary_MeasuredProcess_h

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace coronary
{
/// Zeroed memory that children share with their parent: their input and their results.
class SharedMemory
{
public:
  /// @throws std::runtime_error when the system has no such room
  explicit SharedMemory(std::size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  void* Data() const { return this->Address; }

private:
  void* Address;
  std::size_t Bytes;
};

template <typename T>
class SharedArray
{
public:
  explicit SharedArray(std::size_t count)
    : Memory(count * sizeof(T))
    , Count(count)
  {
  }
  T* data() const { return static_cast<T*>(this->Memory.Data()); }
  std::size_t size() const { return this->Count; }
  T& operator[](std::size_t n) const { return this->data()[n]; }

private:
  SharedMemory Memory;
  std::size_t Count;
};

struct Measurement
{
  double wall = 0.0;           ///< s
  double processor = 0.0;      ///< s, user and system time of all threads
  std::int64_t peak = 0;       ///< bytes, resident memory of the whole process
  std::int64_t peakGrowth = 0; ///< bytes that it grew beyond what was there when the work began
};

/**
 * Runs the three in a child, one after the other; what is measured is `work`.
 *
 * The calling process must not have started a thread: threads do not survive a fork.
 * @param prepare  makes the input; its own passing needs do not count
 * @param deliver  hands results over through shared memory; may be empty
 * @throws std::runtime_error with what a part threw, or how the child died
 */
Measurement MeasureInChild(const std::function<void()>& prepare, const std::function<void()>& work,
  const std::function<void()>& deliver = {});

/// Of at least one value.
double Median(std::vector<double> values);

/// get(run) of each run.
template <typename Get>
std::vector<double> Each(const std::vector<Measurement>& runs, Get get)
{
  std::vector<double> values;
  values.reserve(runs.size());
  for (const Measurement& run : runs)
  {
    values.push_back(get(run));
  }
  return values;
}

inline double Wall(const Measurement& m)
{
  return m.wall;
}

inline double Processor(const Measurement& m)
{
  return m.processor;
}
}

#endif
