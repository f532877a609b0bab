/**
 * @file SessionPictures.h
 * @brief The pictures of a session without a window: X-ray frames, and the anatomy.
 */
#ifndef DynamicCoronary_SessionPictures_h
#define DynamicCoronary_SessionPictures_h

#include "Recording.h"
#include "ReportPage.h"
#include "SessionWorld.h"
#include "TrainingSession.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
struct PictureOptions
{
  bool xray = false;  ///< every frame that is exposed
  bool scene = false; ///< the anatomy at the moments that are written
};

class SessionPictures
{
public:
  /// @param world  with its background if X-ray frames are wanted
  /// @throws std::runtime_error: the anatomy has no display
  SessionPictures(const PictureOptions& options, const SessionWorld& world);
  ~SessionPictures();

  /// Where a file of this name is to be written.
  using FolderCallback = std::function<std::string(const std::string& name)>;

  /// The frame of the last step. @param recording  may be null: gets the image's hash
  /// @throws std::runtime_error naming the file
  void AddFrame(
    const TrainingSession& session, const FolderCallback& folder, RecordingWriter* recording);
  void AddScene(const TrainingSession& session, const FolderCallback& folder);

  /// Cine runs whose files are not written yet.
  void Finish(const FolderCallback& folder);

  std::size_t Frames() const;
  const std::string& FrameTable() const; ///< CSV of the frames
  /// Of each cine run the frame with the most contrast medium in the vessels, and its stent boost.
  std::vector<ReportPicture> PicturesOfRuns() const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
