/**
 * @class coronaryBuild
 * @brief *Build from 4D CT*: its window, and the programs that do the work while ParaView goes on.
 *
 * `coronary-pipeline run` makes the model in a folder. What each stage made is opened when it is finished, by functions of the
 * Python module build_by_program; these say in FOLDER/plan.json what is to be done.
 */
#ifndef coronaryBuild_h
#define coronaryBuild_h

#include <QDialog>
#include <QJsonArray>
#include <QProcess>
#include <QString>
#include <QTemporaryDir>

#include <memory>
#include <vector>

class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;

class coronaryBuild : public QDialog
{
  Q_OBJECT

public:
  explicit coronaryBuild(QWidget* parent);
  ~coronaryBuild() override;

  /// Starts the work; does nothing while it goes on.
  void Begin();

  /// Ends it: the stages that are finished stay.
  void Cancel();

  void reject() override;

private:
  Q_DISABLE_COPY(coronaryBuild);

  void Browse();
  /// The next of what plan.json says.
  void Next();
  void Read();
  void Finished(int code, QProcess::ExitStatus status);
  void Failed(const QString& reason);
  void End(const QString& words);
  /// A function of the Python module build_by_program, with a text.
  void Call(const char* function, const QString& text = {});
  /// plan.json again; false: Python could not, and has said why.
  bool ReadPlan();

  QLineEdit* Folder;
  QLineEdit* Options;
  QLabel* Words;
  QProgressBar* Bar;
  QPushButton* StartButton;
  QPushButton* CancelButton;
  /// One for each time, the last of them now: what was opened of the others may still be shown.
  std::vector<std::unique_ptr<QTemporaryDir>> Temporaries;
  std::unique_ptr<QProcess> Process;
  QJsonArray Steps; ///< of plan.json
  int Step = 0;
  int Turn = 0;  ///< of a step that Python does turn by turn
  QString Stage; ///< the program's, not finished yet
  QString Said;  ///< the program's last words
  bool Working = false;
  bool Cancelled = false;
};

#endif
