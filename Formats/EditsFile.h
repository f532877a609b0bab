/**
 * @file EditsFile.h
 * @brief edits.json: what a person corrected by hand, as a list that can be read and written by hand.
 *
 * @code{.json}
 * {
 *   "format": "coronary edits",
 *   "version": 1,
 *   "edits": [
 *     { "edit": "add-branch", "points": [[10.5, -3.0, 22.0], [18.0, 4.5, 2.5]], "name": "OM2" },
 *     { "edit": "rename", "name": "D1", "new_name": "D2" },
 *     { "edit": "paint", "points": [[1.0, 2.0, 3.0]], "radius": 1.5 }
 *   ]
 * }
 * @endcode
 * Coordinates and lengths are in mm, LPS. What each edit takes: CheckEdit(). A member that is not known is an error.
 */
#ifndef DynamicCoronary_EditsFile_h
#define DynamicCoronary_EditsFile_h

#include "TreeEdits.h"

#include <string>
#include <vector>

namespace coronary
{
/// The name of the file in the folder of a run.
constexpr const char* EditsFileName = "edits.json";

/**
 * The whole file as text.
 * @param where  for messages: the file's name
 * @throws std::runtime_error with one sentence that names `where` and the entry at fault: no JSON, another format or
 *   version, a member that is missing, not known or of another type, what CheckEdit() refuses
 */
std::vector<TreeEdit> ParseEdits(const std::string& text, const std::string& where);

/// One edit, as in the list. @throws std::runtime_error as ParseEdits()
TreeEdit ParseEdit(const std::string& text, const std::string& where);

/// @throws std::runtime_error as ParseEdits(), or when the file can not be read
std::vector<TreeEdit> ReadEditsFile(const std::string& path);

/// An edit in one line. Numbers are written so that reading gives the same bits.
std::string EditText(const TreeEdit& edit);

/// The whole file.
std::string EditsText(const std::vector<TreeEdit>& edits);
}

#endif
