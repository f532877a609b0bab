/**
 * @file FileSeries.h
 * @brief Files of one thing at several times, as ParaView lists them: .series (JSON) and .pvd (XML).
 */
#ifndef DynamicCoronary_FileSeries_h
#define DynamicCoronary_FileSeries_h

#include <cstddef>
#include <string>
#include <vector>

namespace coronary
{
struct TimedFile
{
  std::string path;
  double time = 0.0;
};

/**
 * Reads a .series or a .pvd file, whichever it is by its text. Paths come out as they can be opened:
 * those in the file are relative to its folder.
 * @throws std::runtime_error naming the file and what is wrong: not there, neither of both, no files,
 *   an entry without file or time, times that do not increase strictly, several parts at one time
 */
std::vector<TimedFile> ReadFileSeries(const std::string& path);

/// The text of a .series file; paths are written as they are.
std::string FileSeriesText(const std::vector<TimedFile>& files);

/// The text of a .pvd file; paths are written as they are.
std::string PvdText(const std::vector<TimedFile>& files);

/**
 * The number of a file, for its name: all files of a series have as many digits as the last one, so that they sort.
 * @param count   files, of which this is one
 * @param digits  at least
 */
std::string SeriesNumber(std::size_t number, std::size_t count, std::size_t digits = 2);
}

#endif
