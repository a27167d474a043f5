#include "base/text.h"

#include <cstdarg>
#include <cstdio>

namespace crownfit {

std::string Printed(const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  // NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): clang-tidy forgets va_start where it reads several files
  std::string text(static_cast<size_t>(std::vsnprintf(nullptr, 0, format, arguments)), '\0');
  va_end(arguments);
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  return text;
}

std::string Number(double value, int digits) { return Printed("%.*g", digits, value); }

}  // namespace crownfit
