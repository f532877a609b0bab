/**
 * @file XmlDataCheck.h
 * @brief What VTK's XML readers believe, looked at before they read.
 */
#ifndef DynamicCoronary_XmlDataCheck_h
#define DynamicCoronary_XmlDataCheck_h

#include <string>

namespace coronary
{
/**
 * VTK's readers allocate what `NumberOfPoints` and the like say, go down as deep as elements are nested, and let entities
 * multiply. This walks over the tags of such a file, up to appended data, and refuses what no sound file has.
 *
 * A number of points, cells or components may be what the text can hold: a value needs a byte, or, where the
 * arrays are compressed, 1/800 of one (zlib packs 1032 bytes into one, and base64 takes 4 for 3).
 * @throws std::runtime_error with the end of a sentence about the file, without a full stop: "says that it has ..."
 */
void CheckXmlData(const std::string& text);
}

#endif
