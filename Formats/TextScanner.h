// Words and numbers of a text file, with the line for messages.
#ifndef DynamicCoronary_TextScanner_h
#define DynamicCoronary_TextScanner_h

#include "Geometry.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace coronary
{
/// Words are separated by spaces, tabs and ends of lines. The locale does not matter.
class TextScanner
{
public:
  /// Reads the whole file. @throws std::runtime_error naming it
  explicit TextScanner(const std::string& path);

  const std::string& Path() const { return this->Name; }
  const std::string& Text() const { return this->Contents; }
  std::size_t Position() const { return this->At; }

  /// What begins with it is passed over to the end of the line; 0: nothing.
  void SetComment(char comment) { this->Comment = comment; }

  bool AtEnd();            ///< no word is left
  std::string_view Word(); ///< the next one, on whatever line; throws at the end
  bool AtLineEnd();        ///< no word is left on this line
  void SkipLine();         ///< the rest of this line
  void SkipCharacter();    ///< one of them, whichever it is; not at the end of the file
  double Number();         ///< the next word as a number, which may be nan or inf
  Vector3 Point();         ///< the next three words as finite numbers
  std::int64_t Integer();  ///< the next word as an integer

  /// @throws std::runtime_error: file, line of the last word, what
  [[noreturn]] void Fail(const std::string& what) const;

private:
  void SkipBlanks(bool overLines);

  std::string Name;
  std::string Contents;
  std::size_t At = 0;
  std::int64_t Line = 1;
  char Comment = 0;
};
}

#endif
