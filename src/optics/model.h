#pragma once
// The forward models, which predict light.

#include <array>
#include <optional>
#include <string_view>

namespace crownfit {

enum class Model {
  kAuto,       ///< only as a request: the cheapest of those below that suffices
  kShader,     ///< flat layers below every point of the surface: the real-time terms
  kDiffusion,  ///< path tracing that switches to diffusion after some collisions
  kPath,       ///< path tracing throughout
  kLayered,    ///< adding-doubling of flat samples
};

/// As options and files name it.
constexpr const char* Word(Model model) {
  constexpr std::array kWords{"auto", "shader", "diffusion", "path", "layered"};
  return kWords[static_cast<size_t>(model)];
}

constexpr std::optional<Model> ModelOf(std::string_view word) {
  for (const Model m : {Model::kAuto, Model::kShader, Model::kDiffusion, Model::kPath, Model::kLayered})
    if (word == Word(m)) return m;
  return std::nullopt;
}

}  // namespace crownfit
