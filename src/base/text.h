#pragma once
// Numbers in words.

#include <string>

namespace crownfit {

/// As printf would print it.
[[gnu::format(printf, 1, 2)]] std::string Printed(const char* format, ...);

/// With so many significant digits at most.
std::string Number(double value, int digits = 3);

}  // namespace crownfit
