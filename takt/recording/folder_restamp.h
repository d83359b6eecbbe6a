// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "takt/recording/restamp.h"
#include "takt/recording/table_restamp.h"

namespace takt {

/// Copies a folder with all in it, except that the files named in `rewrite` (by path inside the folder) are written by
/// their functions. Nothing is written where `out` is empty, but the functions are called, with an empty path.
/// Throws takt::Error.
using WriteFile = std::function<void(const std::string& in, const std::string& out)>;
void copy_folder(const std::string& in, const std::string& out, const std::map<std::string, WriteFile>& rewrite);

/// Restamps a table of a folder, and says so in the log under the stream's name; without a name it only follows another
/// table. What it refers to has to outlive it.
[[nodiscard]] WriteFile table_writer(const Restamping& order, RestampLog& log, const std::string& name,
                                     TimeColumn time = {});
/// The same for a text whose lines hold stamps in a form of their own. `restamped` gives the text with others.
using RestampText =
    std::function<std::string(std::string_view text, const std::string& where, const std::function<Stamp(Stamp)>& map)>;
[[nodiscard]] WriteFile text_writer(const Restamping& order, RestampLog& log, const std::string& name,
                                    RestampText restamped);

/// The files of a folder that hold a stream's stamps, by the stream's name.
using StreamFiles = std::vector<std::pair<std::string, std::string>>;
/// Those that the order names, with what `writer` gives for a stream. Throws takt::Error where there is none.
[[nodiscard]] std::map<std::string, WriteFile> files_to_rewrite(
    const StreamFiles& files, const std::string& in, const std::string& wanted,
    const std::function<WriteFile(const std::string& stream)>& writer);
/// Likewise, of tables whose first column is ns.
[[nodiscard]] std::map<std::string, WriteFile> tables_to_rewrite(const StreamFiles& files, const std::string& in,
                                                                 const Restamping& order, RestampLog& log);

}  // namespace takt
