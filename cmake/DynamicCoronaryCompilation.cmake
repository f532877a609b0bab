# How everything is linked; warnings and sanitizers for our own targets, the generated wrapping code is left alone.

# The fastest linker that is there.
if(NOT DYNAMICCORONARY_SANITIZE)
  include(CheckLinkerFlag)
  foreach(linker IN ITEMS mold lld)
    check_linker_flag(CXX "-fuse-ld=${linker}" DYNAMICCORONARY_LINKER_${linker})
    if(DYNAMICCORONARY_LINKER_${linker})
      add_link_options("-fuse-ld=${linker}")
      break()
    endif()
  endforeach()
endif()

# Several sources in one compilation: headers are read, and templates made, once for all of them. Off, a changed source is compiled alone.
option(CMAKE_UNITY_BUILD "Compile several sources at once: a whole build takes half the time, a change of one source longer" ON)

add_library(dynamiccoronary_options INTERFACE)
target_compile_options(dynamiccoronary_options INTERFACE -Wall -Wextra -Wshadow)
if(DYNAMICCORONARY_WARNINGS_AS_ERRORS)
  target_compile_options(dynamiccoronary_options INTERFACE -Werror)
  # GCC from 13 on warns of bounds within Eigen's and the standard library's own code, of places that are never reached.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
    target_compile_options(dynamiccoronary_options INTERFACE -Wno-array-bounds -Wno-stringop-overflow)
  endif()
endif()

# A class of a source that keeps what is known in that source only: GCC takes the source for a header when it is compiled with others.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_UNITY_BUILD)
  target_compile_options(dynamiccoronary_options INTERFACE -Wno-subobject-linkage)
endif()

if(DYNAMICCORONARY_SANITIZE)
  # On the whole build: a sanitizer must see every allocation of the process.
  # What the undefined behaviour sanitizer finds must fail the test, not only be printed.
  add_compile_options("-fsanitize=${DYNAMICCORONARY_SANITIZE}" -fno-sanitize-recover=all
    -fno-omit-frame-pointer -g1)
  add_link_options("-fsanitize=${DYNAMICCORONARY_SANITIZE}")
  # GCC follows values less well through instrumented code, and warns inside <regex> and Eigen.
  target_compile_options(dynamiccoronary_options INTERFACE
    "$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>")
endif()

# What the fuzzing tree watches: where the program goes (libFuzzer), and what it must not do there.
set(dynamiccoronary_fuzz_options -fsanitize=fuzzer-no-link,address,undefined,float-cast-overflow
  -fno-sanitize-recover=all -fno-omit-frame-pointer)

# dynamiccoronary_fuzzed_folder()
#   In the fuzzing tree, instruments the targets that this folder makes from here on. The code that computes goes without:
#   it reads no bytes of others, and takes long to build.
function(dynamiccoronary_fuzzed_folder)
  if(DYNAMICCORONARY_FUZZ)
    add_compile_options(${dynamiccoronary_fuzz_options})
    add_link_options(-fsanitize=address,undefined)
  endif()
endfunction()

# dynamiccoronary_module_options(<module> [link ...])
#   Our warnings and run path on a VTK module, and private links to the plain C++ libraries.
function(dynamiccoronary_module_options module)
  vtk_module_link("${module}" PRIVATE "$<BUILD_INTERFACE:dynamiccoronary_options>" ${ARGN})
  # Not all VTK versions do it: installed libraries find each other wherever they lie.
  vtk_module_set_property("${module}" PROPERTY INSTALL_RPATH VALUE "$ORIGIN")
endfunction()

# dynamiccoronary_seldom_run(<target> [hot source ...])
#   What reads command lines and JSON, calls libraries and fills windows does no other work: GCC takes a third less so for the
#   libraries' templates. Sources with loops over voxels, points or pixels are named.
function(dynamiccoronary_seldom_run target)
  target_compile_options("${target}" PRIVATE "$<$<CONFIG:Release>:-O1>")
  set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS "$<$<CONFIG:Release>:-O3>")
endfunction()

# dynamiccoronary_batches(<target> <size>)
#   Which sources of a target are compiled at once: as many of one folder. Without it CMake takes eight as they come. Sources with
#   options of their own stay alone.
function(dynamiccoronary_batches target size)
  get_target_property(sources "${target}" SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cxx$")
  set(folders)
  foreach(source IN LISTS sources)
    get_filename_component(folder "${source}" DIRECTORY)
    string(MAKE_C_IDENTIFIER "in_${folder}" folder)
    list(APPEND folders "${folder}")
    list(APPEND "${folder}" "${source}")
  endforeach()
  list(REMOVE_DUPLICATES folders)
  foreach(folder IN LISTS folders)
    list(LENGTH "${folder}" count)
    math(EXPR batches "(${count} + ${size} - 1) / ${size}")
    set(index 0)
    foreach(source IN LISTS "${folder}")
      # The innermost loops are what they are, whatever is beside them.
      if(source MATCHES "Kernels")
        set_property(SOURCE "${source}" PROPERTY SKIP_UNITY_BUILD_INCLUSION ON)
      endif()
      math(EXPR batch "${index} * ${batches} / ${count}")
      set_property(SOURCE "${source}" PROPERTY UNITY_GROUP "${folder}_${batch}")
      math(EXPR index "${index} + 1")
    endforeach()
  endforeach()
  set_target_properties("${target}" PROPERTIES UNITY_BUILD_MODE GROUP)
endfunction()
