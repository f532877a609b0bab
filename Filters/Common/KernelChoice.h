/**
 * @file KernelChoice.h
 * @brief Which of several sets of inner loops runs: each is compiled for one generation of processors.
 */
#ifndef DynamicCoronary_KernelChoice_h
#define DynamicCoronary_KernelChoice_h

#include <array>
#include <atomic>

namespace coronary
{
/// Generations of vector instructions.
enum class Instructions
{
  Widest, ///< that the processor runs: the default
  Baseline,
  Avx2,  ///< and what came with it: fused multiplication, instructions on bits
  Avx512 ///< foundation, DQ and VL
};

/// Whether this processor has them. It always has the widest and the baseline.
bool ProcessorHas(Instructions instructions);

/// Sets of loops, null where there are none for a generation. One object for the whole process.
template <typename Kernels>
class KernelChoice
{
public:
  explicit KernelChoice(
    const Kernels& baseline, const Kernels* avx2 = nullptr, const Kernels* avx512 = nullptr)
    : Sets{ &baseline, avx2, avx512 }
  {
    this->Select(Instructions::Widest);
  }

  const Kernels& Get() const { return *this->Selected.load(std::memory_order_relaxed); }

  /// For tests; false, and all stays, if there are no such loops or the processor does not run them.
  bool Select(Instructions instructions)
  {
    const Kernels* found = this->Find(instructions);
    if (found != nullptr)
    {
      this->Selected.store(found);
    }
    return found != nullptr;
  }

private:
  const Kernels* Find(Instructions instructions) const
  {
    if (instructions == Instructions::Widest)
    {
      const Kernels* wide = this->Find(Instructions::Avx512);
      wide = wide != nullptr ? wide : this->Find(Instructions::Avx2);
      return wide != nullptr ? wide : this->Sets[0];
    }
    return ProcessorHas(instructions)
      ? this->Sets[static_cast<int>(instructions) - static_cast<int>(Instructions::Baseline)]
      : nullptr;
  }

  std::array<const Kernels*, 3> Sets; ///< baseline, AVX2, AVX-512
  std::atomic<const Kernels*> Selected{ nullptr };
};
}

#endif
