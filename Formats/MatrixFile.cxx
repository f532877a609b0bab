#include "MatrixFile.h"

#include "AtomicFile.h"
#include "TextScanner.h"
#include "TextWords.h"

#include <cstring>

namespace coronary
{
namespace
{
/// More would not fit into any memory, and products of it stay integers.
constexpr std::int64_t MostValues = std::int64_t{ 1 } << 40;

std::int64_t MatrixSide(TextScanner& file)
{
  const std::int64_t count = file.Integer();
  if (count < 0 || count > MostValues)
  {
    file.Fail(std::to_string(count) + " is no number of rows or columns");
  }
  return count;
}

/// So that a wrong head does not take the memory: each value has at least so many characters.
void CheckSize(const TextScanner& file, std::int64_t columns, std::int64_t rows, std::size_t bytes,
  std::size_t each)
{
  const bool many = rows > 0 && columns > MostValues / rows;
  if (many || static_cast<std::size_t>(columns * rows) > (bytes + 1) / each)
  {
    file.Fail("the file is too short for " + std::to_string(rows) + " rows and " +
      std::to_string(columns) + " columns");
  }
}
}

Eigen::MatrixXd ReadMatrixFile(const std::string& path)
{
  TextScanner file(path);
  std::int64_t columns = MatrixSide(file);
  std::int64_t rows = MatrixSide(file);
  const bool binary = columns == 0 && rows == 0 && !file.AtEnd();
  if (binary)
  {
    columns = MatrixSide(file);
    rows = MatrixSide(file);
    std::size_t at = file.Position();
    const std::string& text = file.Text();
    at += at < text.size() && text[at] == '\r' ? 1 : 0;
    if (at >= text.size() || text[at] != '\n')
    {
      file.Fail("the numbers of columns and rows do not end with the line");
    }
    ++at;
    const std::size_t bytes = text.size() - at;
    CheckSize(file, columns, rows, bytes, sizeof(double));
    Eigen::MatrixXd matrix(rows, columns);
    const std::size_t wanted = static_cast<std::size_t>(rows * columns) * sizeof(double);
    if (bytes != wanted)
    {
      file.Fail("there are " + std::to_string(bytes) + " bytes of values, not " +
        std::to_string(wanted) + " for " + std::to_string(rows) + " rows and " +
        std::to_string(columns) + " columns");
    }
    if (wanted > 0)
    {
      std::memcpy(matrix.data(), text.data() + at, wanted);
    }
    return matrix;
  }
  CheckSize(file, columns, rows, file.Text().size() - file.Position(), 2);
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index n = 0; n < matrix.size(); ++n)
  {
    matrix.data()[n] = file.Number();
  }
  if (!file.AtEnd())
  {
    file.Fail("there are more values than " + std::to_string(rows) + " rows and " +
      std::to_string(columns) + " columns have");
  }
  return matrix;
}

void WriteMatrixFile(
  const std::string& path, const Eigen::Ref<const Eigen::MatrixXd>& matrix, bool binary)
{
  std::string text = binary ? "0 0\n" : "";
  text += std::to_string(matrix.cols()) + ' ' + std::to_string(matrix.rows()) + '\n';
  for (Eigen::Index column = 0; column < matrix.cols(); ++column)
  {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    {
      const double value = matrix(row, column);
      if (binary)
      {
        char bytes[sizeof(value)];
        std::memcpy(bytes, &value, sizeof(value));
        text.append(bytes, sizeof(value));
      }
      else
      {
        AppendNumber(text, value);
        text += '\n';
      }
    }
  }
  WriteFileAtomically(path, text);
}
}
