// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace takt::cli {

/// One line that says what is wrong with the command line and what was probably meant.
[[nodiscard]] std::string usage_complaint(const CLI::App& app, const CLI::ParseError& error);

/// The candidate nearest to `typed`, where it is near enough to be a slip of the fingers; else empty.
[[nodiscard]] std::string nearest(const std::string& typed, const std::vector<std::string>& candidates);

/// The line as a shell would take it again: words with special characters in quotes, the program by its name.
[[nodiscard]] std::string command_line(int argc, char** argv);

}  // namespace takt::cli
