/**
 * @file JoinedLumen.h
 * @brief Two lumens that overlap, as one: the aorta, and a coronary artery that opens into it.
 */
#ifndef DynamicCoronary_JoinedLumen_h
#define DynamicCoronary_JoinedLumen_h

#include "ContactSurface.h"

namespace coronary
{
/**
 * What is inside of one lumen is free of the other one's wall: the signed gap is the greater of both. Each is a closed
 * surface that gives planes wherever its gap is within reach, outside as well, and the second one begins deeper in the
 * first than what touches is thick.
 */
class JoinedLumen : public ContactSurface
{
public:
  /**
   * Both have to live as long as this.
   * @param mouth   mm, where the second one begins  @param within  mm from there, beyond which it is not asked
   */
  JoinedLumen(ContactSurface& first, ContactSurface& second, const Vector3& mouth, double within)
    : First(first)
    , Second(second)
    , Mouth(mouth)
    , Within(within)
  {
  }

  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override;

private:
  ContactSurface& First;
  ContactSurface& Second;
  Vector3 Mouth;
  double Within;
};
}

#endif
