// A header of the consumer's that has the name of one of ours.
#ifndef Device_h
#define Device_h

struct ShopDevice
{
  int number = 7;
};

#endif
