/**
 * @class coronaryMenuActions
 * @brief The menu *Dynamic Coronary* of the ParaView window.
 *
 * Every entry is one call of a function of the Python modules that the plugin carries (Plugin/macros), on the client; but
 * *Build from 4D CT*, which opens a window.
 */
#ifndef coronaryMenuActions_h
#define coronaryMenuActions_h

#include <QActionGroup>
#include <QPointer>

class QAction;
class coronaryBuild;

class coronaryMenuActions : public QActionGroup
{
  Q_OBJECT

public:
  explicit coronaryMenuActions(QObject* parent);
  ~coronaryMenuActions() override;

private:
  Q_DISABLE_COPY(coronaryMenuActions);

  /// `name` is what the entry is called in recorded tests, `function` one of the module coronary_menu.
  QAction* Add(const char* name, const char* text, const char* help);
  void Add(const char* name, const char* text, const char* help, const char* function);
  void AddSeparator();
  void NameMenu();

  QPointer<coronaryBuild> Build; ///< its window, once it was asked for
};

#endif
