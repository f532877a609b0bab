/**
 * @file vtkSessionWindow.h
 * @brief The window of a session: pictures, panel, keys.
 */
#ifndef vtkSessionWindow_h
#define vtkSessionWindow_h

#include "FluoroscopyWidget.h"
#include "IgtlOutput.h"
#include "KeyboardDevice.h"
#include "PanelDevice.h"
#include "SimulatorWindow.h"
#include "TraceWidget.h"
#include "vtkSimulatorScene.h"
#include "vtkVideoFile.h"

#include "QVTKOpenGLNativeWidget.h"
#include "vtkGenericOpenGLRenderWindow.h"
#include "vtkNew.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QElapsedTimer>
#include <QLabel>
#include <QMainWindow>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QSlider>
#include <QTimer>

#include <memory>
#include <string>
#include <vector>

class QGroupBox;

namespace coronary
{
class SessionWindow : public QMainWindow
{
public:
  SessionWindow(const SessionWorld& world, std::unique_ptr<vtkSimulatorScene> scene,
    const WindowOptions& options);
  ~SessionWindow() override;

  /// @throws as SessionEngine, OpenDevice
  void Begin(const std::string& record, const std::string& replay);

  /// What went wrong first; empty: nothing did.
  const QString& Trouble() const { return this->Trouble_; }

protected:
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void closeEvent(QCloseEvent* event) override;
  void changeEvent(QEvent* event) override;

private:
  // vtkSessionPanel.cxx
  QWidget* MakePanel();
  QGroupBox* MakeInstrumentGroup();
  QGroupBox* MakeViewGroup();
  QGroupBox* MakeXRayGroup();
  QGroupBox* MakeContrastGroup();
  QGroupBox* MakeHeartGroup();
  QGroupBox* MakeAnatomyGroup();
  QWidget* MakeMetrics();
  void MakeToolBar();

  void ConnectMouse();

  void ShowScenario();
  void Poll();
  void ShowSession();
  void ShowScene();
  void ShowImage();
  void SendPose();
  void ShowNumbers(const SessionSnapshot& now);
  void ShowDevices();
  void ShowRates();
  void ShowCine();
  void TakeDueScreenshots();
  void RecordVideo();

  void PlaceView();
  void TakeScenarioOf(const std::string& recording);
  void Restart(const std::string& record, const std::string& replay);
  void End();
  void Post(const RecordedEvent& event);
  void Problem(const QString& text);
  void PressFluoroscopy();
  void SaveScreenshot(const QString& path);
  void SaveXRay(const QString& name);
  void PrintRates() const;
  void ToggleVideo(bool on);

  SessionWorld World;
  WindowOptions Options;
  std::vector<std::shared_ptr<Device>> Hardware;
  std::shared_ptr<KeyboardDevice> Keys;
  std::shared_ptr<PanelDevice> Panel;
  std::shared_ptr<DeviceMux> Mux;
  std::unique_ptr<SessionEngine> Engine;
  std::unique_ptr<vtkSimulatorScene> Scene;
  std::unique_ptr<vtkVideoFile> Video;
  std::unique_ptr<IgtlOutput> Igtl;
  SessionSnapshot Now;
  ShownImage Shown;
  ImageMode Mode = ImageMode::Plain;
  std::size_t NextScreenshot = 0;
  QString Trouble_;
  bool Replaying = false;
  bool ViewIsOurs = false; ///< the panel's values are being set to what devices made of the view
  double Primary = 0.0;    ///< that the panel asked for, radians
  double Secondary = 0.0;
  int DrawnFrames = 0;
  double SceneFrameRate = 0.0;
  QElapsedTimer Second;
  QElapsedTimer Whole;
  std::uint64_t AllDrawn = 0;
  QElapsedTimer VideoClock;
  std::int64_t Filmed = 0; ///< places of the film that have passed
  QTimer Timer;

  FluoroscopyWidget* Monitor = nullptr;
  QVTKOpenGLNativeWidget* Anatomy = nullptr;
  vtkNew<vtkGenericOpenGLRenderWindow> AnatomyWindow;
  TraceWidget* Traces = nullptr;
  QComboBox* WireChoice = nullptr;
  QComboBox* CatheterChoice = nullptr;
  QLabel* InstrumentText = nullptr;
  QComboBox* ViewChoice = nullptr;
  QDoubleSpinBox* PrimaryBox = nullptr;
  QDoubleSpinBox* SecondaryBox = nullptr;
  QDoubleSpinBox* DistanceBox = nullptr;
  QDoubleSpinBox* TableBoxes[3] = { nullptr, nullptr, nullptr };
  QPushButton* FluoroscopyButton = nullptr;
  QCheckBox* FluoroscopyHold = nullptr;
  QComboBox* FieldChoice = nullptr;
  QComboBox* RateChoice = nullptr;
  QComboBox* ModeChoice = nullptr;
  QSlider* RunSlider = nullptr;
  QSlider* FrameSlider = nullptr;
  QDoubleSpinBox* InjectionBox = nullptr;
  QLabel* ContrastText = nullptr;
  QSlider* HeartSlider = nullptr;
  QLabel* HeartText = nullptr;
  QCheckBox* HeartPause = nullptr;
  QLabel* MetricsText = nullptr;
  QPlainTextEdit* Log = nullptr;
  QLabel* DeviceText = nullptr;
  QPushButton* ForceButton = nullptr;
  QAction* PauseAction = nullptr;
  QAction* VideoAction = nullptr;
};
}

#endif
