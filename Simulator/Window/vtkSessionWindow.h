/**
 * @file vtkSessionWindow.h
 * @brief The window of a session: monitor, anatomy, traces, panels, keys.
 */
#ifndef vtkSessionWindow_h
#define vtkSessionWindow_h

#include "ContrastPanel.h"
#include "FluoroscopyWidget.h"
#include "HeartPanel.h"
#include "IgtlOutput.h"
#include "InstrumentPanel.h"
#include "KeyboardDevice.h"
#include "MetricsPanel.h"
#include "PanelDevice.h"
#include "SimulatorWindow.h"
#include "TraceWidget.h"
#include "ViewPanel.h"
#include "XRayPanel.h"
#include "vtkSimulatorScene.h"
#include "vtkWindowRecorder.h"

#include "QVTKOpenGLNativeWidget.h"
#include "vtkGenericOpenGLRenderWindow.h"
#include "vtkNew.h"

#include <QElapsedTimer>
#include <QLabel>
#include <QMainWindow>
#include <QPlainTextEdit>
#include <QTimer>

#include <memory>
#include <string>
#include <vector>

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
  QWidget* MakeCentre();
  QWidget* MakePanels();
  void MakeToolBar();
  void ConnectPanels();

  void ShowScenario();
  void Poll();
  void ShowSession();
  void ShowScene();
  void ShowImage();
  void SendPose();
  void ShowDevices();
  void ShowRates();
  void ShowCine();
  void ShowEnhancedStent(std::size_t number); ///< of a run
  void SaveCine();
  void ShowKeys();

  void TakeScenarioOf(const std::string& recording);
  void Restart(const std::string& record, const std::string& replay);
  void End();
  void Chosen(const RecordedEvent& event);
  void Problem(const QString& text);
  void PrintRates() const;

  SessionWorld World;
  WindowOptions Options;
  std::vector<std::shared_ptr<Device>> Hardware;
  std::shared_ptr<KeyboardDevice> Keys;
  std::shared_ptr<PanelDevice> Panel;
  std::shared_ptr<DeviceMux> Mux;
  std::unique_ptr<SessionEngine> Engine;
  std::unique_ptr<vtkSimulatorScene> Scene;
  std::unique_ptr<IgtlOutput> Igtl;
  WindowRecorder Recorder;
  SessionSnapshot Now;
  ShownImage Shown;
  QString Trouble_;
  bool Replaying = false;
  int DrawnFrames = 0;
  QElapsedTimer Second;
  QElapsedTimer Whole;
  std::uint64_t AllDrawn = 0;
  QTimer Timer;

  FluoroscopyWidget* Monitor = new FluoroscopyWidget;
  QVTKOpenGLNativeWidget* Anatomy = new QVTKOpenGLNativeWidget;
  vtkNew<vtkGenericOpenGLRenderWindow> AnatomyWindow;
  TraceWidget* Traces = new TraceWidget;
  MetricsPanel* Metrics = new MetricsPanel;
  InstrumentPanel* Instruments = new InstrumentPanel;
  ViewPanel* View = new ViewPanel;
  XRayPanel* XRay = new XRayPanel;
  ContrastPanel* Contrast = new ContrastPanel;
  HeartPanel* Heart = new HeartPanel;
  QPushButton* ForceButton = nullptr;
  QPlainTextEdit* Log = new QPlainTextEdit;
  QLabel* DeviceText = new QLabel;
  QAction* PauseAction = nullptr;
};
}

#endif
