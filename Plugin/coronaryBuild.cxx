#include "coronaryBuild.h"

#include <pqPVApplicationCore.h>
#include <pqPythonManager.h>

#include <QDir>
#include <QFile>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QRegularExpression>
#include <QStandardPaths>
#include <QTimer>

#include <algorithm>

#include <dlfcn.h>

namespace
{
constexpr int BarSteps = 1000;
/// How long a program may take to stop, milliseconds.
constexpr int Patience = 10000;

const char Introduction[] =
  "Builds the beating model of the selected image series, in a program of its own: ParaView can be "
  "used meanwhile. "
  "With an empty pipeline browser a small phantom is made, and its model.";

/// Beside the plugin's library, whose depth below the prefix differs; else that of the path.
QString PipelineProgram()
{
  const QString name = QStringLiteral("coronary-pipeline");
  Dl_info self = {};
  if (dladdr(reinterpret_cast<const void*>(&PipelineProgram), &self) != 0 && self.dli_fname)
  {
    QDir folder = QFileInfo(QString::fromLocal8Bit(self.dli_fname)).absoluteDir();
    while (folder.cdUp())
    {
      const QFileInfo program(folder.filePath("bin/" + name));
      if (program.isExecutable())
      {
        return program.absoluteFilePath();
      }
    }
  }
  return QStandardPaths::findExecutable(name);
}

/// As a Python literal.
QByteArray Quoted(const QString& text)
{
  // A JSON string of ASCII is one.
  QByteArray quoted = QJsonDocument(QJsonArray{ text }).toJson(QJsonDocument::Compact);
  return quoted.mid(1, quoted.size() - 2);
}
}

coronaryBuild::coronaryBuild(QWidget* parent)
  : QDialog(parent)
  , Folder(new QLineEdit(this))
  , Options(new QLineEdit(this))
  , Words(new QLabel(this))
  , Bar(new QProgressBar(this))
  , StartButton(new QPushButton("Start", this))
  , CancelButton(new QPushButton("Cancel", this))
{
  this->setObjectName("coronaryBuildWindow");
  this->setWindowTitle("Build from 4D CT");
  this->setModal(false);
  auto* introduction = new QLabel(Introduction, this);
  introduction->setWordWrap(true);
  this->Folder->setObjectName("folder");
  this->Folder->setPlaceholderText("a temporary one, until ParaView is closed");
  this->Folder->setToolTip(
    "Where the results are kept. A folder with an unfinished run of the same series goes on");
  this->Options->setObjectName("options");
  this->Options->setPlaceholderText(
    "as of coronary-pipeline run: --seed 4.2 -3.6 -1.9 --scales 0.5 2.5");
  this->Words->setObjectName("words");
  this->Words->setWordWrap(true);
  this->Words->setTextInteractionFlags(Qt::TextSelectableByMouse);
  this->Bar->setObjectName("bar");
  this->Bar->setRange(0, BarSteps);
  this->Bar->setValue(0);
  this->StartButton->setObjectName("start");
  this->CancelButton->setObjectName("cancel");
  this->CancelButton->setEnabled(false);
  this->StartButton->setDefault(true);

  auto* browse = new QPushButton("Browse", this);
  browse->setAutoDefault(false);
  auto* place = new QHBoxLayout;
  place->addWidget(this->Folder);
  place->addWidget(browse);
  auto* form = new QFormLayout;
  form->addRow("Folder", place);
  form->addRow("Options", this->Options);
  auto* buttons = new QHBoxLayout;
  buttons->addStretch();
  buttons->addWidget(this->StartButton);
  buttons->addWidget(this->CancelButton);
  auto* all = new QVBoxLayout(this);
  all->addWidget(introduction);
  all->addLayout(form);
  all->addWidget(this->Bar);
  all->addWidget(this->Words);
  all->addLayout(buttons);
  this->resize(560, this->sizeHint().height());

  QObject::connect(browse, &QPushButton::clicked, this, &coronaryBuild::Browse);
  QObject::connect(this->StartButton, &QPushButton::clicked, this, &coronaryBuild::Begin);
  QObject::connect(this->CancelButton, &QPushButton::clicked, this, &coronaryBuild::Cancel);
}

coronaryBuild::~coronaryBuild()
{
  if (this->Process)
  {
    // ParaView is being closed.
    this->Process->disconnect(this);
    this->Process->terminate();
    if (!this->Process->waitForFinished(Patience))
    {
      this->Process->kill();
      this->Process->waitForFinished();
    }
  }
}

void coronaryBuild::reject()
{
  this->Cancel();
  QDialog::reject();
}

void coronaryBuild::Browse()
{
  const QString folder =
    QFileDialog::getExistingDirectory(this, "Folder of the results", this->Folder->text());
  if (!folder.isEmpty())
  {
    this->Folder->setText(folder);
  }
}

void coronaryBuild::Call(const char* function, const QString& text)
{
  // With paraview.simple Python finds the modules of plugins.
  pqPVApplicationCore::instance()->pythonManager()->executeCode(
    QByteArray("import paraview.simple\nimport build_by_program\nbuild_by_program.") + function +
    "(" + Quoted(text) + ")\n");
}

bool coronaryBuild::ReadPlan()
{
  QFile file(this->Temporaries.back()->filePath("plan.json"));
  QJsonObject plan;
  if (file.open(QIODevice::ReadOnly))
  {
    plan = QJsonDocument::fromJson(file.readAll()).object();
  }
  file.close();
  file.remove();
  const QString error = plan["error"].toString("Python could not be asked: see Output Messages.");
  if (!plan.contains("steps"))
  {
    this->End(error);
    return false;
  }
  for (const QJsonValue& step : plan["steps"].toArray())
  {
    this->Steps.append(step);
  }
  return true;
}

void coronaryBuild::Begin()
{
  if (this->Working)
  {
    return;
  }
  this->Temporaries.push_back(
    std::make_unique<QTemporaryDir>(QDir::temp().filePath("coronary-build-XXXXXX")));
  this->Steps = {};
  this->Step = 0;
  this->Turn = 0;
  this->Cancelled = false;
  this->Working = true;
  this->StartButton->setEnabled(false);
  this->CancelButton->setEnabled(true);
  this->Words->setText("Looks at the series.");
  const QJsonObject wish{ { "folder", this->Folder->text().trimmed() },
    { "options", this->Options->text().trimmed() },
    { "temporary", this->Temporaries.back()->path() } };
  this->Call("plan", QString::fromUtf8(QJsonDocument(wish).toJson(QJsonDocument::Compact)));
  if (this->ReadPlan())
  {
    this->Next();
  }
}

void coronaryBuild::Next()
{
  if (!this->Working)
  {
    return;
  }
  if (this->Cancelled)
  {
    this->Call("cancelled");
    this->End("Cancelled. The stages that were finished stay.");
    return;
  }
  if (this->Step >= this->Steps.size())
  {
    this->Bar->setValue(BarSteps);
    this->End("Finished: press play.");
    this->hide(); // the model is behind it
    return;
  }
  const QJsonObject step = this->Steps[this->Step].toObject();
  this->Words->setText(step["words"].toString());
  if (step.contains("function"))
  {
    // Python does a turn, and between turns the window lives.
    const int turns = step["turns"].toInt(1);
    this->Bar->setValue(BarSteps * this->Turn / turns);
    if (this->Turn >= turns)
    {
      this->Turn = 0;
      ++this->Step;
    }
    else
    {
      this->Call(step["function"].toString().toUtf8().constData(), QString::number(this->Turn));
      if (QFile::exists(this->Temporaries.back()->filePath("plan.json")) && !this->ReadPlan())
      {
        return;
      }
      ++this->Turn;
    }
    QTimer::singleShot(0, this, &coronaryBuild::Next);
    return;
  }
  const QString program = PipelineProgram();
  if (program.isEmpty())
  {
    this->Failed("coronary-pipeline is neither beside the plugin nor in the path.");
    return;
  }
  QStringList arguments;
  for (const QJsonValue& argument : step["arguments"].toArray())
  {
    arguments << argument.toString();
  }
  this->Stage.clear();
  this->Said.clear();
  this->Bar->setValue(0);
  this->Process = std::make_unique<QProcess>();
  QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
  environment.insert("DYNAMICCORONARY_PROGRESS", "1");
  this->Process->setProcessEnvironment(environment);
  this->Process->setStandardOutputFile(QProcess::nullDevice());
  this->Process->setReadChannel(QProcess::StandardError);
  QObject::connect(
    this->Process.get(), &QProcess::readyReadStandardError, this, &coronaryBuild::Read);
  QObject::connect(this->Process.get(),
    QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this, &coronaryBuild::Finished);
  QObject::connect(this->Process.get(), &QProcess::errorOccurred, this,
    [this](QProcess::ProcessError error)
    {
      if (error == QProcess::FailedToStart)
      {
        this->Finished(-1, QProcess::CrashExit);
      }
    });
  this->Process->start(program, arguments);
}

void coronaryBuild::Read()
{
  static const QRegularExpression begun(R"(^(?:stage|phase) (\d+) of (\d+) \((.*)\)(.*)$)");
  static const QRegularExpression done(R"(^progress ([0-9.]+)$)");
  while (this->Process && this->Process->canReadLine())
  {
    const QString line = QString::fromUtf8(this->Process->readLine()).trimmed();
    const auto beginning = begun.match(line);
    const auto progress = done.match(line);
    if (progress.hasMatch())
    {
      this->Bar->setValue(static_cast<int>(BarSteps * progress.captured(1).toDouble()));
    }
    else if (beginning.hasMatch())
    {
      const int number = beginning.captured(1).toInt();
      this->Bar->setValue(BarSteps * (number - 1) / std::max(1, beginning.captured(2).toInt()));
      this->Words->setText(
        this->Steps[this->Step].toObject()["words"].toString() + " " + line + ".");
      const QString finished = this->Stage;
      this->Stage = beginning.captured(3);
      if (!finished.isEmpty() && !this->Cancelled)
      {
        this->Call("opened", finished);
      }
    }
    else if (!line.isEmpty())
    {
      this->Said = line;
    }
  }
}

void coronaryBuild::Finished(int code, QProcess::ExitStatus status)
{
  if (!this->Process)
  {
    return;
  }
  this->Read();
  // It may be the one that calls.
  this->Process.release()->deleteLater();
  if (!this->Cancelled && (code != 0 || status != QProcess::NormalExit))
  {
    this->Failed(this->Said.isEmpty() ? "coronary-pipeline ended without a word." : this->Said);
    return;
  }
  if (!this->Cancelled && !this->Stage.isEmpty())
  {
    this->Call("opened", this->Stage);
  }
  ++this->Step;
  this->Next();
}

void coronaryBuild::Cancel()
{
  if (!this->Working || this->Cancelled)
  {
    return;
  }
  this->Cancelled = true;
  this->CancelButton->setEnabled(false);
  this->Words->setText("Is being cancelled.");
  if (this->Process)
  {
    this->Process->terminate();
    QTimer::singleShot(Patience, this->Process.get(), &QProcess::kill);
  }
}

void coronaryBuild::Failed(const QString& reason)
{
  this->Call("failed", reason);
  this->End(reason);
}

void coronaryBuild::End(const QString& words)
{
  this->Working = false;
  this->StartButton->setEnabled(true);
  this->CancelButton->setEnabled(false);
  this->Words->setText(words);
}
