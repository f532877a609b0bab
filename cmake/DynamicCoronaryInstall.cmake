# Package files: find_package(DynamicCoronary) gives DynamicCoronary::Algorithms and
# DynamicCoronary::Formats (no VTK), DynamicCoronary::Vessels, and one target per VTK module.
include(CMakePackageConfigHelpers)

set(package_destination "${CMAKE_INSTALL_LIBDIR}/cmake/DynamicCoronary")
install(EXPORT DynamicCoronaryLibraries
  NAMESPACE DynamicCoronary::
  FILE DynamicCoronaryLibraries-targets.cmake
  DESTINATION "${package_destination}")
# The VTK modules link the libraries, and are exported from the build tree as well.
export(EXPORT DynamicCoronaryLibraries
  NAMESPACE DynamicCoronary::
  FILE "${CMAKE_BINARY_DIR}/${package_destination}/DynamicCoronaryLibraries-targets.cmake")
# On top of the VTK modules.
install(EXPORT DynamicCoronaryVessels
  NAMESPACE DynamicCoronary::
  FILE DynamicCoronaryVessels-targets.cmake
  DESTINATION "${package_destination}")

# What our modules need of VTK, in find_package's words.
set(dynamiccoronary_vtk_components ${required_modules})
list(TRANSFORM dynamiccoronary_vtk_components REPLACE "^VTK::" "")
string(REPLACE ";" " " dynamiccoronary_vtk_components "${dynamiccoronary_vtk_components}")
configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/dynamiccoronary-config.cmake.in"
  "${CMAKE_BINARY_DIR}/${package_destination}/dynamiccoronary-config.cmake"
  INSTALL_DESTINATION "${package_destination}")
write_basic_package_version_file(
  "${CMAKE_BINARY_DIR}/${package_destination}/dynamiccoronary-config-version.cmake"
  COMPATIBILITY SameMajorVersion)
install(FILES
  "${CMAKE_CURRENT_LIST_DIR}/DynamicCoronaryPythonModules.cmake"
  "${CMAKE_BINARY_DIR}/${package_destination}/dynamiccoronary-config.cmake"
  "${CMAKE_BINARY_DIR}/${package_destination}/dynamiccoronary-config-version.cmake"
  DESTINATION "${package_destination}")
