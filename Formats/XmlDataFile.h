/**
 * @file XmlDataFile.h
 * @brief VTK's XML files, before VTK reads them.
 */
#ifndef DynamicCoronary_XmlDataFile_h
#define DynamicCoronary_XmlDataFile_h

#include <string>

namespace coronary
{
/**
 * The text of a VTK XML file as VTK can read it without harm.
 *
 * VTK's readers allocate what `NumberOfPoints` and the like say: a number of points, cells or components may be what the text
 * can hold. A value needs a byte, or, where the arrays are compressed, 1/800 of one (zlib packs 1032 bytes into one, and
 * base64 takes 4 for 3). They also go down as deep as elements are nested, and let entities multiply: ReadXml() does not.
 *
 * Appended data are moved into the arrays' own elements (`format="binary"`): VTK up to 9.2 cannot read them when the Expat
 * library defers what it reports (2.6.0, and Debian 12's 2.5.0-1+deb12u1 and later): its reader then looks for them in the
 * wrong place. Appended is the form that ParaView and VTK write unless told otherwise. Both encodings (base64, raw), compressed
 * or not, header of 32 or 64 bits, either byte order. Appended data that are not understood stay: VTK's reader then tells what
 * is wrong with them.
 *
 * @param file  for messages
 * @throws std::runtime_error naming the file and the line: no XML, or numbers that are none or too large
 */
std::string ReadableXmlData(std::string text, const std::string& file);
}

#endif
