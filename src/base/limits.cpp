#include "base/limits.h"

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>

#include "base/error.h"

namespace crownfit {
namespace {

void TakeFromEnvironment(const char* name, double& limit) {
  const char* text = std::getenv(name);
  if (!text) return;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, limit);
  if (error != std::errc() || stop != end || !(limit > 0 && limit <= 1e6))
    throw InputError("", name, "'" + std::string(text).substr(0, 40) + "' is not a number above 0, at most 1000000",
                     "Correct this environment variable, or unset it; see docs/limits.md.");
}

}  // namespace

Limits InputLimits() {
  Limits limits;
  TakeFromEnvironment("CROWNFIT_MAX_IMAGE_MEGAPIXELS", limits.image_megapixels);
  TakeFromEnvironment("CROWNFIT_MAX_IMAGE_SECONDS", limits.image_seconds);
  TakeFromEnvironment("CROWNFIT_MAX_MESH_MILLION_TRIANGLES", limits.mesh_million_triangles);
  TakeFromEnvironment("CROWNFIT_MAX_JSON_MIB", limits.json_MiB);
  TakeFromEnvironment("CROWNFIT_MAX_CROWN_MEGAPIXELS", limits.crown_megapixels);
  return limits;
}

}  // namespace crownfit
