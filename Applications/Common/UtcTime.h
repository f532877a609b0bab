/**
 * @file UtcTime.h
 * @brief The time of day, for reports.
 */
#ifndef DynamicCoronary_UtcTime_h
#define DynamicCoronary_UtcTime_h

#include <string>

namespace coronary
{
/// Now, as "2026-11-22T09:00:00Z".
std::string UtcTime();
}

#endif
