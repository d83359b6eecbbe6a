# SPDX-License-Identifier: Apache-2.0
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
get_property(rooms GLOBAL PROPERTY TAKT_ROOMS)
install(TARGETS ${rooms} EXPORT taktTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY takt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.h" PATTERN "*_for_tests.h" EXCLUDE)
install(FILES ${PROJECT_BINARY_DIR}/generated/takt/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt)
install(EXPORT taktTargets NAMESPACE takt:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/takt)
configure_package_config_file(cmake/taktConfig.cmake.in taktConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/takt)
write_basic_package_version_file(taktConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/taktConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/taktConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/takt)
