/**
 * @file VolumeHeaderParsers.h
 * @brief Inside VolumeFile: one parser a format, and what they share. Not installed.
 */
#ifndef DynamicCoronary_VolumeHeaderParsers_h
#define DynamicCoronary_VolumeHeaderParsers_h

#include "TextWords.h"
#include "VolumeFile.h"

#include <initializer_list>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
VolumeHeader ReadMetaImageHeader(const std::string& path);
VolumeHeader ReadNrrdHeader(const std::string& path);
VolumeHeader ReadNiftiHeader(const std::string& path);

/// The "key:=value" lines of a NRRD header. @param path for messages @throws std::runtime_error
std::map<std::string, std::string> ParseNrrdNotes(const std::string& text, const std::string& path);

/// The fields of a text header by their names, and what is wrong with them: std::runtime_error naming file and field.
class HeaderFields
{
public:
  std::string path; ///< of the file
  std::map<std::string, std::string> values;

  /// The first of these that is there; null: none.
  const std::string* Find(std::initializer_list<const char*> names) const;
  const std::string* Find(const char* name) const { return this->Find({ name }); }

  ///@{
  /// One that has to be there: its text, so many numbers, whole numbers from `low` on, one of them.
  const std::string& Text(const char* name) const;
  std::vector<int> Integers(const char* name, std::size_t count, int low) const;
  int Integer(const char* name, int low) const { return this->Integers(name, 1, low).front(); }
  ///@}

  ///@{
  /// The same of one that may be missing.
  int Integer(const char* name, int low, int otherwise) const;
  double Number(const char* name, double otherwise) const;
  ///@}

  /// The field, that there are 3 or 4.
  int Dimensions(const char* name) const;
};

/// The path of what a file names: names are relative to the file's folder.
std::string PathBeside(const std::string& file, const std::string& name);

/// The first bytes of a text header that may be followed by voxels; at most 1 MiB.
std::string ReadHeaderText(const std::string& path);

/// Sets the extent, spacing and direction from the image axes in world millimetres, and checks them.
void SetAxes(VolumeHeader& header, const std::vector<int>& size, const Matrix3& axes);

/// The image axes that SetAxes() takes are perpendicular to within 1e-3 (of unit length).
bool ArePerpendicular(const Matrix3& axes);
}

#endif
