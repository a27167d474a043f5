#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace crownfit {

/// What an ICC profile says of stored values (ICC.1:2022). Three curves: light at even steps of the value from 0 to 1.
struct IccProfile {
  std::string name;   ///< its description
  std::string fault;  ///< why it can't be used; empty: it can
  std::array<std::vector<float>, 3> curve;
  bool is_linear = false;           ///< all curves are the identity
  bool has_srgb_primaries = false;  ///< or grey
};

IccProfile ReadIccProfile(std::span<const std::byte> profile, int channels);

}  // namespace crownfit
