/**
 * @file CohortCases.h
 * @brief What `cohort` works on: cases.json, checked as a whole before anything is done.
 */
#ifndef DynamicCoronary_CohortCases_h
#define DynamicCoronary_CohortCases_h

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace coronary
{
// What the check sees is an assertion in the JSON library's noexcept move constructor.
struct CohortCase // NOLINT(bugprone-exception-escape)
{
  std::string name;                 ///< also of its folder
  std::vector<std::string> input;   ///< paths; none: a phantom
  std::vector<std::string> phantom; ///< options of `phantom`, as on its command line
  std::string truth;                ///< path; empty: none, or that of the phantom
  nlohmann::ordered_json run;       ///< settings of `run`, those of all cases among them
  double timeLimit = 0.0;           ///< s; 0: none

  bool IsPhantom() const { return this->input.empty(); }
  bool HasTruth() const { return this->IsPhantom() || !this->truth.empty(); }
};

struct Cohort
{
  std::vector<CohortCase> cases;
  std::vector<std::string> evaluate; ///< options of `evaluate`, as on its command line
};

/**
 * Reads cases.json; paths in it are relative to its folder, and absolute here.
 * @throws std::runtime_error naming the file and the member that is unknown, missing, of another type or out of
 *   range, a name that is taken or no name of a folder, a file that does not exist
 */
Cohort ReadCohort(const std::string& path);

/// A digest of all that a case's results depend on: settings, files, version of the program.
std::string DigestOf(const CohortCase& one, const Cohort& cohort, const std::string& output);
}

#endif
