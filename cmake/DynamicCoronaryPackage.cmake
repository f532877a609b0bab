# `cpack` in a build tree makes dynamiccoronary_VERSION_amd64.deb: programs, libraries, headers, documentation
# and, from the ParaView tree, the plugin, which ParaView then loads by itself.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME dynamiccoronary)
set(CPACK_PACKAGE_VENDOR "DynamicCoronary")
set(CPACK_PACKAGE_CONTACT "DynamicCoronary developers <dynamiccoronary@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION
  "VTK filters, a ParaView plugin and programs that turn a gated cardiac CT into a coronary artery tree
that moves, compare it with a truth, export it, and a training simulator for coronary interventions.
For research and training, not for diagnosis.")
set(CPACK_RESOURCE_FILE_LICENSE "${CMAKE_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# Libraries that the programs load; what they load among themselves lies in the build tree.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
set(triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA "${CMAKE_BINARY_DIR}/debian/triggers")
if(DYNAMICCORONARY_WITH_PARAVIEW)
  set(CPACK_DEBIAN_PACKAGE_DEPENDS "paraview")
  # Icons; pvpython; a display for pictures without a screen.
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libqt5svg5 | qt6-svg-plugins, python3-paraview, xvfb, xauth")
  set(plugin_list "/usr/${CMAKE_INSTALL_LIBDIR}/${PARAVIEW_PLUGIN_SUBDIR}/dynamiccoronary.plugins.xml")
  # Beside ParaView's own plugins.
  string(REGEX REPLACE "/cmake/[^/]+/*$" "" paraview_conf "${ParaView_DIR}")
  string(REGEX REPLACE "/plugins$" "/paraview.conf" paraview_conf "${paraview_conf}/${PARAVIEW_PLUGIN_SUBDIR}")
  string(APPEND triggers "interest-noawait ${paraview_conf}\n")
  configure_file("${CMAKE_CURRENT_LIST_DIR}/debian/postinst.in" "${CMAKE_BINARY_DIR}/debian/postinst" @ONLY)
  configure_file("${CMAKE_CURRENT_LIST_DIR}/debian/prerm.in" "${CMAKE_BINARY_DIR}/debian/prerm" @ONLY)
  list(APPEND CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    "${CMAKE_BINARY_DIR}/debian/postinst" "${CMAKE_BINARY_DIR}/debian/prerm")
endif()
file(WRITE "${CMAKE_BINARY_DIR}/debian/triggers" "${triggers}")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

install(FILES "${CMAKE_SOURCE_DIR}/LICENSE"
  DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/dynamiccoronary" RENAME copyright)
install(FILES "${CMAKE_SOURCE_DIR}/README.md" "${CMAKE_SOURCE_DIR}/CHANGELOG.md" "${CMAKE_SOURCE_DIR}/CITATION.cff"
  DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/dynamiccoronary")
install(DIRECTORY "${CMAKE_SOURCE_DIR}/docs" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/dynamiccoronary")

include(CPack)
