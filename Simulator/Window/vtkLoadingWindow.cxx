#include "vtkLoadingWindow.h"

#include "Interruption.h"
#include "ParallelFor.h"

#include <QEventLoop>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QTimer>
#include <QVBoxLayout>

#include <chrono>
#include <future>
#include <mutex>
#include <string>

namespace coronary
{
namespace
{
constexpr int LookInterval = 50; // ms
constexpr int BarSteps = 1000;

/// What the two threads tell each other.
struct LoadingState
{
  std::mutex mutex;
  std::string what;
  double fraction = 0.0;
  bool stop = false;
};

QString SentenceOf(const std::string& what)
{
  return what == "model" ? "Finding the arteries and their motion in the images ..."
    : what == "vessels"  ? "Loading the arteries and their motion ..."
    : what == "patient"  ? "Making the patient around them ..."
    : what == "anatomy"  ? "Drawing the anatomy ..."
                         : "Starting ...";
}
}

LoadingWindow::LoadingWindow(const QString& title, int width, int height)
  : Text(new QLabel(SentenceOf("")))
  , Bar(new QProgressBar)
{
  this->setWindowTitle(title);
  this->resize(width, height);
  this->setStyleSheet("QWidget { background: rgb(30, 33, 40); color: rgb(225, 232, 235); }"
                      "QPushButton { padding: 6px 18px; border: 1px solid rgb(110, 115, 125); }");
  this->Bar->setRange(0, BarSteps);
  this->Bar->setFixedWidth(420);
  auto* name = new QLabel(title);
  auto* stop = new QPushButton("Cancel");
  auto* column = new QVBoxLayout(this);
  column->setSpacing(14);
  column->addStretch(1);
  column->addWidget(name, 0, Qt::AlignCenter);
  column->addWidget(this->Text, 0, Qt::AlignCenter);
  column->addWidget(this->Bar, 0, Qt::AlignCenter);
  column->addWidget(stop, 0, Qt::AlignCenter);
  column->addStretch(1);
  QObject::connect(stop, &QPushButton::clicked, [this] { this->close(); });
}

bool LoadingWindow::Run(const std::function<void(const WorldProgress& progress)>& work)
{
  LoadingState state;
  const auto report = [&state](const std::string& what, double fraction)
  {
    const std::lock_guard<std::mutex> lock(state.mutex);
    state.what = what;
    state.fraction = fraction;
    return !state.stop && Interruption() == 0;
  };
  this->show();
  std::future<void> worker = std::async(std::launch::async, [&] { work(report); });
  QEventLoop loop;
  QTimer timer;
  const auto look = [&]
  {
    {
      const std::lock_guard<std::mutex> lock(state.mutex);
      state.stop = state.stop || !this->isVisible();
      this->Text->setText(SentenceOf(state.what));
      this->Bar->setValue(static_cast<int>(BarSteps * state.fraction));
    }
    if (worker.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    {
      loop.quit();
    }
  };
  QObject::connect(&timer, &QTimer::timeout, look);
  timer.start(LookInterval);
  loop.exec();
  try
  {
    worker.get();
  }
  catch (const Cancelled&)
  {
    if (Interruption() != 0)
    {
      throw;
    }
    return false;
  }
  return !state.stop;
}
}
