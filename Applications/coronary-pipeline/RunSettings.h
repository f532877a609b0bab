/**
 * @file RunSettings.h
 * @brief What `run` can be told: on the command line, in a settings file, and printed.
 */
#ifndef DynamicCoronary_RunSettings_h
#define DynamicCoronary_RunSettings_h

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace coronary
{
/// The stages of `run`, in their order.
enum class RunStage
{
  Vesselness,
  Segmentation,
  Centerline,
  Surface,
  Volume,
  Weights,
  Motion
};

/// Their names, by number.
const std::vector<std::string>& RunStageNames();

struct RunSettings
{
  std::vector<std::string> input; ///< images, or one surface
  std::string output;
  std::string until = "motion";

  double time = std::numeric_limits<double>::quiet_NaN(); ///< NaN: the quietest phase
  std::vector<double> fractions;
  double cycleMs = 1000.0;
  std::string series;

  std::vector<double> scales = { 0.5, 2.5 };
  double c = 100.0; // the largest norm in a clinical CT belongs to bone and metal
  std::vector<double> seeds;
  std::string seedFile; ///< markups
  std::string mask;
  std::vector<std::string> maskSegments;
  double maximumRadius = 4.5;
  std::vector<double> window;

  bool beyondMask = false;
  double minimumBranch = 0.0;
  int centerlineSteps = 5000000;
  bool labels = true;
  bool partial = false;

  std::string surface = "swept"; ///< or "given"
  std::vector<double> edges = { 0.15, 0.7 };
  bool contours = false;
  bool openEnds = false;

  std::string weightCache;
  bool leaveBonesOutside = false;

  double temporalWindowMs = 66.0;
  std::string motion = "automatic"; ///< or "tracked", "population", "none"
  double heartRate =
    std::numeric_limits<double>::quiet_NaN(); ///< of the population; NaN: that of the series
  double motionAmplitude = 1.0;
  std::string tracked = "all"; ///< or "even"
  std::vector<double> moments; ///< empty: the phases of the series
  std::string interpolation = "cubic";
  bool limits = true; ///< of the motion

  int threads = 0;
  bool compress = false;
  bool quiet = false;

  /// The last stage that is wanted.
  RunStage Until() const;
};

/// The settings as options of the command line and as members of a JSON object.
class RunOptions
{
public:
  /// Declares the options; they write into `settings`, which has to outlive this.
  RunOptions(CLI::App& app, RunSettings& settings);

  /**
   * Takes over what a file says, as far as the command line said nothing about it.
   * @throws std::runtime_error naming the file and the member that is unknown, of another type or out of range
   */
  void Read(const std::string& path);

  /// The same of a JSON object. @param place  what messages call it @throws std::runtime_error as Read()
  void Take(const nlohmann::ordered_json& json, const std::string& place);

  /// @throws UsageError naming the option that does not go with another one
  void Check() const;

  /// All settings in effect, as Read() takes them.
  nlohmann::ordered_json All() const;

  /// Names of the settings that change the results of a stage itself; not those of the stages before.
  std::vector<std::string> NamesOf(RunStage stage) const;

private:
  using Value = std::variant<bool*, int*, double*, std::string*, std::vector<double>*,
    std::vector<std::string>*>;

  struct Setting
  {
    std::string name; ///< in JSON
    Value value;
    int stage = -1; ///< RunStage that it changes; -1: none
    CLI::Option* option = nullptr;
    CLI::Validator check;  ///< of each value
    int count = 0;         ///< of values in a list, where it is fixed
    bool optional = false; ///< null or an empty list is a value
    bool points = false;   ///< a list of triples
  };

  class Declaration;
  void DeclareImages(Declaration& all);
  void DeclareVessels(Declaration& all);
  void DeclareModel(Declaration& all);
  void DeclareMotion(Declaration& all);
  static void Assign(
    Setting& setting, const nlohmann::ordered_json& value, const std::string& where);

  RunSettings& Settings;
  std::vector<Setting> List;
};

/// A run's input as its report has it: relative paths are looked for here, then in the folders above the run's, nearest first.
/// What is nowhere stays as it is.
std::vector<std::string> FindRunInput(std::vector<std::string> input, const std::string& run);
}

#endif
