// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

namespace takt {

/// A stream's name, or a pattern in which '*' stands for any text and '?' for one character.
[[nodiscard]] bool name_matches(std::string_view pattern, std::string_view name);
[[nodiscard]] bool is_pattern(std::string_view name);

}  // namespace takt
