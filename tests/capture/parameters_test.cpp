// The table of parameters, and the document that repeats it.

#include "capture/parameters.h"

#include <gtest/gtest.h>

#include <array>
#include <charconv>
#include <string>

#include "base/files.h"

namespace crownfit {
namespace {

std::string Plain(double v) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), v, std::chars_format::fixed).ptr};
}

TEST(Documents, ListEveryParametersDefaultRangeAndPrior) {
  const std::string formats = ReadWholeFile(CROWNFIT_DOCS "/file_formats.md", 1e6, "");
  for (const ParameterRow& row : kParameters) {
    // The thickness prior is centred on the capture's initial value: at least its order of magnitude is known.
    const std::string mean = row.quantity == Quantity::kThickness ? "the initial value" : Plain(row.prior_mean);
    const std::string line = std::string("| ") + row.key + " | " + Plain(row.initial) + " | " + Plain(row.low) +
                             " to " + Plain(row.high) + " | " + mean + ", " +
                             (row.scale == Scale::kLinear ? "+-" : "") + Plain(row.prior_stddev) + " |";
    EXPECT_NE(formats.find(line), std::string::npos) << "docs/file_formats.md lacks the line\n" << line;
  }
}

}  // namespace
}  // namespace crownfit
