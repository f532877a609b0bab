/**
 * @file MesherProcess.h
 * @brief Runs meshers in processes of their own, so that none takes the host down with it.
 */
#ifndef DynamicCoronary_MesherProcess_h
#define DynamicCoronary_MesherProcess_h

#include "MesherMessage.h"
#include "ParallelFor.h"

#include <stdexcept>

namespace coronary
{
/// A worker that can not be started, crashed, left, ran out of time, or answered nonsense.
struct MesherFailure : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/**
 * The full name of a worker's executable, "" when there is none.
 *
 * Looked for in `folder`; when that is empty in the folder that the environment variable
 * DYNAMICCORONARY_WORKER_FOLDER names, then where the installation and the build tree have it, seen
 * from the library (or program) that this code is part of.
 */
std::string FindMesher(const std::string& name, const std::string& folder = "");

/**
 * Sends each request to a process of its own, as many at a time as there are threads, and waits for
 * the answers. What the workers print is kept, and its end is part of the message when one fails.
 *
 * @param executable  full name, as FindMesher gives it
 * @param timeLimit   seconds of processor time for each process, or of doing nothing, positive: the machine's load does not count
 * @param progress    called at least ten times a second
 * @return one answer for each request; a status other than Done is an answer as well
 * @throws MesherFailure; Cancelled
 */
std::vector<MesherAnswer> RunMeshers(const std::string& executable,
  const std::vector<MesherRequest>& requests, double timeLimit,
  const ProgressCallback& progress = {});
}

#endif
