#pragma once
// The program's parsers, each fed with bytes: for libFuzzer (fuzz_parsers.cpp) and for the replay in CI
// (replay_test.cpp).

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace crownfit {

struct Parser {
  const char* name;       ///< its folder in tests/fuzz/seeds
  const char* file_name;  ///< the file name under which the bytes are read
  void (*read)(const std::filesystem::path& file);
};

std::span<const Parser> Parsers();

/// Reads the bytes as that file, in a folder with the files that the bundled sphere's capture refers to. Returns the
/// error message, or an empty string. Fuzzing looks for any outcome other than an answer or an InputError.
std::string Feed(const Parser& parser, const std::string& bytes);

}  // namespace crownfit
