#include "vtkWindowRecorder.h"

#include <QDateTime>
#include <QDir>
#include <QImage>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QSaveFile>

#include <algorithm>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double VideoRate = 10.0; // Hz

QString Now(const char* format)
{
  return QDateTime::currentDateTime().toString(format);
}

/// Whole or not at all.
bool SavePicture(const QImage& picture, const QString& path)
{
  QSaveFile file(path);
  return file.open(QIODevice::WriteOnly) && picture.save(&file, "PNG") && file.commit();
}
}

WindowRecorder::WindowRecorder(QWidget& window, const WindowOptions& options)
  : Window(window)
  , Options(options)
{
}

void WindowRecorder::SaveScreenshot()
{
  this->Save("simulator-" + Now("yyyyMMdd-HHmmss-zzz") + ".png");
}

void WindowRecorder::Save(const QString& path)
{
  if (!SavePicture(this->Window.grab().toImage(), path))
  {
    this->fail("Cannot write '" + path + "'.");
    return;
  }
  this->say("Saved " + path);
}

void WindowRecorder::Update(const SessionSnapshot& now, const ShownImage& shown)
{
  while (this->NextScreenshot < this->Options.screenshotSeconds.size() &&
    now.seconds >= this->Options.screenshotSeconds[this->NextScreenshot])
  {
    const QDir folder(QString::fromStdString(this->Options.screenshots));
    const QString at =
      QString("%1s").arg(this->Options.screenshotSeconds[this->NextScreenshot], 6, 'f', 2, '0');
    this->Save(folder.filePath("window_" + at + ".png"));
    this->SaveXRay(folder.filePath("xray_" + at), shown);
    ++this->NextScreenshot;
  }
  this->AddToFilm(now.tick > 0);
}

/// The last X-ray image, and what was exposed.
void WindowRecorder::SaveXRay(const QString& name, const ShownImage& shown)
{
  const GreyImage& image = shown.image;
  if (image.values.empty())
  {
    return;
  }
  const SessionSnapshot& moment = shown.moment;
  const QJsonObject about{ { "tick", static_cast<double>(moment.tick) },
    { "seconds", moment.seconds }, { "phase", moment.report.phase },
    { "primary_deg", moment.pose.primary / DegreeOfHands },
    { "secondary_deg", moment.pose.secondary / DegreeOfHands },
    { "source_to_detector_mm", moment.pose.sourceToDetector },
    { "source_to_isocentre_mm", moment.pose.sourceToIsocentre },
    { "isocentre_mm",
      QJsonArray{
        moment.pose.isocentre.x(), moment.pose.isocentre.y(), moment.pose.isocentre.z() } },
    { "field_of_view_mm", moment.fieldOfView }, { "background", shown.completeness },
    { "injected_mL", moment.contrast.injected }, { "in_tree_mL", moment.contrast.inTree },
    { "inserted_mm", moment.report.inserted }, { "branch", moment.report.branch } };
  const QImage picture(
    image.values.data(), image.columns, image.rows, image.columns, QImage::Format_Grayscale8);
  QSaveFile text(name + ".json");
  const QByteArray bytes = QJsonDocument(about).toJson();
  const bool written = text.open(QIODevice::WriteOnly) && text.write(bytes) == bytes.size() &&
    text.commit() && SavePicture(picture, name + ".png");
  if (!written)
  {
    this->fail("Cannot write '" + name + ".json' and its picture.");
  }
}

void WindowRecorder::Film(bool on)
{
  if (!on)
  {
    if (this->Video)
    {
      try
      {
        this->Video->Finish();
      }
      catch (const std::exception& error)
      {
        this->fail(error.what());
      }
      this->Video.reset();
    }
    this->filming->setChecked(false);
    return;
  }
  const QString path = this->Options.video.empty() ? "simulator-" + Now("yyyyMMdd-HHmmss") + ".ogv"
                                                   : QString::fromStdString(this->Options.video);
  try
  {
    this->Video = std::make_unique<vtkVideoFile>(path.toStdString(), VideoRate);
    this->VideoClock.start();
    this->Filmed = 0;
    this->filming->setChecked(true);
    this->say("Filming into " + path);
  }
  catch (const std::exception& error)
  {
    this->fail(error.what());
  }
}

void WindowRecorder::AddToFilm(bool begun)
{
  if (!this->Options.video.empty() && !this->Video && begun && !this->VideoClock.isValid())
  {
    this->Film(true);
  }
  const double seconds = 1e-3 * static_cast<double>(this->VideoClock.elapsed());
  if (!this->Video || seconds * VideoRate < static_cast<double>(this->Filmed))
  {
    return;
  }
  this->Filmed = static_cast<std::int64_t>(seconds * VideoRate) + 1;
  const QImage picture = this->Window.grab().toImage().convertToFormat(QImage::Format_RGB888);
  this->Video->Add(picture.constBits(), picture.width(), picture.height(),
    static_cast<std::size_t>(picture.bytesPerLine()), seconds);
}
}
