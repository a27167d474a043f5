#pragma once
// Errors. A user's mistake is an InputError: thrown where it is found. main catches what reaches it: exit code 2.
// A programmer's mistake aborts through Check. A numerical outcome is a result, never an exception.

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace crownfit {

/// Wrong input: says which file, which key or region, what is wrong and what to do about it.
struct InputError : std::runtime_error {
  InputError(const std::filesystem::path& file, const std::string& key, const std::string& message,
             const std::string& remedy = "")
      : std::runtime_error((file.empty() ? "" : file.string() + ": ") + (key.empty() ? "" : key + ": ") + message +
                           (remedy.empty() ? "" : "\n  " + remedy)) {}
};

/// Aborts when `holds` is false: a mistake in this program, not in its input.
inline void Check(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "crownfit: internal error: %s\n", what);
  std::abort();
}

}  // namespace crownfit
