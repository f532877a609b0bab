// Included before everything else where VTK carries a copy of nlohmann's json (VTK 9.3 and 9.4): its header renames the
// namespace by a macro, and then neither copy can be used in a file that includes both. VTK's own functions that take or give
// json are not called here, so that it may as well be the system's.
#if __has_include(<vtk_nlohmannjson.h>)
#include <nlohmann/json_fwd.hpp>
#include <vtk_nlohmannjson.h>
#ifdef nlohmann
#undef nlohmann
namespace vtknlohmann = nlohmann;
#endif
#endif
