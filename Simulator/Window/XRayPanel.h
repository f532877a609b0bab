/**
 * @file XRayPanel.h
 * @brief Pedals, exposures, images, stored runs.
 */
#ifndef DynamicCoronary_XRayPanel_h
#define DynamicCoronary_XRayPanel_h

#include "FluoroscopyImager.h"
#include "PanelWidgets.h"
#include "Recording.h"
#include "Scenario.h"

#include <QGroupBox>

#include <cstddef>
#include <cstdint>
#include <functional>

namespace coronary
{
class XRayPanel : public QGroupBox
{
public:
  XRayPanel();

  std::function<void(std::uint32_t pedal, bool down)> pedalMoved;
  std::function<void(const RecordedEvent&)> chosen; ///< frame rate, field of view
  std::function<void(ImageMode)> modeChosen;
  std::function<void()> frameChosen; ///< of a stored run, or how it is shown

  void ShowScenario(const ImagingSettings& imaging);
  /// Says the pedal of fluoroscopy again.
  void PressFluoroscopy();

  ImageMode Mode() const { return static_cast<ImageMode>(this->Modes->currentIndex()); }
  std::size_t Run() const { return this->Runs->value(); }
  std::size_t Frame() const { return this->Frames->value(); }
  bool Enhances() const
  {
    return this->Enhance->isChecked();
  } ///< the run's stent instead of a frame
  void SetRuns(std::size_t count);
  void SetFrames(std::size_t count);

private:
  void Offer(QComboBox& box, RecordedEvent::Kind kind);

  QPushButton* Fluoroscopy = PanelButton("Fluoroscopy", "Radiation while it is held; key F");
  QCheckBox* Hold = CheckBox("Hold the pedal down");
  QComboBox* Rates = ChoiceBox();
  QComboBox* Modes = ChoiceBox();
  QComboBox* Fields = ChoiceBox();
  QSlider* Sides = PanelSlider("Left and right shutter");
  QSlider* Ends = PanelSlider("Upper and lower shutter");
  QCheckBox* Enhance = CheckBox("Stent boost");
  QSlider* Runs = PanelSlider("Stored cine runs");
  QSlider* Frames = PanelSlider("Frames of the run");
};
}

#endif
