/**
 * @file PseudoTerminal.h
 * @brief A serial line without hardware.
 */
#ifndef DynamicCoronary_PseudoTerminal_h
#define DynamicCoronary_PseudoTerminal_h

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// The device's end; the host opens Name().
class PseudoTerminal
{
public:
  /// @throws std::runtime_error: the system gives none
  PseudoTerminal();
  ~PseudoTerminal();
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  const std::string& Name() const { return this->SlaveName; }

  ///@{
  /// Without waiting. Bytes that nobody reads are dropped when the system's buffer is full, as USB does.
  std::size_t Read(std::uint8_t* bytes, std::size_t most);
  void Write(const std::vector<std::uint8_t>& bytes);
  ///@}

  /// Until there is something to read, or for so long.
  void Wait(std::uint64_t microseconds);

private:
  void Close();

  int Master = -1;
  int Slave = -1; ///< held open, so that a host may come and go
  std::string SlaveName;
};
}

#endif
