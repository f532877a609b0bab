/**
 * @file EvaluationRecord.h
 * @brief What was measured in one phase as text: for the other ranks, and for a later evaluation of the same files.
 */
#ifndef DynamicCoronary_EvaluationRecord_h
#define DynamicCoronary_EvaluationRecord_h

#include "Evaluation.h"

#include <string>
#include <vector>

namespace coronary
{
struct EvaluationRecord
{
  EvaluationMeasures measures;
  std::vector<BranchEvaluation> branches;
  std::vector<FalseBranch> falseBranches;
  std::vector<std::string> warnings; ///< of this phase

  /// All of it, bit by bit, in one line of JSON.
  std::string Text() const;

  /// @throws std::runtime_error when the text is no such record
  static EvaluationRecord Of(const std::string& text);
};

/// Records in files, named after all that they depend on; without a folder it keeps nothing.
class EvaluationCache
{
public:
  explicit EvaluationCache(std::string folder)
    : Folder(std::move(folder))
  {
  }

  /**
   * The name of a phase: of the content of its files, the settings and the program's version.
   * @param files     empty names are of files that there are not
   * @param segments  those that are taken of masks
   * @return empty without a folder
   * @throws std::runtime_error naming a file that can not be read
   */
  std::string NameOf(const std::vector<std::string>& files,
    const std::vector<std::string>& segments, const EvaluationSettings& settings) const;

  /// @return false when it is not there, or damaged
  bool Read(const std::string& name, EvaluationRecord& record) const;

  /// Makes the folder where it is missing. What can not be kept is measured again another time.
  void Write(const std::string& name, const EvaluationRecord& record) const;

private:
  std::string Folder;
};
}

#endif
