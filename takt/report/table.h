// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt {

/// A table of words and numbers, as a page of Markdown and the HTML report show it.
struct ReportTable {
  std::string title;
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< each as long as the header
};

[[nodiscard]] std::string to_markdown(const ReportTable& table);

}  // namespace takt
