# Installs the build tree into a fresh prefix, moves that prefix (so that nothing can lean on the
# place it was installed to), and uses it as a stranger would: from a project of its own, from a
# shell and, in the ParaView tree, from pvpython.
#
# cmake -D BUILD_DIR=... -D SOURCE_DIR=... -D WORK_DIR=... -D GENERATOR=... -D BUILD_TYPE=...
#       -D CXX_COMPILER=... -D C_COMPILER=... [-D PVPYTHON=...] [-D CPACK=...] -P InstallAndConsume.cmake
# With CPACK the installation is what lies in the Debian package.
cmake_minimum_required(VERSION 3.18)

# run(<what> <command> [args ...]): stops with the whole output when the command fails.
function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed (${result}):\n${output}")
  endif()
  message(STATUS "${what}: passed")
  set(run_output "${output}" PARENT_SCOPE)
endfunction()

# The package must work without help from the environment.
foreach(variable LD_LIBRARY_PATH VTK_DIR CMAKE_PREFIX_PATH PV_PLUGIN_PATH PV_PLUGIN_CONFIG_FILE)
  unset(ENV{${variable}})
endforeach()

file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix with space")
if(CPACK)
  run("packaging" "${CPACK}" --config "${BUILD_DIR}/CPackConfig.cmake" -B "${WORK_DIR}/package"
    -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip)
  file(GLOB package "${WORK_DIR}/package/dynamiccoronary_*.deb")
  run("unpacking" dpkg-deb --extract "${package}" "${WORK_DIR}/staging")
  file(RENAME "${WORK_DIR}/staging/usr" "${prefix}")
  run("reading the package" dpkg-deb --field "${package}" Depends)
  foreach(needed paraview libxrl libstdc)
    if(NOT run_output MATCHES "(^|[ ,])${needed}")
      message(FATAL_ERROR "The package does not depend on ${needed}*: ${run_output}")
    endif()
  endforeach()
else()
  run("installation" "${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${WORK_DIR}/staging")
  file(RENAME "${WORK_DIR}/staging" "${prefix}")
endif()

run("configuring the consumer" "${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/consumer"
  -G "${GENERATOR}"
  "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}"
  "-DCMAKE_C_COMPILER=${C_COMPILER}"
  "-DCMAKE_CXX_COMPILER=${CXX_COMPILER}"
  "-DCMAKE_PREFIX_PATH=${prefix}"
  "-DRUN=${WORK_DIR}/patient")
# A patient's result: coarse images of the phantom at one phase, moved as a population's hearts are.
run("the installed coronary-pipeline phantom" "${prefix}/bin/coronary-pipeline" phantom --seed 2 --fractions 0.75
  --spacing 1.2 --no-truth --quiet --output "${WORK_DIR}/images")
run("the installed coronary-pipeline run" "${prefix}/bin/coronary-pipeline" run "${WORK_DIR}/images/series.json" --quiet
  --edges 0.5 1.5 --output "${WORK_DIR}/patient")
run("building the consumer" "${CMAKE_COMMAND}" --build "${WORK_DIR}/consumer")
run("running the consumer" "${CMAKE_CTEST_COMMAND}" --test-dir "${WORK_DIR}/consumer"
  --output-on-failure --no-tests=error)

if(PVPYTHON)
  file(GLOB_RECURSE plugin "${prefix}/*/DynamicCoronaryPlugin.so")
  file(GLOB_RECURSE plugin_list "${prefix}/*/dynamiccoronary.plugins.xml")
  list(LENGTH plugin count)
  if(NOT count EQUAL 1 OR NOT plugin_list)
    message(FATAL_ERROR "The installation has no plugin, or no dynamiccoronary.plugins.xml:"
      " '${plugin}', '${plugin_list}'")
  endif()
  get_filename_component(plugin_folder "${plugin}" DIRECTORY)

  # ParaView finds a plugin by a search path, or by the list that the installation has.
  set(ENV{HOME} "${WORK_DIR}/home")
  set(script "${SOURCE_DIR}/load_installed_plugin.py")
  set(ENV{PV_PLUGIN_PATH} "${plugin_folder}")
  run("plugin found through PV_PLUGIN_PATH" "${PVPYTHON}" "${script}")
  unset(ENV{PV_PLUGIN_PATH})
  set(ENV{PV_PLUGIN_CONFIG_FILE} "${plugin_list}")
  run("plugin found through PV_PLUGIN_CONFIG_FILE" "${PVPYTHON}" "${script}")
endif()
file(REMOVE_RECURSE "${WORK_DIR}")
