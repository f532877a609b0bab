# X-ray attenuation coefficients: Xraylib_FOUND and the target Xraylib::Xraylib.
find_path(XRAYLIB_INCLUDE_DIR xraylib/xraylib.h)
find_library(XRAYLIB_LIBRARY xrl)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Xraylib
  REQUIRED_VARS XRAYLIB_LIBRARY XRAYLIB_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "it is Debian's package libxrl-dev")
mark_as_advanced(XRAYLIB_INCLUDE_DIR XRAYLIB_LIBRARY)
if(Xraylib_FOUND AND NOT TARGET Xraylib::Xraylib)
  add_library(Xraylib::Xraylib UNKNOWN IMPORTED)
  set_target_properties(Xraylib::Xraylib PROPERTIES
    IMPORTED_LOCATION "${XRAYLIB_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${XRAYLIB_INCLUDE_DIR}")
endif()
