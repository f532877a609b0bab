/**
 * @file vtkVideoFile.h
 * @brief Pictures of one size as a film, Ogg Theora, coded on a thread of its own.
 */
#ifndef vtkVideoFile_h
#define vtkVideoFile_h

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace coronary
{
class vtkVideoFile
{
public:
  /// @param path  appears under its name with Finish()  @param rate  pictures a second, 1 to 60
  /// @throws std::invalid_argument: rate; std::runtime_error: the file can not be made
  vtkVideoFile(const std::string& path, double rate);
  /// Without Finish() nothing is left.
  ~vtkVideoFile();
  vtkVideoFile(const vtkVideoFile&) = delete;
  vtkVideoFile& operator=(const vtkVideoFile&) = delete;

  /**
   * A picture, red, green, blue, from the top. The first one's size is the film's: what others have more is cut off, what
   * they have less is black. It is shown until the next one; when coding is too slow pictures are left out: Dropped().
   * @param stride   bytes from row to row
   * @param seconds  since the film began, rising
   */
  void Add(const std::uint8_t* pixels, int width, int height, std::size_t stride, double seconds);

  std::uint64_t Dropped() const;

  /// @throws std::runtime_error naming the file
  void Finish();

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
