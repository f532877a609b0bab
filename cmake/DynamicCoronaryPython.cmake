# The plain VTK tree: VTK's own wrapping of our filters, readers and writers, for an ordinary python3 beside vtkmodules:
#   from dynamiccoronary import vtkFrangiVesselness
# ParaView has its own Python.
set(python_default OFF)
if(VTK_WRAP_PYTHON AND BUILD_SHARED_LIBS AND NOT DYNAMICCORONARY_WITH_PARAVIEW AND NOT DYNAMICCORONARY_SANITIZE)
  find_package("Python${VTK_PYTHON_VERSION}" QUIET COMPONENTS Interpreter Development.Module)
  set(python_default "${Python3_Development.Module_FOUND}")
endif()
option(DYNAMICCORONARY_WITH_PYTHON "Build the Python package dynamiccoronary (plain VTK)" "${python_default}")
message(STATUS "Python package: ${DYNAMICCORONARY_WITH_PYTHON}")
if(NOT DYNAMICCORONARY_WITH_PYTHON)
  return()
endif()
find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)

# Where Debian's Python looks.
set(python_destination "lib/python3/dist-packages")
vtk_module_wrap_python(
  MODULES ${dynamiccoronary_modules}
  TARGET DynamicCoronaryPython
  WRAPPED_MODULES wrapped_modules
  PYTHON_PACKAGE dynamiccoronary
  MODULE_DESTINATION "${python_destination}"
  LIBRARY_DESTINATION "${CMAKE_INSTALL_LIBDIR}"
  SOABI "${Python3_SOABI}"
  BUILD_STATIC OFF
  INSTALL_HEADERS OFF)

set(python_imports "")
foreach(module IN LISTS wrapped_modules)
  _vtk_module_get_module_property("${module}" PROPERTY "library_name" VARIABLE library)
  string(APPEND python_imports "from .${library} import *\n")
endforeach()
configure_file("${CMAKE_CURRENT_LIST_DIR}/python/__init__.py.in"
  "${CMAKE_BINARY_DIR}/${python_destination}/dynamiccoronary/__init__.py" @ONLY)
install(FILES "${CMAKE_BINARY_DIR}/${python_destination}/dynamiccoronary/__init__.py"
  DESTINATION "${python_destination}/dynamiccoronary")
