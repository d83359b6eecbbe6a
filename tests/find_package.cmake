# SPDX-License-Identifier: Apache-2.0
# Installs the build in TAKT_BUILD into a folder of its own, builds tests/consumer against it, and lets both the installed
# command and that program answer. cmake -D TAKT_BUILD=... -D TAKT_BUILD_TYPE=... -P find_package.cmake
set(work ${TAKT_BUILD}/find_package)
set(prefix ${work}/prefix)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV}\n${said}\nexit status ${status}")
  endif()
  set(said "${said}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${TAKT_BUILD} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${work}/consumer -G Ninja
  -D CMAKE_PREFIX_PATH=${prefix} -D CMAKE_BUILD_TYPE=${TAKT_BUILD_TYPE})
run(${CMAKE_COMMAND} --build ${work}/consumer)
run(${prefix}/bin/takt simulate handheld --tracks --duration 10 --seed 1 --quiet -o ${work}/recording)
run(${work}/consumer/consumer ${work}/recording)
if(NOT said MATCHES "^cam0 is .* against imu0")
  message(FATAL_ERROR "the program says: ${said}")
endif()

# What was installed stands on its own: it names neither the source tree nor the build tree.
file(GLOB configs ${prefix}/lib*/cmake/takt/*.cmake ${prefix}/lib*/*/cmake/takt/*.cmake)
if(NOT configs)
  message(FATAL_ERROR "no CMake files under ${prefix}")
endif()
foreach(file ${configs})
  file(READ ${file} text)
  foreach(folder ${TAKT_BUILD} ${CMAKE_CURRENT_LIST_DIR} takt_warnings)
    if(text MATCHES "${folder}")
      message(FATAL_ERROR "${file} names ${folder}")
    endif()
  endforeach()
endforeach()
file(REMOVE_RECURSE ${work})  # some hundred megabytes
