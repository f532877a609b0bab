# dynamiccoronary_allow_renamed_python_modules([folder of a VTK's CMake package ...])
#   Since 13 Debian renames the Python modules of ParaView and VTK after the CMake files that name them were made, and CMake
#   then stops every project that looks for either, as it checks that the files are there. Modules that are not there are
#   left unchecked, by the way that CMake 3.28 has for frameworks: nothing links them.
function(dynamiccoronary_allow_renamed_python_modules)
  file(GLOB folders
    ${ARGN} "${ParaView_DIR}" "${VTK_DIR}" "/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/paraview-*")
  foreach(folder IN LISTS folders)
    string(REGEX REPLACE "/lib/[^/]+/cmake/.*$" "" prefix "${folder}")
    file(GLOB lists "${folder}/*Python*-targets-*.cmake" "${folder}/vtk/*Python*-targets-*.cmake")
    foreach(list IN LISTS lists)
      file(STRINGS "${list}" lines REGEX "_cmake_import_check_files_for_")
      foreach(line IN LISTS lines)
        string(REGEX MATCH "_for_([^ ]+) \"\\\${_IMPORT_PREFIX}([^\"]+)\"" found "${line}")
        if(found AND NOT EXISTS "${prefix}${CMAKE_MATCH_2}")
          set("_cmake_import_check_xcframework_for_${CMAKE_MATCH_1}" "${folder}" PARENT_SCOPE)
        endif()
      endforeach()
    endforeach()
  endforeach()
endfunction()
