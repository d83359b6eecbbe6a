// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "cli/verbs.h"
#include "takt/calibration/estimate.h"

/// What every verb does alike: its common flags, and how it hands over a result.
namespace takt::cli {

/// --json, --quiet, --seed, --threads.
void add_common(CLI::App& verb, Common& common);
/// -o and --report, for verbs whose outcome is a result.
void add_result_output(CLI::App& verb, Common& common);

/// Checks a file to be written before the work, not after an hour of it: its folder exists (else takt::Error),
/// its ending fits.
[[nodiscard]] CLI::Validator writable_as(std::vector<std::string> endings);

/// Writes -o and --report.
void write_outputs(const Estimate& e, const Common& common);

/// Writes -o and --report, prints the result (or, with --json, exactly one object) and returns the exit status.
[[nodiscard]] int hand_over(const Estimate& e, const Common& common);

/// 0 trusted, 3 weak or refused.
[[nodiscard]] int exit_status(const Estimate& e);

/// The sentence, and unless `brief` the reasons and a table of all methods.
[[nodiscard]] std::string in_words(const Estimate& e, bool brief, bool colour);

/// A result as JSON, or as YAML where the path ends in .yaml or .yml.
void write_result(const Estimate& e, const std::string& path);
/// Reads either; throws takt::Error.
[[nodiscard]] Estimate read_result(const std::string& path);

}  // namespace takt::cli
