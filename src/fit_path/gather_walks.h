#pragma once
// Walks of every photograph at the point where a fit stands, compared with the photographs.

#include <list>
#include <string>
#include <vector>

#include "fit/walk_comparison.h"
#include "fit_path/photograph_flow.h"
#include "fit_path/walk_unknowns.h"
#include "fit_path/walked_step.h"
#include "path/path_derivatives.h"

namespace crownfit {

/// Per pixel, so that derivatives' errors can be found from as many groups as there are.
int FewestPaths(const Material& material);

/// After which derivatives by diffusion are within some per cent of the path model's: so many transport paths into the
/// outer layer. After a tenth of it, in clear enamel of 0.9 mm, those by its scattering from behind are three times too
/// large (docs/validation.md).
int CollisionsThatTell(const Material& material);
/// After which light keeps no more than a twentieth of its polarisation, as what is handed over to diffusion has none.
int CollisionsThatDepolarise(const PhotographSpec& photo);

/// How light is followed for fields of diffuse light: rays of each lamp.
inline constexpr int kRaysOfValues = 20000;
/// The same for every path that derivatives are walked by, in a search and after it.
inline constexpr double kRaysOfSearch = 0.1, kRaysOfAPath = 0.4;
/// Transport paths, mm, below which a search's fields need not resolve: elements of a quarter. They are 1 % too dark at
/// 4 / mm, and derivatives by scattering a fifth off; runs resolve what is there.
inline constexpr double kShortestOfSearch = 0.31;
/// Of groups of paths, that derivatives have: with fewer the groups' own noise is not known.
inline constexpr int kPathsOfAGroup = 3;

/// The capture with its calibration and lamps where the fit has moved them.
void MoveInput(const FitProblem& problem, const FitState& at, CrownInput& input);

/// What walks say of the point where they were made.
struct GatheredWalks {
  WalkedStep step;
  double chi2;  ///< of pixels, over their number
  ResidualChi2 left;
  std::vector<ResidualChi2> left_of;          ///< per photograph of the fit
  std::vector<std::vector<Spectrum>> values;  ///< per photograph of the fit and sharp pixel
  /// J' C J of what the model is off by in common over photographs, whitened; of the material's entries and nuisances.
  Eigen::MatrixXd model_scatter;
};

/// What the model is off by, relative, rms: common to a patch in one channel, to a photograph, to a channel of it.
struct ModelError {
  double patch = 0, photograph = 0, channel = 0;
};
/// Of model `diffusion` at the true values of path-traced captures, after ten collisions: the first figures where those
/// are three transport paths or more, and by the root as much larger as they are fewer (g 0.68: 2 % a photograph, 3 % a
/// patch; g 0.96: 3 and 9 %, 5 and 12 %; docs/validation.md).
ModelError DiffusionError(const Material& material, const FitOptions& options);

class WalkGatherer {
 public:
  /// All must outlive it; `input` is moved to where the fit has moved the calibration.
  WalkGatherer(const FitProblem& problem, CrownInput& input, FitState& at, const WalkUnknowns& unknowns,
               Progress& progress);

  /// How pictures are predicted from now on: by walks to their end (at first), or handed over to diffusion.
  enum class Walks { kToTheirEnd, kHandedOver };
  void GoBy(Walks how) { walks_ = how; }
  /// The next walks take the same random numbers as the first ones.
  void RepeatRandomNumbers() { run_ = 0; }
  /// What diffuse light's fields resolve from now on, and by how many rays of each lamp for every path of derivatives:
  /// at first no more than leads to where the optimum is.
  void ResolveFields() { bodies_.ResolvePathsFrom(0.0), rays_of_a_path_ = kRaysOfAPath; }
  /// How well the material's entries are known. Derivatives hardly follow those that photographs hardly tell.
  void Know(const Eigen::VectorXd& stddevs) { stddevs_ = stddevs; }
  /// From now on at most so many pixels a photograph are compared, which lie on the object where the calibration
  /// stands.
  void TakePixels(size_t at_most);
  /// Walks every photograph: so many paths for values, and for derivatives until those from about here have so many.
  /// Counts an iteration.
  GatheredWalks Gather(double paths, double slope_paths, const std::string& stage);
  /// What the last walks say of other unknowns, of a problem with the same photographs and the same material there.
  GatheredWalks Compare(const FitProblem& problem, const WalkUnknowns& unknowns) const;
  /// Patches' squares over their noise's, by few walks: to tell a good start from a bad one.
  double MisfitOfPatches(double paths, const std::string& stage);

 private:
  using Shared = std::vector<size_t>;  ///< numbers in FitState::pixels of photographs that share walks
  struct SlopesFound {
    Eigen::VectorXd at;
    double paths;                  ///< a pixel
    bool of_roughness, of_others;  ///< what it tells
    PooledDerivatives derivatives;
    std::vector<PixelEstimate> picture;  ///< that they came with, by rank
  };
  void TakeNoiseFromNeighbours();
  void LearnFromPicture(size_t g, const std::vector<size_t>& ranks);
  const PhotographSpec& SpecOf(const FitPixels& p) const { return input_.capture.photographs[p.photograph]; }
  const PhotographCast& CastOf(const FitPixels& p) const { return at_.cast.photographs[p.photograph]; }
  std::vector<Shared> SharedWalks() const;
  std::vector<size_t> PhotographsOf(const Shared& shared) const;
  PathOptions OptionsFor(const Shared& shared, double paths, int fewest);
  std::vector<PathPhotograph> Predict(const Material& material, const Shared& shared, const PathOptions& options,
                                      const std::string& stage);
  void HandOver(const Material& material, const Shared& shared, int rays, PathOptions& options);
  /// Derivatives to be made by one set of walks.
  enum class Told { kOthers, kRoughness, kAll };
  void Differentiate(const Material& material, const Shared& shared, double paths, Told told, const std::string& stage);
  /// Regions' too where the model's own error is not larger than their noise.
  ResidualChi2 LeftOf(const WalkComparison& c) const;
  void ForgetSlopesFarAway();
  void AddSlopes(const Material& material, const Shared& shared, double paths, const std::string& stage);
  static std::vector<RowsOfSlopes::Run> RunsOf(const std::list<SlopesFound>& found);

  const FitProblem& problem_;
  CrownInput& input_;
  FitState& at_;
  const WalkUnknowns& unknowns_;
  Progress& progress_;
  Bodies bodies_;
  std::vector<DerivativeParameter> differenced_;     ///< all but roughness
  std::vector<std::vector<Spectrum>> stated_noise_;  ///< standard deviations, per photograph of the fit and pixel
  std::vector<std::list<SlopesFound>> derivatives_;  ///< per photograph of the fit, latest first
  Eigen::VectorXd stddevs_;                          ///< of the material's entries; empty: not known
  double rays_of_a_path_ = kRaysOfSearch;
  std::vector<PathPhotograph> pictures_;  ///< the last walks' values, per photograph of the fit
  Walks walks_ = Walks::kToTheirEnd;
  uint64_t run_ = 0;
};

}  // namespace crownfit
