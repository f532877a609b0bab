/**
 * @file WorkerMain.h
 * @brief The part that is alike in all workers: request from standard input, answer back to it.
 */
#ifndef DynamicCoronary_WorkerMain_h
#define DynamicCoronary_WorkerMain_h

#include "MesherMessage.h"

#include <functional>

namespace coronary
{
/// Standard input is a socket; what is printed goes to the host as text. Returns the exit code.
int WorkerMain(const std::function<MesherAnswer(const MesherRequest&)>& mesh) noexcept;
}

#endif
