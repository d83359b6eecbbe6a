# SPDX-License-Identifier: Apache-2.0
# Three components: cli (the command, its pages and completions), library (shared libraries), dev (headers, CMake files).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/takt)
get_property(rooms GLOBAL PROPERTY TAKT_ROOMS)
install(TARGETS ${rooms} EXPORT taktTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev)
install(DIRECTORY takt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
  FILES_MATCHING PATTERN "*.h" PATTERN "*_for_tests.h" EXCLUDE)
install(FILES ${PROJECT_BINARY_DIR}/generated/takt/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt COMPONENT dev)
install(EXPORT taktTargets NAMESPACE takt:: DESTINATION ${config_dir} COMPONENT dev)
configure_package_config_file(cmake/taktConfig.cmake.in taktConfig.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(taktConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/taktConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/taktConfigVersion.cmake
  DESTINATION ${config_dir} COMPONENT dev)

if(NOT TARGET takt_cli)
  return()  # the fuzz preset has no command
endif()

# What a shell completes, and the manual, are made from the command itself.
set(made ${PROJECT_BINARY_DIR}/made)
install(CODE "execute_process(COMMAND ${CMAKE_COMMAND} -D TAKT=$<TARGET_FILE:takt_cli> -D OUT=${made}
    -P ${PROJECT_SOURCE_DIR}/cmake/made_from_command.cmake COMMAND_ERROR_IS_FATAL ANY)" COMPONENT cli)
install(FILES ${made}/takt.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME takt COMPONENT cli)
install(FILES ${made}/_takt DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT cli)
install(FILES ${made}/takt.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT cli)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT cli)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT cli)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT cli)
install(DIRECTORY ${made}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT cli)
