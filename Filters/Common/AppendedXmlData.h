/**
 * @file AppendedXmlData.h
 * @brief VTK's XML files with appended data, made readable where the XML parser stops at these.
 */
#ifndef DynamicCoronary_AppendedXmlData_h
#define DynamicCoronary_AppendedXmlData_h

#include <string>

namespace coronary
{
/**
 * The text of a VTK XML file with its appended data moved into the arrays' own elements
 * (`format="binary"`). VTK up to 9.2 cannot read appended data when the Expat library defers what it
 * reports (2.6.0, and Debian 12's 2.5.0-1+deb12u1 and later): its reader then looks for them in the
 * wrong place. Appended is the form that ParaView and VTK write unless told otherwise.
 *
 * Both encodings (base64, raw), compressed or not, header of 32 or 64 bits, either byte order.
 *
 * @return the text itself when it has no appended data, or none that is understood: VTK's reader then
 *         tells what is wrong with it
 */
std::string WithInlineXmlData(std::string text);
}

#endif
