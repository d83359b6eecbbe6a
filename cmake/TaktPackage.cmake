# SPDX-License-Identifier: Apache-2.0
# Debian packages: takt (the command), libtakt<soversion> (shared libraries), libtakt-dev (headers). Made by scripts/package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "takt")
set(CPACK_PACKAGE_CONTACT "The takt developers <takt@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_COMPONENTS_ALL cli library dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_STRIP_FILES ON)
set(library libtakt${TAKT_SOVERSION})

set(CPACK_DEBIAN_CLI_PACKAGE_NAME takt)
set(CPACK_DEBIAN_CLI_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CLI_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_CLI_PACKAGE_DEPENDS "${library} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
# The libraries find each other in the build tree while their dependencies are looked up.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/takt)

# Who builds against takt needs what takt's own build needs.
file(STRINGS scripts/packages.txt build_packages REGEX "^(lib.*-dev|nlohmann-json3-dev|pkgconf)$")
list(JOIN build_packages ", " build_packages)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtakt-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${library} (= ${PROJECT_VERSION}), ${build_packages}")
include(CPack)
