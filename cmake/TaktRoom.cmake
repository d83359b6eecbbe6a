# SPDX-License-Identifier: Apache-2.0
# takt_room(NAME [PUBLIC targets...] [PRIVATE targets...])
#
# One folder of the library becomes one target takt::NAME, and its *_test.cpp become one test program.
# With TAKT_FUZZ each *_fuzz.cpp becomes a program, and a short run of it the test fuzz.<name>.
# A new file is picked up by itself: dropping it into the folder is all.
add_library(takt_warnings INTERFACE)
target_compile_options(takt_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  -Wnon-virtual-dtor -Woverloaded-virtual $<$<BOOL:${TAKT_WERROR}>:-Werror>
  # GCC 12 sees uninitialised values inside Eigen's and libstdc++'s inlined code that are not there.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict>)
if(TAKT_SANITIZE)
  add_compile_options(-fsanitize=${TAKT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TAKT_SANITIZE})
endif()
if(TAKT_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
  add_custom_target(fuzzers)  # all of them, without the rest of the library
endif()

function(takt_room name)
  cmake_parse_arguments(ROOM "" "" "PUBLIC;PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  set(all ${sources})
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$|_fuzz\\.cpp$")
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  if(sources)
    add_library(takt_${name} ${sources})  # static, or shared with BUILD_SHARED_LIBS
    set_target_properties(takt_${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${TAKT_SOVERSION})
    set(scope PUBLIC)
    target_link_libraries(takt_${name} PRIVATE $<BUILD_INTERFACE:takt_warnings> ${ROOM_PRIVATE})
  else()
    add_library(takt_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(takt::${name} ALIAS takt_${name})
  set_target_properties(takt_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(takt_${name} ${scope} cxx_std_20)
  target_include_directories(takt_${name} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated> $<INSTALL_INTERFACE:include>)
  target_link_libraries(takt_${name} ${scope} ${ROOM_PUBLIC})
  set_property(GLOBAL APPEND PROPERTY TAKT_ROOMS takt_${name})
  if(TAKT_TESTS AND tests)
    add_executable(${name}_test ${tests})
    target_link_libraries(${name}_test PRIVATE takt_${name} takt_warnings ${ROOM_PRIVATE} GTest::gtest GTest::gtest_main)
    if(TAKT_SANITIZE)
      target_compile_definitions(${name}_test PRIVATE TAKT_SANITIZED)  # times mean nothing there
    endif()
    add_test(NAME ${name} COMMAND ${name}_test)
  endif()
  if(TAKT_FUZZ)
    set(targets ${all})
    list(FILTER targets INCLUDE REGEX "_fuzz\\.cpp$")
    foreach(file ${targets})
      get_filename_component(fuzz ${file} NAME_WE)
      add_executable(${fuzz} ${file})
      target_link_libraries(${fuzz} PRIVATE takt_${name} ${ROOM_PRIVATE})
      target_link_options(${fuzz} PRIVATE -fsanitize=fuzzer)
      add_dependencies(fuzzers ${fuzz})
      # The program writes its own seeds into the corpus, so nothing but this folder is needed.
      file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/corpus/${fuzz})
      string(REGEX REPLACE "_fuzz$" "" short ${fuzz})
      add_test(NAME fuzz.${short}
        COMMAND ${fuzz} -max_total_time=5 -rss_limit_mb=2048 -timeout=10 -max_len=16384 ${CMAKE_BINARY_DIR}/corpus/${fuzz})
    endforeach()
  endif()
endfunction()
