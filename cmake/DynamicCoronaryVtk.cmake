# Where ParaView, VTK and Qt of different years and distributions differ. Sets
#   DYNAMICCORONARY_WITH_WINDOW   whether the windows can be built: then Qt::Widgets is there
# One VTK per build tree: ParaView brings its own, or says which one it was built with; two can not be found together.

include("${CMAKE_CURRENT_LIST_DIR}/DynamicCoronaryPythonModules.cmake")

set(picture_components
  FiltersSources ImagingColor IOImage RenderingCore RenderingFreeType RenderingOpenGL2)
dynamiccoronary_allow_renamed_python_modules()
if(DYNAMICCORONARY_WITH_PARAVIEW)
  find_package(ParaView 5.11 REQUIRED COMPONENTS RemotingCore RemotingServerManager)
  set(vtk_place)
  if(EXISTS "${ParaView_DIR}/vtk/vtk-config.cmake")
    set(vtk_place PATHS "${ParaView_DIR}/vtk" NO_DEFAULT_PATH)
  endif()
  # What ParaView's package looks for does not bring the libraries that these need.
  find_package(VTK REQUIRED COMPONENTS ${picture_components} ${vtk_place})
else()
  set(vtk_place)
  find_package(VTK 9.1 REQUIRED COMPONENTS
    CommonCore CommonDataModel CommonExecutionModel CommonMath CommonMisc CommonTransforms
    FiltersCore FiltersGeneral FiltersGeometry IOCore IOGeometry IOImage IOLegacy IOPLY IOXML ${picture_components})
endif()

# Qt before VTK's window: VTK's own package does not look for what its module needs.
set(DYNAMICCORONARY_WITH_WINDOW OFF)
set(window_components OpenGL Widgets)
if(VTK_QT_VERSION GREATER 5)
  list(APPEND window_components OpenGLWidgets)
endif()
find_package("Qt${VTK_QT_VERSION}" QUIET COMPONENTS ${window_components})
if(TARGET Qt::Widgets)
  find_package(VTK QUIET OPTIONAL_COMPONENTS GUISupportQt IOOggTheora ${vtk_place})
endif()
if(TARGET VTK::GUISupportQt AND TARGET VTK::IOOggTheora)
  # Debian's VTK names its Qt library even where the package that has it is missing.
  get_target_property(qt_library VTK::GUISupportQt LOCATION)
  if(EXISTS "${qt_library}")
    set(DYNAMICCORONARY_WITH_WINDOW ON)
  endif()
endif()
message(STATUS "VTK ${VTK_VERSION}, ParaView ${ParaView_VERSION}; window of the simulator: ${DYNAMICCORONARY_WITH_WINDOW}")

if(TARGET VTK::nlohmannjson AND VTK_VERSION VERSION_GREATER_EQUAL 9.3)
  get_target_property(json_folders VTK::nlohmannjson INTERFACE_INCLUDE_DIRECTORIES)
  find_file(DYNAMICCORONARY_VTK_JSON vtk_nlohmannjson.h PATHS ${json_folders} NO_DEFAULT_PATH)
  mark_as_advanced(DYNAMICCORONARY_VTK_JSON)
  if(DYNAMICCORONARY_VTK_JSON)
    file(STRINGS "${DYNAMICCORONARY_VTK_JSON}" renames REGEX "define VTK_MODULE_USE_EXTERNAL_vtknlohmannjson 0")
    if(renames)
      target_compile_options(dynamiccoronary_options INTERFACE "SHELL:-include ${CMAKE_CURRENT_LIST_DIR}/one_json.h")
    endif()
  endif()
endif()
