// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace takt::report {

/// Text as HTML or SVG content and attribute value: & < > " ' escaped, control characters dropped.
[[nodiscard]] std::string escape(std::string_view text);
/// A JSON string that may stand inside <script>: no "</" and no "<!--" in it.
[[nodiscard]] std::string script_string(std::string_view text);
/// A JSON number with `digits` significant digits; null where not finite.
[[nodiscard]] std::string script_number(double v, int digits = 9);

/// The style sheet and the script of the page.
extern const char* const page_style;
extern const char* const page_script;

}  // namespace takt::report
