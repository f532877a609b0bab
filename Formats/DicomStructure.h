/**
 * @file DicomStructure.h
 * @brief Where the pixels of a DICOM file begin, and that its header is sound. Not installed.
 */
#ifndef DynamicCoronary_DicomStructure_h
#define DynamicCoronary_DicomStructure_h

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
struct DicomDataSet;

/// Where the value of an element is in the header, or the items of a sequence.
struct DicomElement
{
  std::uint64_t offset = 0;
  std::uint32_t length = 0;
  std::vector<DicomDataSet> items;
};

/// Those elements that this library reads, by tag (group << 16 | element).
struct DicomDataSet
{
  std::map<std::uint32_t, DicomElement> elements;
};

struct DicomStructure
{
  bool isDicom = false;       ///< false: the file does not begin as DICOM does
  std::string header;         ///< all bytes before the pixel data
  DicomDataSet data;          ///< refers to positions in `header`
  std::string mediaStorage;   ///< SOP class UID from the file meta information
  std::string transferSyntax; ///< UID; empty when there is no file meta information
  bool bigEndian = false;
  bool encapsulated = false;     ///< the pixels are compressed, in fragments
  std::uint64_t pixelOffset = 0; ///< of the first byte of the pixels
  std::uint64_t pixelBytes = 0;  ///< bytes from there on that are in the file; 0: no pixels
};

/**
 * Walks over the elements of a file, sequences included, without believing any length.
 *
 * GDCM can not do this: it allocates what the length of an element says, takes pixel data that ends
 * early, reads the pixels along with the header, and aborts the program for some damaged headers.
 * @throws std::runtime_error naming the file when an element ends behind the file
 */
DicomStructure ReadDicomStructure(const std::string& path);
}

#endif
