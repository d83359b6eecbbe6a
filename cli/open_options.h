// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>

#include "takt/workflows/inspect.h"

namespace takt::cli {

/// --time-unit, --rate-unit, --from, --to: for every verb that opens recordings. `options` must outlive the parse.
void add_open_options(CLI::App& verb, OpenOptions& options);

/// --time-unit alone.
void add_time_unit(CLI::App& verb, OpenOptions& options);

}  // namespace takt::cli
