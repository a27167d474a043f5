#pragma once
// Options of `fit`, which `batch` takes for all crowns and a manifest for each.

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace crownfit {

struct CommandLine;

/// Values of `fit` that need more than CLI11's types.
struct FitText {
  std::vector<std::string> captures, fixes, shares;
  std::optional<size_t> walks;
  bool no_priors = false;
};

/// --collisions, of all commands that have model diffusion.
CLI::Option* AddCollisions(CLI::App* command, CommandLine& line);

/// What `fit` and `batch` share: every one of these may be a column of a manifest.
std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, CommandLine& line, FitText& text);

/// Takes over into `line.fit` what was parsed as text.
void TakeFitText(const FitText& text, const std::function<void(const std::string&)>& complain, CommandLine& line);

/// What `fit` would complain of, or nothing.
std::string FaultOfFit(const std::vector<std::string>& fit_arguments);

}  // namespace crownfit
