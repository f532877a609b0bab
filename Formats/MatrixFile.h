/**
 * @file MatrixFile.h
 * @brief Matrices as .dmat files, text and binary, as libigl reads and writes them.
 */
#ifndef DynamicCoronary_MatrixFile_h
#define DynamicCoronary_MatrixFile_h

#include <Eigen/Core>

#include <string>

namespace coronary
{
/**
 * Reads weights, poses or any other matrix. Text: the numbers of columns and rows, then the values column
 * by column. Binary: the line `0 0`, a line with columns and rows, then doubles in the processor's order.
 *
 * @throws std::runtime_error with one sentence naming the file: it can not be read, its head is none, it has
 *   fewer or more values than the head says, a value that is no number (nan and inf are numbers).
 */
Eigen::MatrixXd ReadMatrixFile(const std::string& path);

/**
 * Writes a matrix, atomically; read back it has the same bits.
 * @throws std::runtime_error naming the file: a folder that can not be written to, a full disk.
 */
void WriteMatrixFile(
  const std::string& path, const Eigen::Ref<const Eigen::MatrixXd>& matrix, bool binary = false);
}

#endif
