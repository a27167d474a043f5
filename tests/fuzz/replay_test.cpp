// The parsers under the checked-in seeds (good files, and what fuzzing found) and under seeded mutations of them. The
// long form, guided by coverage, is ./dev bench fuzz; a longer form of this one: CROWNFIT_MUTATIONS=100000.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "base/files.h"
#include "base/random.h"
#include "fuzz/parsers.h"

namespace crownfit {
namespace {

std::vector<std::string> SeedsOf(const Parser& parser) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(CROWNFIT_SEEDS) / parser.name))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::string> seeds;
  for (const auto& file : files) seeds.push_back(ReadWholeFile(file, 1e6, ""));
  return seeds;
}

/// A few changes of the kinds that break parsers: bytes, numbers at the limits, parts repeated, moved, cut off.
std::string Mutated(std::string bytes, uint64_t key) {
  static const std::vector<std::string> tokens{"-1",
                                               "0",
                                               "1e999",
                                               "-1e308",
                                               "1e-320",
                                               "nan",
                                               "inf",
                                               "2147483648",
                                               "4294967295",
                                               "18446744073709551616",
                                               "9e15",
                                               "null",
                                               "true",
                                               "[",
                                               "]",
                                               "{",
                                               "}",
                                               "\"",
                                               ",",
                                               ":",
                                               "\\u0000",
                                               "\n",
                                               " ",
                                               "../",
                                               "/",
                                               std::string(8, '\0'),
                                               "\xff\xff\xff\xff",
                                               "\xff\xff\xff\x7f",
                                               std::string("\0\0\xc0\x7f", 4),
                                               "[0, 0, 0]",
                                               "{\"fixed\": 0}",
                                               "\xEF\xBB\xBF"};
  auto below = [&, draw = uint64_t{0}](size_t n) mutable {
    return n == 0 ? 0 : static_cast<size_t>(Uniform(key, draw++) * static_cast<double>(n));
  };
  for (size_t k = 1 + below(4); k > 0; --k) {
    const size_t at = below(bytes.size() + 1), length = std::min(below(40), bytes.size() - at);
    switch (below(6)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(below(256));
        break;
      case 1:
        bytes.insert(at, tokens[below(tokens.size())]);
        break;
      case 2:
        bytes.replace(at, std::min<size_t>(length, 8), tokens[below(tokens.size())]);
        break;
      case 3:
        bytes.erase(at, length);
        break;
      case 4:
        bytes.insert(below(bytes.size() + 1), bytes.substr(at, length));
        break;
      default:
        if (below(4) == 0) bytes.resize(at);
    }
  }
  return bytes;
}

class ParserTest : public testing::TestWithParam<Parser> {};

TEST_P(ParserTest, EveryMutatedSeedIsReadOrRefusedWithAMessage) {
  const char* text = std::getenv("CROWNFIT_MUTATIONS");
  const size_t mutations = text ? std::strtoul(text, nullptr, 10) : 300;
  const std::vector<std::string> seeds = SeedsOf(GetParam());
  ASSERT_FALSE(seeds.empty());
  size_t refused = 0;
  for (const std::string& seed : seeds) Feed(GetParam(), seed);
  for (size_t i = 0; i < mutations; ++i) {
    const std::string complaint = Feed(GetParam(), Mutated(seeds[i % seeds.size()], Key(1, i)));
    ASSERT_LT(complaint.size(), 70000u);
    refused += !complaint.empty();
  }
  EXPECT_GT(refused, mutations / 10) << "mutations that change nothing test nothing";
}

TEST_P(ParserTest, FirstSeedIsValid) { EXPECT_EQ(Feed(GetParam(), SeedsOf(GetParam()).at(0)), ""); }

INSTANTIATE_TEST_SUITE_P(Fuzz, ParserTest, testing::ValuesIn(Parsers().begin(), Parsers().end()),
                         [](const auto& parser) { return std::string(parser.param.name); });

}  // namespace
}  // namespace crownfit
