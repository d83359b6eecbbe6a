// SPDX-License-Identifier: Apache-2.0
// takt target --as aprilgrid -o target.pdf: prints a calibration board true to scale, and writes its description for
// takt calibrate and Kalibr beside it.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "takt/workflows/print_target.h"

namespace takt::cli {

namespace {

/// Lengths in metres, as in Kalibr's files.
struct TargetLine {
  std::string kind = "aprilgrid", paper;
  int columns = 0, rows = 0;
  double tag_m = 0.024, spacing = 0.3;
  int border = 2, first_id = 0;
  double square_m = 0.025, row_m = 0, marker_m = 0, circle_m = 0.015, diameter_m = 0;
  std::string dictionary = "DICT_6X6_250";
  bool symmetric = false, legacy = false;
};

Target target_of(const TargetLine& l) {
  const auto count = [](int given, int otherwise) { return given != 0 ? given : otherwise; };
  if (l.kind == "aprilgrid")
    return AprilGrid{count(l.columns, 6), count(l.rows, 6), l.tag_m, l.spacing, l.first_id, l.border};
  if (l.kind == "checkerboard")
    return Checkerboard{count(l.columns, 9), count(l.rows, 6), l.row_m > 0 ? l.row_m : l.square_m, l.square_m};
  if (l.kind == "circlegrid")
    return CircleGrid{count(l.columns, l.symmetric ? 7 : 4), count(l.rows, l.symmetric ? 6 : 11), l.circle_m,
                      !l.symmetric, l.diameter_m};
  return Charuco{count(l.columns, 8), count(l.rows, 6), l.square_m, l.marker_m > 0 ? l.marker_m : 0.73 * l.square_m,
                 l.dictionary,        l.legacy};
}

std::optional<PaperSize> paper_of(const std::string& name) {
  if (name.empty()) return std::nullopt;
  PaperSize upright{841, 1189};
  for (int fold = name[1] - '0'; fold > 0; --fold) upright = {std::floor(upright.height_mm / 2), upright.width_mm};
  return name.ends_with("-landscape") ? PaperSize{upright.height_mm, upright.width_mm} : upright;
}

int print(const TargetLine& line, const Common& common) {
  const std::string yaml = std::filesystem::path(common.output).replace_extension(".yaml").string();
  PrintedTarget printed;
  const Target target = target_of(line);
  try {
    printed = print_target(target, paper_of(line.paper));
  } catch (const std::invalid_argument& e) {
    fmt::print(stderr, "takt target: {}\n", e.what());
    return 2;
  }
  write_file(common.output, printed.pdf);
  write_file(yaml, printed.yaml);
  if (common.json)
    fmt::print(
        "{{\"pdf\": \"{}\", \"target\": \"{}\", \"width_mm\": {:.3f}, \"height_mm\": {:.3f}, \"page_mm\": [{:.0f}, "
        "{:.0f}]}}\n",
        common.output, yaml, printed.width_mm, printed.height_mm, printed.page_width_mm, printed.page_height_mm);
  else if (!common.quiet)
    fmt::print(
        "{}: {:.1f} by {:.1f} mm on a page of {:.0f} by {:.0f} mm; print at 100 % and measure the ruler\n{}: its "
        "description for takt calibrate and Kalibr\n",
        common.output, printed.width_mm, printed.height_mm, printed.page_width_mm, printed.page_height_mm, yaml);
  return 0;
}

}  // namespace

void add_target(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("target", "print a calibration board, true to scale");
  const auto line = std::make_shared<TargetLine>();
  verb.add_option("--as", line->kind, "aprilgrid, checkerboard, circlegrid, charuco")
      ->check(CLI::IsMember({"aprilgrid", "checkerboard", "circlegrid", "charuco"}))
      ->default_val(line->kind);
  verb.add_option("--columns", line->columns,
                  "tags, inner corners, circles or squares in a row; 6, 9, 4 (7), 8 when left out");
  verb.add_option("--rows", line->rows, "rows of them; 6, 6, 11 (6), 6 when left out");
  verb.add_option("--tag-size", line->tag_m, "aprilgrid: outer black edge to outer black edge (m)")
      ->default_val(line->tag_m);
  verb.add_option("--tag-spacing", line->spacing, "aprilgrid: gap between tags / tag size")->default_val(line->spacing);
  verb.add_option("--border", line->border, "aprilgrid: width of the black border in cells, 2 as Kalibr or 1")
      ->default_val(line->border);
  verb.add_option("--first-id", line->first_id, "aprilgrid: id of the lowest left tag")->default_val(line->first_id);
  verb.add_option("--square", line->square_m, "checkerboard, charuco: side of a square (m)")
      ->default_val(line->square_m);
  verb.add_option("--row-spacing", line->row_m, "checkerboard: from a row to the next where it differs (m)");
  verb.add_option("--marker", line->marker_m, "charuco: side of a marker (m); 0.73 of the square when left out");
  verb.add_option("--dictionary", line->dictionary, "charuco: OpenCV's name")->default_val(line->dictionary);
  verb.add_flag("--legacy", line->legacy, "charuco: the pattern of OpenCV before 4.6");
  verb.add_option("--spacing", line->circle_m, "circlegrid: spacing as Kalibr means it (m)")
      ->default_val(line->circle_m);
  verb.add_option("--diameter", line->diameter_m, "circlegrid: of a disc (m)");
  verb.add_flag("--symmetric", line->symmetric, "circlegrid: rows not shifted");
  verb.add_option("--paper", line->paper, "A0 to A4, or A4-landscape …; the smallest that holds it when left out")
      ->check(CLI::IsMember({"A0", "A1", "A2", "A3", "A4", "A0-landscape", "A1-landscape", "A2-landscape",
                             "A3-landscape", "A4-landscape"}));
  add_common(verb, common);
  verb.add_option("-o,--output", common.output, "PDF to write; the description goes beside it as .yaml")
      ->required()
      ->check(writable_as({".pdf"}));
  verb.callback([line, &common, &action] { action = [line, &common] { return print(*line, common); }; });
}

}  // namespace takt::cli
