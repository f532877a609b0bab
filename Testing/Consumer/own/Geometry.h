// A header of the consumer's that has the name of one of ours.
#ifndef Geometry_h
#define Geometry_h

struct ShopGeometry
{
  double width = 2.5;
};

#endif
