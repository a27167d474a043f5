#pragma once
// Data from elsewhere, for tests that compare with it.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace crownfit {

/// A folder of $CROWNFIT_REFERENCE/data/real.
inline std::filesystem::path RealData(const std::string& folder) {
  const char* root = std::getenv("CROWNFIT_REFERENCE");
  return std::filesystem::path(root ? root : "../shared") / "data/real" / folder;
}

}  // namespace crownfit

/// Declares `real`, or skips the test with the reason.
#define REQUIRE_REAL_DATA(folder)                                \
  const std::filesystem::path real = crownfit::RealData(folder); \
  if (!std::filesystem::is_directory(real))                      \
  GTEST_SKIP() << "NOT RUN: no " << real << "; set CROWNFIT_REFERENCE to the folder with the reference data"
