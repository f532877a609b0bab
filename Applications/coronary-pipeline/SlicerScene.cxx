#include "SlicerScene.h"

#include "TextWords.h"
#include "XmlText.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr const char* Begin = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                              "<MRML version=\"Slicer5.6.0\" userTags=\"\">\n";

/// File names of Slicer's scenes have percent signs for what is not allowed in an address.
std::string AsAddress(const std::string& path)
{
  static const char* const digits = "0123456789ABCDEF";
  std::string result;
  for (const char c : path)
  {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
      c == '/' || c == '.' || c == '-' || c == '_';
    const auto byte = static_cast<unsigned char>(c);
    result += plain ? std::string(1, c)
                    : std::string("%") + digits[byte / 16] + std::string(1, digits[byte % 16]);
  }
  return result;
}

std::string Number(double value)
{
  std::string text;
  AppendNumber(text, value);
  return text;
}

std::string Attribute(const std::string& name, const std::string& value)
{
  return " " + name + "=\"" + EscapedXml(value) + "\"";
}

/// An element without contents.
std::string Node(const std::string& tag, const std::string& id, const std::string& name,
  const std::string& attributes)
{
  return " <" + tag + Attribute("id", id) + Attribute("name", name) + attributes + "></" + tag +
    ">\n";
}

std::string IdOf(const std::string& kind, std::size_t number)
{
  return "vtkMRML" + kind + "Node" + std::to_string(number);
}

std::string IndexAttributes(const SequenceIndex& index)
{
  return Attribute("indexName", index.name) + Attribute("indexUnit", index.unit) +
    Attribute("indexType", "numeric") + Attribute("numericIndexValueTolerance", "0.001");
}

std::string ColorOf(const SlicerSequence& sequence)
{
  std::string color;
  AppendNumbers(color, sequence.color);
  return color;
}

std::string ModelDisplay(const std::string& id, const SlicerSequence& sequence)
{
  return Node("ModelDisplay", id, "",
    Attribute("hideFromEditors", "true") + Attribute("color", ColorOf(sequence)) +
      Attribute("opacity", Number(sequence.opacity)) + Attribute("visibility", "true") +
      Attribute("visibility2D", "true") + Attribute("visibility3D", "true") +
      Attribute("scalarVisibility", "false") + Attribute("backfaceCulling", "false") +
      Attribute("lineWidth", "3"));
}

/// A file, what is shown of it, and the node that has both.
std::string Model(std::size_t number, const std::string& name, const std::string& file,
  const SlicerSequence& sequence)
{
  const std::string storage = IdOf("ModelStorage", number);
  const std::string display = IdOf("ModelDisplay", number);
  return Node("ModelStorage", storage, "",
           Attribute("hideFromEditors", "true") + Attribute("fileName", AsAddress(file)) +
             Attribute("coordinateSystem", "LPS")) +
    ModelDisplay(display, sequence) +
    Node("Model", IdOf("Model", number), name,
      Attribute("references", "display:" + display + ";storage:" + storage + ";"));
}

/// What transforms a node is hung under it with. Slicer's own world is RAS.
std::string Transform(std::size_t number, const std::string& name, const AffineMotion& motion)
{
  const Vector3 flip(-1.0, -1.0, 1.0);
  std::string matrix;
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      matrix += Number(flip[row] * motion.matrix(row, column) * flip[column]) + " ";
    }
    matrix += Number(flip[row] * motion.shift[row]) + " ";
  }
  return Node("LinearTransform", IdOf("LinearTransform", number), name,
    Attribute("matrixTransformToParent", matrix + "0 0 0 1"));
}

std::string KindOf(const SlicerSequence& sequence)
{
  return sequence.IsTransform() ? "LinearTransform"
    : sequence.IsVolume()       ? "ScalarVolume"
                                : "Model";
}

/// What the browser copies the chosen item into.
std::string Shown(std::size_t number, const SlicerSequence& sequence, const std::string& folder)
{
  if (sequence.IsTransform())
  {
    return Transform(number, sequence.name, sequence.transforms.front());
  }
  if (!sequence.IsVolume())
  {
    return Model(number, sequence.name, folder + sequence.items.front(), sequence);
  }
  const std::string display = IdOf("ScalarVolumeDisplay", number);
  return Node("VolumeDisplay", display, "",
           Attribute("hideFromEditors", "true") +
             Attribute("colorNodeID", "vtkMRMLColorTableNodeGrey") +
             Attribute("window", Number(sequence.window[0])) +
             Attribute("level", Number(sequence.window[1])) + Attribute("autoWindowLevel", "0")) +
    Node("Volume", IdOf("ScalarVolume", number), sequence.name,
      Attribute("references", "display:" + display + ";"));
}

std::string FolderOf(const std::string& file)
{
  const std::size_t slash = file.rfind('/');
  return slash == std::string::npos ? std::string() : file.substr(0, slash + 1);
}

std::string IndexValues(const std::string& kind, const SequenceIndex& index)
{
  std::string values;
  for (std::size_t n = 0; n < index.values.size(); ++n)
  {
    values += (n > 0 ? ";" : "") + IdOf(kind, n + 1) + ":" + Number(index.values[n]);
  }
  return Attribute("indexValues", values);
}
}

AffineMotion FitAffineMotion(const std::vector<Vector3>& rest, const std::vector<Vector3>& now)
{
  if (rest.empty() || rest.size() != now.size())
  {
    throw std::invalid_argument("A motion of " + std::to_string(rest.size()) + " points to " +
      std::to_string(now.size()) + " can not be fitted");
  }
  const auto count = static_cast<double>(rest.size());
  Vector3 middle = Vector3::Zero();
  Vector3 moved = Vector3::Zero();
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    middle += rest[n] / count;
    moved += now[n] / count;
  }
  Matrix3 spread = Matrix3::Zero();
  Matrix3 change = Matrix3::Zero(); // of displacements with places
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    const Vector3 place = rest[n] - middle;
    spread += place * place.transpose();
    change += (now[n] - moved - place) * place.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(spread);
  Matrix3 inverse = Matrix3::Zero();
  for (int k = 0; k < 3; ++k)
  {
    const double value = solver.eigenvalues()[k];
    if (value > 1e-6 * solver.eigenvalues()[2] && value > 0.0)
    {
      const Vector3 direction = solver.eigenvectors().col(k);
      inverse += direction * direction.transpose() / value;
    }
  }
  AffineMotion motion;
  motion.matrix += change * inverse;
  motion.shift = moved - motion.matrix * middle;
  double sum = 0.0;
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    sum += (motion.matrix * rest[n] + motion.shift - now[n]).squaredNorm();
  }
  motion.left = std::sqrt(sum / count);
  return motion;
}

std::string SequenceSceneText(const SlicerSequence& sequence, const SequenceIndex& index)
{
  const std::size_t size =
    sequence.IsTransform() ? sequence.transforms.size() : sequence.items.size();
  if (size != index.values.size())
  {
    throw std::invalid_argument("The sequence '" + sequence.name + "' has " + std::to_string(size) +
      " items and " + std::to_string(index.values.size()) + " index values");
  }
  std::string text = Begin;
  for (std::size_t n = 0; n < size; ++n)
  {
    const std::string name = sequence.name + " " + std::to_string(n);
    text += sequence.IsTransform() ? Transform(n + 1, name, sequence.transforms[n])
                                   : Model(n + 1, name, sequence.items[n], sequence);
  }
  // By this node, alone in its scene, Slicer knows which data node is which moment.
  text += Node("Sequence", "vtkMRMLSequenceNodeSequenceIndex", sequence.name,
    Attribute("singletonTag", "SequenceIndex") + IndexAttributes(index) +
      IndexValues(KindOf(sequence), index));
  return text + "</MRML>\n";
}

std::string SlicerSceneText(const std::vector<SlicerSequence>& sequences,
  const SequenceIndex& index, const SlicerStill& still, double perCycle)
{
  std::string text = Begin;
  std::string postfixes;
  std::string synchronization;
  std::string references;
  for (std::size_t n = 0; n < sequences.size(); ++n)
  {
    const SlicerSequence& sequence = sequences[n];
    const std::size_t number = n + 1;
    const std::string storageKind =
      sequence.IsVolume() ? "VolumeSequenceStorage" : "SequenceStorage";
    const std::string storage = IdOf(storageKind, number);
    text += Node(storageKind, storage, "",
      Attribute("hideFromEditors", "true") + Attribute("fileName", AsAddress(sequence.file)));
    text += Node("Sequence", IdOf("Sequence", number), sequence.name + " sequence",
      IndexAttributes(index) +
        (sequence.IsVolume() ? std::string() : IndexValues(KindOf(sequence), index)) +
        Attribute("references", "storage:" + storage + ";"));
    text += Shown(number, sequence, FolderOf(sequence.file));
    const std::string postfix = "_" + std::to_string(n);
    postfixes += (n > 0 ? " " : "") + postfix;
    synchronization += Attribute("SynchronizationPropertiesMap" + postfix,
      "playback true recording false overwriteProxyName false saveChanges false missingItemMode "
      "createFromPrevious ");
    references.append("sequenceNodeRef").append(postfix).append(":");
    references.append(IdOf("Sequence", number)).append(";dataNodeRef").append(postfix).append(":");
    references.append(IdOf(KindOf(sequence), number)).append(";");
  }
  const double rate = std::max(1.0, static_cast<double>(index.values.size()) / perCycle);
  text += Node("SequenceBrowser", IdOf("SequenceBrowser", 1), "Heart cycle",
    Attribute("playbackActive", "false") + Attribute("playbackRateFps", Number(rate)) +
      Attribute("playbackItemSkippingEnabled", "true") + Attribute("playbackLooped", "true") +
      Attribute("selectedItemNumber", "0") + Attribute("recordingActive", "false") +
      Attribute("recordOnMasterModifiedOnly", "false") +
      Attribute("recordingSamplingMode", "limitedToPlaybackFrameRate") +
      Attribute("indexDisplayMode", "[indexValue]") + Attribute("indexDisplayFormat", "%.1f") +
      Attribute("virtualNodePostfixes", postfixes) + synchronization +
      Attribute("references", references));
  if (!still.segmentation.empty())
  {
    const std::string storage = IdOf("SegmentationStorage", 1);
    const std::string display = IdOf("SegmentationDisplay", 1);
    text += Node("SegmentationStorage", storage, "",
      Attribute("hideFromEditors", "true") + Attribute("fileName", AsAddress(still.segmentation)));
    // Beside a wall that moves it is seen in the slices only, until the user wants it.
    text += Node("SegmentationDisplay", display, "",
      Attribute("hideFromEditors", "true") + Attribute("visibility", "true") +
        Attribute("visibility2D", "true") + Attribute("visibility3D", "false"));
    text += Node("Segmentation", IdOf("Segmentation", 1), "Coronary arteries",
      Attribute("references", "display:" + display + ";storage:" + storage + ";"));
  }
  if (!still.points.empty())
  {
    text += Node("MarkupsJsonStorage", IdOf("MarkupsJsonStorage", 1), "",
      Attribute("hideFromEditors", "true") + Attribute("fileName", AsAddress(still.points)) +
        Attribute("coordinateSystem", "LPS"));
    text += Node("MarkupsFiducialDisplay", IdOf("MarkupsFiducialDisplay", 1), "",
      Attribute("hideFromEditors", "true") + Attribute("visibility", "true"));
    text += Node("MarkupsFiducial", IdOf("MarkupsFiducial", 1), "Ostia",
      Attribute("references",
        "display:" + IdOf("MarkupsFiducialDisplay", 1) +
          ";storage:" + IdOf("MarkupsJsonStorage", 1) + ";"));
  }
  return text + "</MRML>\n";
}
}
