/**
 * @file VolumeHeaderParsers.h
 * @brief Inside VolumeFile: one parser a format, and what they share. Not installed.
 */
#ifndef DynamicCoronary_VolumeHeaderParsers_h
#define DynamicCoronary_VolumeHeaderParsers_h

#include "TextWords.h"
#include "VolumeFile.h"

#include <cstdint>
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

/// The first bytes of a text header that may be followed by voxels; at most 1 MiB.
std::string ReadHeaderText(const std::string& path);

/// Sets the extent, spacing and direction from the image axes in world millimetres, and checks them.
void SetAxes(VolumeHeader& header, const std::vector<int>& size, const Matrix3& axes);

/// The image axes that SetAxes() takes are perpendicular to within 1e-3 (of unit length).
bool ArePerpendicular(const Matrix3& axes);
}

#endif
