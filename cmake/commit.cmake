# SPDX-License-Identifier: Apache-2.0
# Writes the commit that is being built into a header, and touches the header only when it has changed.
# cmake -D SOURCE=... -D HEADER=... -P commit.cmake
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude *
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit "")  # a source archive
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT [[// SPDX-License-Identifier: Apache-2.0
#pragma once
namespace takt {
/// The commit that was built; empty where it was built from an archive.
inline constexpr const char* commit = "@commit@";
}  // namespace takt
]] @ONLY)
