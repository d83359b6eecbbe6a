// SPDX-License-Identifier: Apache-2.0
#include "takt/report/table.h"

#include "takt/report/html.h"
#include "takt/report/sections.h"

namespace takt {
namespace {

std::string line(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const std::string& cell : cells) out += " " + cell + " |";
  return out + "\n";
}

}  // namespace

std::string to_markdown(const ReportTable& table) {
  std::string out = "## " + table.title + "\n\n" + (table.caption.empty() ? "" : table.caption + "\n\n") +
                    line(table.header) + line(std::vector<std::string>(table.header.size(), "---"));
  for (const auto& row : table.rows) out += line(row);
  return out + "\n";
}

std::string report::tables(const std::vector<ReportTable>& tables) {
  std::string out;
  for (const ReportTable& t : tables) {
    out += "<section>\n<h2>" + escape(t.title) + "</h2>\n<p>" + escape(t.caption) +
           "</p>\n<div class=\"scroll\"><table>\n<tr>";
    for (const std::string& cell : t.header) out += "<th>" + escape(cell) + "</th>";
    out += "</tr>\n";
    for (const auto& row : t.rows) {
      out += "<tr>";
      for (const std::string& cell : row) out += "<td class=\"n\">" + escape(cell) + "</td>";
      out += "</tr>\n";
    }
    out += "</table></div>\n</section>\n";
  }
  return out;
}

}  // namespace takt
