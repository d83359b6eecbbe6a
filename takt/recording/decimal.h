// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace takt {

/// A decimal number times 10^`exponent_to_ns`, rounded half away from zero to an int64, without ever being a double:
/// "1264.250902773" seconds (9) are 1264250902773 ns. Nothing where it is no number or does not fit.
[[nodiscard]] std::optional<std::int64_t> decimal_to_ns(std::string_view text, int exponent_to_ns);

/// The other way, exactly: 1264250902773 ns in seconds (9) are "1264.250902773". Zeros at the end are left out down to
/// `decimals` digits behind the point.
[[nodiscard]] std::string decimal_of_ns(std::int64_t ns, int exponent_to_ns, int decimals);

/// The whole text as an int of 0 or more, digits alone; nothing otherwise.
[[nodiscard]] std::optional<int> whole_number(std::string_view text);

/// The whole text as a finite double; nothing otherwise.
[[nodiscard]] std::optional<double> finite_double(std::string_view text);

}  // namespace takt
