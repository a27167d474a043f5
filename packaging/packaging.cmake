# What is installed, and the packages made of it (./dev package). Shaders, chart values and the report's page are built into
# the program, so that it runs from wherever the installed folder is moved to.

include(GNUInstallDirs)
install(TARGETS crownfit RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS crownfit_images LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/crownfit)
set_target_properties(crownfit PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}/crownfit")
install(DIRECTORY calib DESTINATION ${CMAKE_INSTALL_DATADIR}/crownfit)
install(DIRECTORY datasets_synthetic/incisor_shader datasets_synthetic/flat_samples DESTINATION ${CMAKE_INSTALL_DATADIR}/crownfit/examples)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
# Which Debian packages the archive needs: ./dev package reads them from the .deb.
install(FILES ${PROJECT_BINARY_DIR}/NEEDS DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)

set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # tests need not be built for a package
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_PACKAGE_CONTACT "The crownfit developers <crownfit@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Fits the optical materials of dental crowns and teeth to calibrated photographs")
cmake_host_system_information(RESULT built_on QUERY DISTRIB_INFO)  # "debian" and "12", as libraries differ
set(CPACK_PACKAGE_FILE_NAME crownfit-${PROJECT_VERSION}-${built_on_ID}${built_on_VERSION_ID}-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Found while it runs: the window's font; OpenGL and its drivers, for `crownfit view` alone.
set(CPACK_DEBIAN_PACKAGE_DEPENDS fonts-dejavu-core)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libegl1, libgl1, libgl1-mesa-dri")
include(CPack)
