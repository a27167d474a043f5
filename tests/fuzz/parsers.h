#pragma once
// The program's parsers, each fed with bytes: for libFuzzer (fuzz_parsers.cpp) and for the replay in CI
// (replay_test.cpp).

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace crownfit {

struct Parser {
  const char* name;       ///< of its folder in tests/fuzz/seeds
  const char* file_name;  ///< under which the bytes are read
  void (*read)(const std::filesystem::path& file);
};

std::span<const Parser> Parsers();

/// Reads the bytes as that file, in a folder that holds what the bundled sphere's capture refers to. Returns the
/// complaint, or nothing. Any other end than an answer or an InputError is what fuzzing looks for.
std::string Feed(const Parser& parser, const std::string& bytes);

}  // namespace crownfit
