#include <DynamicCoronary/CoronaryPhantom.h>

#include <cstdlib>
#include <iostream>

int main()
{
  const coronary::CoronaryPhantom phantom{ coronary::PhantomSettings{} };
  const auto tree = phantom.Tree(0.35);
  std::cout << "centerline points at 35 % of the cycle: " << tree.points.size() << '\n';
  return tree.points.empty() ? EXIT_FAILURE : EXIT_SUCCESS;
}
