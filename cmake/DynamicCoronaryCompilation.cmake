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

add_library(dynamiccoronary_options INTERFACE)
target_compile_options(dynamiccoronary_options INTERFACE -Wall -Wextra -Wshadow)
if(DYNAMICCORONARY_WARNINGS_AS_ERRORS)
  target_compile_options(dynamiccoronary_options INTERFACE -Werror)
  # GCC from 13 on warns of bounds within Eigen's and the standard library's own code, of places that are never reached.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
    target_compile_options(dynamiccoronary_options INTERFACE -Wno-array-bounds -Wno-stringop-overflow)
  endif()
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
