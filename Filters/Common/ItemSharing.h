/**
 * @file ItemSharing.h
 * @brief Independent items of a work, such as phases, some of which may be done elsewhere.
 *
 * The base class does all of them here, in turn. A program of several processes gives an algorithm another one:
 * each process does some, and all get the results of all, so that the algorithm goes on as if it had done them alone.
 */
#ifndef DynamicCoronary_ItemSharing_h
#define DynamicCoronary_ItemSharing_h

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

namespace coronary
{
class ItemSharing
{
public:
  /// Does an item. @return its result as bytes, see Packed()
  using Work = std::function<std::string(std::size_t item)>;

  ItemSharing() = default;
  virtual ~ItemSharing();
  ItemSharing(const ItemSharing&) = delete;
  ItemSharing& operator=(const ItemSharing&) = delete;

  /// How many items are done at once, those with neighbouring numbers.
  virtual std::size_t AtOnce() const { return 1; }

  /**
   * The results of all these items, in their order. `work` is called for those that are done here, in their order.
   * An item is done at one place whenever it comes again, so that what was kept of it is there.
   * @throws what `work` throws, here or elsewhere
   */
  virtual std::vector<std::string> Results(const std::vector<std::size_t>& items, const Work& work);

  /// As above, of the items from 0 to `count` - 1.
  std::vector<std::string> ResultsOfAll(std::size_t count, const Work& work);

  /// All is done here.
  static ItemSharing& None();
};

/// Lists of plain values as bytes: the length and the values of each.
template <typename... Values>
std::string Packed(const std::vector<Values>&... lists)
{
  // Eigen's fixed vectors and matrices are plain, though the standard's traits do not say so.
  static_assert((std::is_trivially_destructible_v<Values> && ...), "only bytes of values are kept");
  std::string bytes;
  const auto append = [&bytes](const void* data, std::size_t size)
  { bytes.append(static_cast<const char*>(data), size); };
  const auto add = [&](const auto& list)
  {
    const std::uint64_t count = list.size();
    append(&count, sizeof(count));
    append(list.data(), list.size() * sizeof(*list.data()));
  };
  (add(lists), ...);
  return bytes;
}

/// What Packed() made of lists of these types.
template <typename... Values>
void Unpack(const std::string& bytes, std::vector<Values>&... lists)
{
  std::size_t at = 0;
  const auto take = [&](auto& list)
  {
    std::uint64_t count = 0;
    std::memcpy(&count, bytes.data() + at, sizeof(count));
    at += sizeof(count);
    list.resize(count);
    const std::size_t size = count * sizeof(*list.data());
    if (size > 0)
    {
      // Through a pointer without a type: Eigen's are not trivial by name.
      std::memcpy(static_cast<void*>(list.data()), bytes.data() + at, size);
      at += size;
    }
  };
  (take(lists), ...);
}
}

#endif
