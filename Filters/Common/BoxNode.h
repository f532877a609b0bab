// Part of BoxTree; apart, because its innermost loops are compiled for several processors.
#ifndef DynamicCoronary_BoxNode_h
#define DynamicCoronary_BoxNode_h

namespace coronary
{
/// Boxes of the children of a node, relative to the tree's centre. Node n has its children at 8 n + 1 and after.
struct alignas(64) BoxNode
{
  static constexpr int Width = 8;
  /// Low sides of a child that is missing are here, high sides at its negative: its square is infinite.
  static constexpr float Missing = 1e38F;

  float low[3][Width];
  float high[3][Width];
};
}

#endif
