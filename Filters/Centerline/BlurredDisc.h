/**
 * @file BlurredDisc.h
 * @brief What a round lumen looks like in a blurred image.
 */
#ifndef DynamicCoronary_BlurredDisc_h
#define DynamicCoronary_BlurredDisc_h

namespace coronary
{
/**
 * Share of a disc's contrast, 0 to 1, at a distance from its centre after a Gaussian blur.
 *
 * All lengths are in standard deviations of the blur. A disc much smaller than the blur answers in proportion to its area:
 * this is what tells its size when its width does not any more. Right to 0.002.
 */
double BlurredDisc(double distance, double radius);

/// The same for many distances of one disc: what follows from its radius is made once.
class BlurredProfile
{
public:
  explicit BlurredProfile(double radius);
  double At(double distance) const;

private:
  double Radius;
  const float* Shape = nullptr; ///< none: nothing, or nearly straight
  double Share = 0.0;           ///< between the shapes of two radii
  double Centre = 0.0;
};

/// Share of a ball's contrast at its centre, radius in standard deviations of the blur.
double BlurredBallCentre(double radius);

/// Distance at which a blurred ball has half of what it has at its centre; both in standard deviations of the blur.
double BallHalfMaximum(double radius);
}

#endif
