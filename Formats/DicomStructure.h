/**
 * @file DicomStructure.h
 * @brief Where the pixels of a DICOM file begin, and that its header is sound. Not installed.
 */
#ifndef DynamicCoronary_DicomStructure_h
#define DynamicCoronary_DicomStructure_h

#include <cstdint>
#include <string>

namespace coronary
{
struct DicomStructure
{
  bool isDicom = false;       ///< false: the file does not begin as DICOM does
  std::string header;         ///< all bytes before the pixel data
  std::string transferSyntax; ///< UID; empty when there is no file meta information
  bool hasPixels = false;
  bool encapsulated = false; ///< the pixels are compressed, in fragments
  bool bigEndian = false;
  std::uint64_t pixelOffset = 0; ///< of the first byte of the pixels
  std::uint64_t pixelBytes = 0;  ///< bytes from there on that are in the file
};

/**
 * Walks over the elements of a file, sequences included, without believing any length.
 *
 * GDCM allocates what the length of an element says, and takes pixel data that ends early: so this
 * comes first, and GDCM gets the bytes of a header that is known to be sound.
 * @throws std::runtime_error naming the file when an element ends behind the file
 */
DicomStructure ReadDicomStructure(const std::string& path);
}

#endif
