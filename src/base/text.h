#pragma once
// Formatting of numbers.

#include <string>

namespace crownfit {

/// Formats as printf does.
[[gnu::format(printf, 1, 2)]] std::string Printed(const char* format, ...);

/// With at most `digits` significant digits.
std::string Number(double value, int digits = 3);

}  // namespace crownfit
