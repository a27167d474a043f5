#include "fit_together.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "fit/judge.h"
#include "scene/scene_parts.h"

namespace crownfit {
namespace {

bool IsShared(size_t layer, Quantity q) {
  return layer != kSurfaceOwner && q != Quantity::kThickness && q != Quantity::kThicknessScale &&
         q != Quantity::kNeckReturn;
}

std::vector<std::string> SharedNames(const std::vector<FreeEntry>& entries) {
  std::vector<std::string> names;
  for (const FreeEntry& e : entries)
    if (IsShared(e.layer, e.quantity)) names.push_back(e.name);
  return names;
}

std::string NameOf(const Capture& capture) { return std::filesystem::weakly_canonical(capture.folder).filename(); }

/// The folders' names, numbered where two are the same.
std::vector<std::string> NamesOf(const std::vector<Capture>& captures) {
  std::vector<std::string> names;
  for (const Capture& c : captures) {
    std::string name = NameOf(c);
    for (int i = 2; std::count(names.begin(), names.end(), name); ++i) name = NameOf(c) + "_" + std::to_string(i);
    names.push_back(name);
  }
  return names;
}

/// Layers of the same name must be stated alike: the same parameters are free, and fixed ones have the same value.
void CheckSameMaterial(const Capture& first, const Capture& other) {
  const auto refuse = [&](const std::string& key, const std::string& what) {
    throw InputError(other.file, key, what + " " + first.file.string(),
                     "Captures that are fitted together must state the material that they share in the same way.");
  };
  if (first.channel_names != other.channel_names || first.wavelengths_nm != other.wavelengths_nm)
    refuse("channels", "the channels differ from those in");
  for (const LayerSpec& a : first.layers)
    for (const LayerSpec& b : other.layers)
      for (size_t i = 0; a.name == b.name && i < kParameters.size(); ++i) {
        const ParameterRow& row = kParameters[i];
        if (row.owner != Owner::kLayer || !IsShared(0, row.quantity)) continue;
        const ParameterSpec &p = a.parameters[i], &q = b.parameters[i];
        const std::string key = "layers." + b.name + "." + row.key;
        if (p.fixed != q.fixed) refuse(key, std::string("is ") + (q.fixed ? "fixed" : "free") + ", unlike in");
        if (p.fixed && p.value != q.value) refuse(key, "is fixed to another value than in");
        if (p.sharing != q.sharing) refuse(key, "is shared between channels in another way than in");
      }
}

void CheckSharesALayer(const std::vector<Capture>& captures, size_t i) {
  for (size_t j = 0; j < captures.size(); ++j)
    for (const LayerSpec& a : captures[i].layers)
      for (const LayerSpec& b : captures[j].layers)
        if (j != i && a.name == b.name) return;
  throw InputError(captures[i].file, "object.layers", "shares no layer with the other captures",
                   "Give layers of one material the same name in all captures, or fit this capture by itself.");
}

/// A photograph in two captures would count twice.
void CheckNoPhotographTwice(const std::vector<Capture>& captures) {
  std::map<std::string, std::string> seen;
  for (const Capture& capture : captures)
    for (const PhotographSpec& p : capture.photographs) {
      if (p.is_holdout) continue;
      const auto [at, is_new] = seen.emplace(Sha256OfFile(p.files.image), p.files.image.string());
      if (!is_new)
        throw InputError(p.files.image, "", "is the same picture as " + at->second,
                         "It would count twice. Photograph the object again for the second capture.");
    }
}

/// Readings must not count twice either.
void CheckNoReadingTwice(const std::vector<Capture>& captures) {
  const auto are_same = [](const std::optional<Reading>& a, const std::optional<Reading>& b) {
    return a.has_value() == b.has_value() && (!a || (a->value == b->value && a->stddev == b->stddev));
  };
  for (size_t i = 0; i < captures.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      for (const FlatMeasurement& m : captures[i].measurements)
        for (const FlatMeasurement& n : captures[j].measurements)
          if (!m.is_holdout && !n.is_holdout && m.thickness_mm == n.thickness_mm && m.geometry == n.geometry &&
              are_same(m.reflectance, n.reflectance) && are_same(m.transmittance, n.transmittance) &&
              are_same(m.lab, n.lab))
            throw InputError(
                captures[i].file, "measurements",
                "'" + m.name + "' has the same readings as '" + n.name + "' in " + captures[j].file.string(),
                "They would count twice. Measure the sample again for the second capture.");
}

/// Whether a fitted photograph has a part of the scene that is to be left out; any capture may have unneeded parts.
bool Has(const Capture& capture, const std::string& name) {
  const std::vector<ScenePart> parts = PartsOf(capture);
  const ScenePart* part = PartNamed(name, parts);
  return std::any_of(capture.photographs.begin(), capture.photographs.end(), [&](PhotographSpec p) {
    return !p.is_holdout && (name == "unneeded" || (part && part->leave_out(p)));
  });
}

/// Checked before minutes of computation.
void CheckPartsToLeaveOut(const std::vector<Capture>& captures, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    if (std::none_of(captures.begin(), captures.end(), [&](const Capture& c) { return Has(c, part); }))
      throw InputError(captures[0].file, "--leave-out", "no capture has the part " + part,
                       "Name parts as in light:left or tile:black; `crownfit check` lists those of a capture.");
}

class Together {
 public:
  Together(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress)
      : captures_(captures), names_(NamesOf(captures)), options_(options), progress_(progress) {
    options_.advises = false;  // one capture may have the photograph that another lacks
  }

  std::vector<CrownFit> Run() {
    for (size_t i = 0; i < captures_.size(); ++i) {
      fits_.push_back(Fit(i, {}));
      inflation_alone_.push_back(fits_[i].knowledge.inflation);
    }
    if (options_.model == Model::kAuto) {  // if one capture needs random walks, all get them
      const auto by_path =
          std::find_if(fits_.begin(), fits_.end(), [](const CrownFit& f) { return f.model == Model::kPath; });
      options_.model = by_path == fits_.end() ? Model::kShader : Model::kPath;
      options_.model_choice = (by_path == fits_.end() ? fits_[0] : *by_path).model_choice;
    }
    constexpr int kMostRounds = 4;
    bool settled = false;
    for (int round = 0; round < kMostRounds && !settled; ++round) {
      settled = true;
      for (size_t i = 0; i < fits_.size(); ++i) {
        const Eigen::VectorXd start = Start(i);
        const Eigen::VectorXd before = fits_[i].best;
        CrownFit together = Fit(i, {KnownByOthers(i), start});
        // Shared scattering was tested for each capture alone, with the model of its own fit.
        if (together.model == fits_[i].model) together.departures = fits_[i].departures;
        fits_[i] = std::move(together);
        settled &= HasSettled(i, round == 0 ? start : before);
      }
    }
    Compare();
    for (size_t i = 0; i < fits_.size(); ++i) Settle(i, settled);
    return std::move(fits_);
  }

 private:
  CrownFit Fit(size_t i, const KnownBeside& beside) {
    progress_.NameWork(names_[i]);
    FitOptions options = options_;
    if (captures_[i].photographs.empty()) options.model = Model::kAuto;  // readings of flat samples
    std::erase_if(options.leave_out, [&](const std::string& name) { return !Has(captures_[i], name); });
    CrownFit fit = FitCrown(captures_[i], options, progress_, beside);
    progress_.NameWork("");
    return fit;
  }

  GaussianInformation Known(size_t i) const { return fits_[i].knowledge.Of(fits_[i].entries); }

  /// Information from readings, without the inflation by the pull of other captures. Intervals include that inflation;
  /// a comparison must not.
  GaussianInformation KnownUnpulled(size_t i) const {
    GaussianInformation known = Known(i);
    if (fits_[i].model != Model::kLayered) return known;
    const double pulled = std::max(1.0, fits_[i].knowledge.inflation / inflation_alone_[i]);
    known.precision *= pulled;
    known.weighted_mean *= pulled;
    return known;
  }

  GaussianInformation ByOthers(size_t i, GaussianInformation (Together::*of)(size_t) const) const {
    GaussianInformation known = NothingOf(crownfit::NamesOf(fits_[i].entries));
    for (size_t j = 0; j < fits_.size(); ++j)
      if (j != i) Add(known, Marginal((this->*of)(j), SharedNames(fits_[j].entries)));
    return known;
  }
  GaussianInformation KnownByOthers(size_t i) const { return ByOthers(i, &Together::Known); }

  /// A capture's entries at the optimum of all photographs together.
  Eigen::VectorXd Start(size_t i) const {
    GaussianInformation all = KnownByOthers(i);
    Add(all, Known(i));
    if (options_.use_priors)
      for (size_t k = 0; k < fits_[i].entries.size(); ++k) {
        const FreeEntry& e = fits_[i].entries[k];
        const auto at = static_cast<Eigen::Index>(k);
        all.precision(at, at) += 1.0 / (e.prior_stddev * e.prior_stddev);
        all.weighted_mean[at] += e.prior_mean / (e.prior_stddev * e.prior_stddev);
      }
    Eigen::VectorXd x = MeanOf(all, fits_[i].best);
    for (size_t k = 0; k < fits_[i].entries.size(); ++k)
      x[static_cast<Eigen::Index>(k)] =
          std::clamp(x[static_cast<Eigen::Index>(k)], fits_[i].entries[k].low, fits_[i].entries[k].high);
    return x;
  }

  bool HasSettled(size_t i, const Eigen::VectorXd& before) const {
    constexpr double kSettled = 1.0 / 3.0;  // of a standard deviation
    const Eigen::VectorXd stddev = fits_[i].uncertainty.covariance.diagonal().cwiseSqrt();
    return ((fits_[i].best - before).cwiseAbs().array() <= kSettled * stddev.array()).all();
  }

  /// For every capture compares the information of its own photographs on shared entries with that of all others. Both
  /// are taken around the joint optimum: alone, a capture may have ended at a bound, where photographs say little.
  void Compare() {
    for (size_t i = 0; i < fits_.size(); ++i) {
      const std::vector<std::string> names = SharedNames(fits_[i].entries);
      const Disagreement apart =
          Compared(Marginal(KnownUnpulled(i), names), Marginal(ByOthers(i, &Together::KnownUnpulled), names));
      if (apart.chi2 < UnlikelyChi2(apart.freedom)) continue;
      const FreeEntry& e = *std::find_if(fits_[i].entries.begin(), fits_[i].entries.end(),
                                         [&](const FreeEntry& entry) { return entry.name == apart.name; });
      const auto value = [&](double v) { return e.scale == Scale::kLog ? std::exp(v) : v; };
      contradictions_.push_back(
          {FindingKind::kCapturesDisagree,
           {apart.chi2, static_cast<double>(apart.freedom), value(apart.here), value(apart.there)},
           {names_[i], apart.name}});
    }
  }

  /// Moves the capture to the joint optimum; its own last fit differs from it by Monte Carlo noise.
  void Settle(size_t i, bool settled) {
    CrownFit& fit = fits_[i];
    const Eigen::VectorXd x = Start(i);
    FreeParameters free = FreeParametersOf(fit.capture);
    free.entries = fit.entries;  // with priors from a file
    fit.best = x;
    fit.material = MaterialAt(free, x);
    fit.uncertainty = Quantify(fit.capture, free, x, fit.knowledge.With(KnownByOthers(i)), options_.use_priors);
    fit.converged &= settled;
    fit.caveats.insert(fit.caveats.begin(), contradictions_.begin(), contradictions_.end());
    Judge(fit);
  }

  const std::vector<Capture>& captures_;
  std::vector<std::string> names_;
  FitOptions options_;
  Progress& progress_;
  std::vector<CrownFit> fits_;
  std::vector<double> inflation_alone_;
  std::vector<Finding> contradictions_;
};

/// Parameters of a capture that `joint` does not list.
std::vector<FittedParameter> OwnParameters(const CrownFit& fit, const Capture& joint) {
  const auto is_listed = [&](size_t layer) {
    return std::any_of(joint.layers.begin(), joint.layers.end(),
                       [&](const LayerSpec& l) { return l.name == fit.capture.layers[layer].name; });
  };
  std::vector<FittedParameter> own;
  for (const FittedParameter& p : fit.uncertainty.parameters)
    if (p.status != Status::kFixed && !(IsShared(p.layer, p.quantity) && is_listed(p.layer))) own.push_back(p);
  return own;
}

}  // namespace

std::vector<CrownFit> FitTogether(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress) {
  if (captures.size() == 1) return {FitCrown(captures[0], options, progress)};
  for (size_t i = 0; i < captures.size(); ++i)
    for (size_t j = 0; j < i; ++j) CheckSameMaterial(captures[j], captures[i]);
  for (size_t i = 0; i < captures.size(); ++i) CheckSharesALayer(captures, i);
  CheckPartsToLeaveOut(captures, options.leave_out);
  CheckNoPhotographTwice(captures);
  CheckNoReadingTwice(captures);
  return Together(captures, options, progress).Run();
}

CrownFit Joined(const std::vector<CrownFit>& fits) {
  if (fits.size() == 1) return fits[0];
  // All photographs were fitted with one model; captures of readings alone use another.
  const auto first =
      std::find_if(fits.begin(), fits.end(), [](const CrownFit& f) { return f.model != Model::kLayered; });
  CrownFit all = first == fits.end() ? fits[0] : *first;
  all.photographs.clear();
  all.readings.clear();
  all.scenery.clear();
  all.departures.clear();
  all.caveats.clear();
  all.messages.clear();
  all.uncertainty.block_chi2 = 0;
  all.walked_paths = 0, all.fitted_pixels = 0, all.iterations = 0, all.casts = 0;
  std::vector<Capture> captures;
  for (const CrownFit& f : fits) captures.push_back(f.capture);
  const std::vector<std::string> names = NamesOf(captures);
  std::vector<Finding> refused;
  for (size_t i = 0; i < fits.size(); ++i) {
    const CrownFit& f = fits[i];
    if (!f.usable) refused.push_back({FindingKind::kCaptureNotUsable, {}, {names[i]}});
    all.together.push_back({names[i], OwnParameters(f, all.capture), f.uncertainty.block_chi2, f.usable});
    for (PhotographResult p : f.photographs) {
      p.name = names[i] + "_" + p.name;
      all.photographs.push_back(std::move(p));
    }
    for (SceneryLevel level : f.scenery) {
      level.photograph = names[i] + "_" + level.photograph;
      all.scenery.push_back(std::move(level));
    }
    for (ReadingResult r : f.readings) {
      r.measurement = names[i] + "_" + r.measurement;
      all.readings.push_back(std::move(r));
    }
    for (const Finding& caveat : f.caveats)
      if (!std::count(all.caveats.begin(), all.caveats.end(), caveat)) all.caveats.push_back(caveat);
    all.messages.insert(all.messages.end(), f.messages.begin(), f.messages.end());
    all.converged &= f.converged;
    all.uncertainty.reduced_chi2 = std::max(all.uncertainty.reduced_chi2, f.uncertainty.reduced_chi2);
    all.uncertainty.block_chi2 = std::max(all.uncertainty.block_chi2, f.uncertainty.block_chi2);
    if (f.residual_chi2.regions.IsMoreThan(kChi2Limit)) all.residual_chi2 = f.residual_chi2;
    all.walked_paths += f.walked_paths;
    all.fitted_pixels += f.fitted_pixels;
    all.iterations += f.iterations;
    all.casts += f.casts;
    if (all.advice.empty()) all.advice = f.advice;
  }
  Judge(all);
  if (all.usable) Judge(all, refused);  // a refusal of one capture refuses all
  return all;
}

}  // namespace crownfit
