#include "JoinedLumen.h"

#include <algorithm>
#include <limits>

namespace coronary
{
namespace
{
double Gap(const SampleContacts& contacts)
{
  double gap = std::numeric_limits<double>::infinity();
  for (int i = 0; i < contacts.count; ++i)
  {
    gap = std::min(gap, contacts.plane[i].gap);
  }
  return gap;
}
}

void JoinedLumen::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  this->First.Find(sample, reach, contacts);
  if (contacts.count == 0 || (sample.centre - this->Mouth).norm() > this->Within)
  {
    return;
  }
  SampleContacts other;
  this->Second.Find(sample, reach, other);
  if (Gap(other) > Gap(contacts))
  {
    contacts = other;
  }
}
}
