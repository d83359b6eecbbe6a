// SPDX-License-Identifier: Apache-2.0
// takt dial --radius R -o dial.pdf: prints the dial of the pendulum rig, true to scale.
#include <fmt/core.h>

#include <memory>
#include <stdexcept>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "takt/workflows/print_dial.h"

namespace takt::cli {

void add_dial(CLI::App& app, Common& common, Action& action) {
  struct Line {
    Dial dial;
    double radius_mm = 750, height_mm = 60;
    bool plain = false, a3 = false;
  };
  CLI::App& verb = *app.add_subcommand("dial", "print the pendulum rig's dial, true to scale");
  const auto line = std::make_shared<Line>();
  verb.add_option("--radius", line->radius_mm, "of the arc that the strip is bent to, pivot to paper (mm)")->required();
  verb.add_option("--height", line->height_mm, "of the strip (mm)")->default_val(line->height_mm);
  verb.add_option("--from", line->dial.from_deg, "first degree")->default_val(line->dial.from_deg);
  verb.add_option("--to", line->dial.to_deg, "last degree")->default_val(line->dial.to_deg);
  verb.add_option("--cell", line->dial.cell_deg, "width of a cell of the code (deg)")->default_val(line->dial.cell_deg);
  verb.add_option("--graduation", line->dial.graduation_deg, "between two lines of a plain dial (deg)")
      ->default_val(line->dial.graduation_deg);
  verb.add_option("--line", line->dial.line_deg, "width of a line (deg)")->default_val(line->dial.line_deg);
  verb.add_flag("--plain", line->plain, "graduations alone, no code");
  verb.add_flag("--a3", line->a3, "pages of A3 instead of A4");
  add_common(verb, common);
  verb.add_option("-o,--output", common.output, "PDF to write")->required()->check(writable_as({".pdf"}));
  verb.callback([line, &common, &action] {
    action = [line, &common] {
      line->dial.radius_m = 1e-3 * line->radius_mm;
      line->dial.height_m = 1e-3 * line->height_mm;
      line->dial.kind = line->plain ? DialKind::plain : DialKind::coded;
      PrintedDial printed;
      try {
        printed = print_dial(line->dial, line->a3 ? PaperSize{420, 297} : PaperSize{});
      } catch (const std::invalid_argument& e) {
        fmt::print(stderr, "takt dial: {}\n", e.what());
        return 2;
      }
      write_file(common.output, printed.pdf);
      if (common.json)
        fmt::print("{{\"pages\": {}, \"length_mm\": {:.3f}}}\n", printed.pages, printed.length_mm);
      else if (!common.quiet)
        fmt::print("{}: {} pages, a strip of {:.1f} mm by {:.1f} mm; print at 100 % and measure the ruler\n",
                   common.output, printed.pages, printed.length_mm, line->height_mm);
      return 0;
    };
  });
}

}  // namespace takt::cli
