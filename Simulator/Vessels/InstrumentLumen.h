/**
 * @file InstrumentLumen.h
 * @brief The lumen that an instrument is in when it has left the guide catheter.
 */
#ifndef DynamicCoronary_InstrumentLumen_h
#define DynamicCoronary_InstrumentLumen_h

#include "VesselWall.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// Samples are seen one after the other, from the tip back.
class InstrumentLumen : public ContactSurface
{
public:
  /// It is in the guide: where it comes out is seen then.
  virtual void Forget(std::int64_t sample) = 0;
  /// As VesselWall::Outside. @param velocity  mm/s, of the wall there
  virtual bool Outside(const ContactSample& sample, WallPlace& place, Vector3& velocity) = 0;
  /// As VesselWall::BranchAt
  virtual int BranchAt(const ContactSample& sample) = 0;
};

/// That of the artery whose ostium the guide is in.
class ArteryLumen : public InstrumentLumen
{
public:
  /// The wall has to live as long as this. @param inlet  triangle next to the guide's tip
  /// @param stride  from a sample's number to that of the next one behind
  ArteryLumen(VesselWall& artery, std::int64_t inlet, std::int64_t stride)
    : Artery(artery)
    , Inlet(inlet)
    , Stride(stride)
  {
  }
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override;
  void Forget(std::int64_t sample) override;
  bool Outside(const ContactSample& sample, WallPlace& place, Vector3& velocity) override;
  int BranchAt(const ContactSample& sample) override { return this->Artery.BranchAt(sample); }

private:
  VesselWall& Artery;
  std::int64_t Inlet;
  std::int64_t Stride;
  std::vector<char> Out; ///< per sample: it was found out of the guide
};

/// Where a sample of an instrument is, as far as one knows.
enum class AortaSide : char
{
  Unknown,
  Aorta,
  Mouth, ///< near the ostium: both lumens count
  Artery
};

/**
 * The lumen of an aorta and of the artery that opens into it. What is within MouthReach of the ostium is asked against both
 * (JoinedLumen); beyond, against the one that it is in, so that vessels which run beside the aorta are not felt through its wall.
 */
class AortaAndArtery : public InstrumentLumen
{
public:
  static constexpr double MouthReach = 12.0; ///< mm

  /// Both walls have to live as long as this. @param inlet  triangle of the artery's wall at its mouth
  /// @param offset  of samples' numbers, so that instruments have memories of their own
  /// @param first   where a sample is that is seen first away from the mouth; Unknown: in the one whose inside it is in
  AortaAndArtery(VesselWall& aorta, VesselWall& artery, std::int64_t inlet, std::int64_t offset,
    AortaSide first);

  void SetMouth(const Vector3& mouth) { this->Mouth = mouth; }
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override;
  void Forget(std::int64_t sample) override;
  bool Outside(const ContactSample& sample, WallPlace& place, Vector3& velocity) override;
  int BranchAt(const ContactSample& sample) override; ///< -1 in the aorta, too

private:
  AortaSide& Side(const ContactSample& sample, ContactSample& own);

  VesselWall& Aorta;
  VesselWall& Artery;
  std::int64_t Inlet;
  std::int64_t Offset;
  AortaSide First;
  Vector3 Mouth = Vector3::Zero();
  std::vector<AortaSide> Sides; ///< per sample
};

}

#endif
