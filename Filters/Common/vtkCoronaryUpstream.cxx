#include "vtkCoronaryUpstream.h"

#include "vtkDemandDrivenPipeline.h"
#include "vtkExecutive.h"
#include "vtkInformation.h"
#include "vtkInformationExecutivePortKey.h"
#include "vtkInformationVector.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

using SDDP = vtkStreamingDemandDrivenPipeline;

namespace vtkCoronary
{
Moment NearestMoment(vtkInformation* inInfo, bool first, double time)
{
  Moment moment;
  const int count = inInfo->Has(SDDP::TIME_STEPS()) ? inInfo->Length(SDDP::TIME_STEPS()) : 0;
  if (count > 0)
  {
    const double* steps = inInfo->Get(SDDP::TIME_STEPS());
    const auto nearer = [=](double a, double b) { return std::abs(a - time) < std::abs(b - time); };
    moment.exists = true;
    moment.time = first ? steps[0] : *std::min_element(steps, steps + count, nearer);
  }
  else if (inInfo->Has(SDDP::TIME_RANGE()))
  {
    const double* range = inInfo->Get(SDDP::TIME_RANGE());
    moment.exists = true;
    moment.time = first ? range[0] : std::min(std::max(time, range[0]), range[1]);
  }
  return moment;
}

vtkMTimeType UpstreamTime(vtkInformation* inInfo)
{
  auto* producer =
    vtkDemandDrivenPipeline::SafeDownCast(vtkExecutive::PRODUCER()->GetExecutive(inInfo));
  return producer ? producer->GetPipelineMTime() : 0;
}

void SetRequest(vtkInformation* inInfo, const std::array<int, 6>& extent)
{
  inInfo->Set(SDDP::UPDATE_EXTENT(), extent.data(), 6);
  inInfo->Set(SDDP::UPDATE_PIECE_NUMBER(), 0);
  inInfo->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), 1);
  inInfo->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
}

void RequestWholeForFirstPiece(
  vtkInformation* request, vtkInformationVector** inputs, int ports, vtkInformationVector* outputs)
{
  const int port = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const int piece = outputs->GetInformationObject(port)->Get(SDDP::UPDATE_PIECE_NUMBER());
  for (int input = 0; input < ports; ++input)
  {
    for (int i = 0; i < inputs[input]->GetNumberOfInformationObjects(); ++i)
    {
      vtkInformation* info = inputs[input]->GetInformationObject(i);
      info->Set(SDDP::UPDATE_PIECE_NUMBER(), piece > 0 ? 1 : 0);
      info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), piece > 0 ? 2 : 1);
      info->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
    }
  }
}

UpstreamRequest::UpstreamRequest(vtkInformation* inInfo, vtkInformation* original)
  : Info(inInfo)
  , HasExtent(original->Has(SDDP::UPDATE_EXTENT()) != 0)
  , Piece(original->Get(SDDP::UPDATE_PIECE_NUMBER()))
  , Pieces(std::max(1, original->Get(SDDP::UPDATE_NUMBER_OF_PIECES())))
  , Ghosts(original->Get(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS()))
{
  if (this->HasExtent)
  {
    original->Get(SDDP::UPDATE_EXTENT(), this->Extent.data());
  }
  this->When.exists = original->Has(SDDP::UPDATE_TIME_STEP()) != 0;
  this->When.time = this->When.exists ? original->Get(SDDP::UPDATE_TIME_STEP()) : 0.0;
}

void UpstreamRequest::Ask(const std::array<int, 6>* extent, const Moment& moment)
{
  this->Changed = true;
  if (extent)
  {
    SetRequest(this->Info, *extent);
  }
  else
  {
    this->Info->Set(SDDP::UPDATE_PIECE_NUMBER(), 0);
    this->Info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), 1);
    this->Info->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
  }
  this->Update(moment);
}

void UpstreamRequest::Restore(const Moment* moment)
{
  if (!this->Changed)
  {
    return;
  }
  this->Changed = false;
  if (this->HasExtent)
  {
    this->Info->Set(SDDP::UPDATE_EXTENT(), this->Extent.data(), 6);
  }
  this->Info->Set(SDDP::UPDATE_PIECE_NUMBER(), this->Piece);
  this->Info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), this->Pieces);
  this->Info->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), this->Ghosts);
  this->Update(moment ? *moment : this->When);
}

void UpstreamRequest::Update(const Moment& moment)
{
  if (moment.exists)
  {
    this->Info->Set(SDDP::UPDATE_TIME_STEP(), moment.time);
  }
  else
  {
    this->Info->Remove(SDDP::UPDATE_TIME_STEP());
  }
  vtkExecutive* producer = vtkExecutive::PRODUCER()->GetExecutive(this->Info);
  if (!producer->Update(vtkExecutive::PRODUCER()->GetPort(this->Info)))
  {
    throw std::runtime_error("the input failed to give its data at another time or extent");
  }
}
}
