#include "dental/flat_prediction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/text.h"
#include "dental/translucency.h"
#include "optics/aperture.h"
#include "optics/fresnel_moments.h"
#include "photo/colour_difference.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

/// Total thicknesses at which stump and target are compared; between them ln CIEDE2000 is nearly linear.
constexpr std::array<double, 12> kMaskingSteps_mm{0.25, 0.5, 0.75, 1.0, 1.25, 1.5,
                                                  2.0,  2.5, 3.0,  4.0, 6.0,  kThickest_mm};
constexpr double kTenth_mm = 0.1;
constexpr double kClearCementIor = 1.54;  // over a stump without an index of its own

/// Directions: strongly forward scattering needs the larger number (g 0.96 is 2 % off with the smaller). The error
/// nearly cancels in differences between draws. An aperture's loss is known to per cents only.
constexpr AddingDoublingOptions kFine{48}, kCoarse{12};

/// Instrument readings of a slab at several thicknesses, with one solution per wave of the aperture. Of the modelled
/// loss past the aperture's edge, the fraction `edge_loss_error` is not lost.
class Views {
 public:
  Views(const FlatQuestion& q, const Slab& slab, const std::vector<std::vector<double>>& thicknesses_mm,
        double edge_loss_error, const AddingDoublingOptions& directions)
      : edge_loss_error_(edge_loss_error), wide_(ViewSlab(slab, thicknesses_mm, q.geometry, directions)) {
    if (!q.aperture_mm) return;
    waves_ = ApertureWaves(*q.aperture_mm);
    for (const ApertureWave& wave : waves_)
      of_wave_.push_back(ViewSlab(UnderWave(slab, wave.wave_number_per_mm), thicknesses_mm, q.geometry, kCoarse));
  }
  double Over(size_t thickness, double backing) const {
    const double wide = wide_[thickness].Over(backing);
    if (waves_.empty()) return wide;
    double seen = 0;
    for (size_t i = 0; i < waves_.size(); ++i) seen += waves_[i].weight * of_wave_[i][thickness].Over(backing);
    // Corrects the loss by its error to first order; never negative, even where nearly all is lost.
    return seen > 0 ? std::min(wide, seen * std::exp(edge_loss_error_ * (wide - seen) / seen)) : seen;
  }
  /// Uniformly lit, without edge loss.
  const ViewedSlab& Wide(size_t thickness) const { return wide_[thickness]; }

 private:
  double edge_loss_error_;
  std::vector<ViewedSlab> wide_;
  std::vector<ApertureWave> waves_;
  std::vector<std::vector<ViewedSlab>> of_wave_;
};

/// Reflectance of what lies behind a surface that is seen in air, without its specular reflection (Saunderson 1942; his
/// factor for entry and exit is 1 within 1 % at 45/0 and n = 1.5, and white stays white).
double BehindSurface(double reflectance, double ior) {
  const double inside = ior > 1.0 ? MomentsOf(ior).diffuse_inside : 0.0;
  return reflectance / (1.0 - inside + inside * reflectance);
}

std::vector<double> Scaled(std::vector<double> mm, double total) {
  const double sum = std::accumulate(mm.begin(), mm.end(), 0.0);
  for (double& v : mm) v *= total / sum;
  return mm;
}

class Group {
 public:
  /// `channels`: their names.
  Group(std::string name, std::vector<double> mm, const std::vector<std::string>& channels)
      : group_{std::move(name), std::move(mm), {}}, channels_(channels) {}
  void Add(const std::string& name, double value, const std::string& unit = "1") {
    group_.figures.push_back({name, unit, value, {}, {}, {}});
  }
  void AddBands(const std::string& name, const Spectrum& v, const std::string& unit = "1") {
    for (int c = 0; c < v.size(); ++c) Add(name + "_" + channels_[static_cast<size_t>(c)], v[c], unit);
  }
  void AddRgb(const std::string& name, const glm::dvec3& rgb) {
    for (int c = 0; c < 3; ++c) Add(name + "_" + "RGB"[c], rgb[c]);
  }
  void AddColour(const std::string& over, const glm::dvec3& rgb) {
    const glm::dvec3 lab = LabFromLinearRgb(rgb);
    for (int c = 0; c < 3; ++c) Add(over + "." + "Lab"[c], lab[c]);
    AddRgb(over + ".linear", rgb);
    AddRgb(over + ".srgb", {SrgbFromLinear(rgb.x), SrgbFromLinear(rgb.y), SrgbFromLinear(rgb.z)});
  }
  FlatGroup Take() { return std::move(group_); }

 private:
  FlatGroup group_;
  const std::vector<std::string>& channels_;
};

/// The thickness from which a falling curve of ln CIEDE2000 stays below a threshold; infinite: not up to kThickest_mm.
double MaskedFrom(const std::vector<double>& de00, double threshold) {
  for (size_t i = de00.size(); i-- > 0;) {
    if (de00[i] <= threshold) continue;
    if (i + 1 == de00.size()) return HUGE_VAL;
    const double high = std::log(de00[i]), low = std::log(std::max(1e-9, de00[i + 1]));
    const double share = (high - std::log(threshold)) / (high - low);
    return kMaskingSteps_mm[i] + share * (kMaskingSteps_mm[i + 1] - kMaskingSteps_mm[i]);
  }
  return kMaskingSteps_mm[0];
}

/// All figures for one set of values.
std::vector<FlatGroup> Evaluate(const FlatQuestion& q, const Material& material, const Material* cement,
                                double edge_loss_error, const AddingDoublingOptions& directions) {
  std::vector<std::vector<double>> thicknesses{q.design_mm};
  for (const double total : q.other_totals_mm) thicknesses.push_back(Scaled(q.design_mm, total));
  const size_t groups = thicknesses.size();
  std::vector<std::vector<double>> of_cemented = thicknesses;
  const double design = std::accumulate(q.design_mm.begin(), q.design_mm.end(), 0.0);
  of_cemented.push_back(Scaled(q.design_mm, design - std::min(kTenth_mm, 0.5 * design)));
  for (const double total : kMaskingSteps_mm) of_cemented.push_back(Scaled(q.design_mm, total));
  if (cement)
    for (auto& mm : of_cemented) mm.push_back(q.cement_mm);

  const Spectrum none(material.channels(), 0.0);
  std::vector<std::array<Spectrum, 2>> over_card(groups, {none, none});         // black, white
  std::vector<std::array<Spectrum, 2>> over(of_cemented.size(), {none, none});  // stump, target
  std::vector<Spectrum> reflectance(groups, none), transmittance(groups, none);
  for (int c = 0; c < none.size(); ++c) {
    Slab slab = SlabOf(material, c);
    const Views dry(q, slab, thicknesses, edge_loss_error, directions);
    for (size_t t = 0; t < groups; ++t) {
      over_card[t][0][c] = dry.Over(t, q.black[c]);
      over_card[t][1][c] = dry.Over(t, q.white[c]);
      reflectance[t][c] = dry.Wide(t).reflectance;
      transmittance[t][c] = dry.Wide(t).transmittance;
    }
    double stump = q.stump[c], target = q.target[c];
    if (q.is_cemented) {
      stump = BehindSurface(stump, q.stump_ior), target = BehindSurface(target, q.stump_ior);
      slab.ior_below = cement              ? cement->layers[0][Quantity::kIor][c]
                       : q.stump_ior > 1.0 ? q.stump_ior
                                           : kClearCementIor;
      if (cement) slab.layers.push_back(SlabOf(*cement, c).layers[0]);
    }
    const Views wet(q, slab, of_cemented, edge_loss_error, directions);
    for (size_t t = 0; t < of_cemented.size(); ++t) {
      over[t][0][c] = wet.Over(t, stump);
      over[t][1][c] = wet.Over(t, target);
    }
  }

  const auto lab = [&](const Spectrum& bands) { return LabFromLinearRgb(q.colour.LinearRgb(bands)); };
  std::vector<double> masking;
  for (size_t i = groups + 1; i < over.size(); ++i) masking.push_back(Ciede2000(lab(over[i][0]), lab(over[i][1])));
  std::vector<FlatGroup> answer;
  for (size_t t = 0; t < groups; ++t) {
    Group g(t == 0 ? "design" : Printed("at_%.2f_mm", q.other_totals_mm[t - 1]), thicknesses[t], q.channel_names);
    const glm::dvec3 black = q.colour.LinearRgb(over_card[t][0]), white = q.colour.LinearRgb(over_card[t][1]);
    g.AddColour("over_black", black);
    g.AddColour("over_white", white);
    g.AddColour("over_stump", q.colour.LinearRgb(over[t][0]));
    const Translucency translucency = TranslucencyOf(black, white);
    g.Add("tp00", translucency.tp00, "dE00");
    g.Add("tp_ab", translucency.tp_ab, "dEab");
    g.Add("contrast_ratio", translucency.contrast_ratio);
    g.Add("stump_shows", Ciede2000(lab(over[t][0]), lab(over[t][1])), "dE00");
    g.AddBands("reflectance", reflectance[t]);
    g.AddBands("transmittance", transmittance[t]);
    const double total = std::accumulate(thicknesses[t].begin(), thicknesses[t].end(), 0.0);
    Spectrum k = none, s = none;
    for (int c = 0; c < none.size(); ++c) {
      const KubelkaMunk km =
          KubelkaMunkFromCards(over_card[t][0][c], over_card[t][1][c], q.black[c], q.white[c], total);
      k[c] = km.absorption_per_mm, s[c] = km.scattering_per_mm;
    }
    g.AddBands("kubelka_munk_k", k, "1/mm");
    g.AddBands("kubelka_munk_s", s, "1/mm");
    if (t == 0) {
      g.Add("change_of_0.1_mm_less", Ciede2000(lab(over[groups][0]), lab(over[0][0])), "dE00");
      g.Add("masked_from_pt", MaskedFrom(masking, kPerceptible), "mm");
      g.Add("masked_from_at", MaskedFrom(masking, kAcceptable), "mm");
    }
    answer.push_back(g.Take());
  }
  return answer;
}

/// Draws values from the fit's joint distribution. In a file without one, each value is drawn independently from its
/// standard deviation, in ln where the fit moves in ln, no wider than the bounds.
Material Drawn(const MaterialRecord& record, uint64_t key) {
  if (record.joint) return Drawn(*record.joint, record.material, key);
  Material material = record.material;
  for (size_t l = 0; l < material.layers.size(); ++l)
    for (size_t i = 0; i < kParameters.size(); ++i) {
      const ParameterRow& row = kParameters[i];
      const ParameterRecord& p = record.layers[l][i];
      if (row.quantity == Quantity::kThickness || row.quantity == Quantity::kThicknessScale) continue;
      for (int c = 0; c < material.channels() && !p.stddev.empty(); ++c) {
        const size_t entry = p.stddev.size() == 1 ? 0 : static_cast<size_t>(c);
        const double step = Gaussian(Key(key, l, i), entry), sd = p.stddev[entry].value_or(HUGE_VAL);
        double& value = material.layers[l].values[i][c];
        const double mean = value;
        if (row.scale == Scale::kLog) {
          const double widest = 0.25 * std::log(row.high / row.low);
          value *= std::exp(step * std::min(sd / value, widest));
        } else {
          value += step * std::min(sd, 0.25 * (row.high - row.low));
        }
        value = std::clamp(value, std::min(row.low, mean), std::max(row.high, mean));
      }
    }
  return material;
}

}  // namespace

const FlatFigure& FlatGroup::operator[](const std::string& figure) const {
  const auto at = std::find_if(figures.begin(), figures.end(), [&](const FlatFigure& f) { return f.name == figure; });
  Check(at != figures.end(), "a figure of this name");
  return *at;
}

bool IsUncertain(const MaterialRecord& record) {
  if (record.joint) return !record.joint->entries.empty();
  for (const auto& layer : record.layers)
    for (const ParameterRecord& p : layer)
      if (!p.stddev.empty()) return true;
  return false;
}

FlatPrediction PredictFlat(const FlatQuestion& q, const std::function<void(double)>& progress) {
  FlatPrediction p;
  const auto lab_of = [](const FlatGroup& g) {
    return glm::dvec3(g["over_stump.L"].value, g["over_stump.a"].value, g["over_stump.b"].value);
  };
  const Material* cement_stated = q.cement ? &q.cement->material : nullptr;
  p.groups = Evaluate(q, q.material.material, cement_stated, 0.0, kFine);
  p.lab = lab_of(p.groups[0]);
  if (!IsUncertain(q.material) && !(q.cement && IsUncertain(*q.cement)) && !q.aperture_mm) return p;

  const std::vector<FlatGroup> coarse = Evaluate(q, q.material.material, cement_stated, 0.0, kCoarse);
  std::vector<std::vector<FlatGroup>> draws(q.draws);
  constexpr size_t kAtOnce = 32;
  for (size_t begin = 0; begin < draws.size(); begin += kAtOnce) {
    progress(static_cast<double>(begin) / static_cast<double>(draws.size()));
    ParallelFor(std::min(kAtOnce, draws.size() - begin), q.threads, [&](size_t i) {
      const uint64_t key = Key(q.seed, 0x70726564696374ull, begin + i);
      const Material material = Drawn(q.material, key);
      std::optional<Material> cement;
      if (q.cement) cement = Drawn(*q.cement, Key(key, 1));
      draws[begin + i] =
          Evaluate(q, material, cement ? &*cement : nullptr, kEdgeLossError * Gaussian(Key(key, 2), 0), kCoarse);
      for (size_t g = 0; g < coarse.size(); ++g)
        for (size_t f = 0; f < coarse[g].figures.size(); ++f) {
          const double off = p.groups[g].figures[f].value - coarse[g].figures[f].value;
          if (std::isfinite(off)) draws[begin + i][g].figures[f].value += off;
        }
    });
  }
  for (const auto& d : draws) p.lab_of_draws.push_back(lab_of(d[0]));
  for (size_t g = 0; g < p.groups.size(); ++g)
    for (size_t f = 0; f < p.groups[g].figures.size(); ++f) {
      std::vector<double> values;
      for (const auto& d : draws) values.push_back(d[g].figures[f].value);
      FlatFigure& figure = p.groups[g].figures[f];
      if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
        figure.stddev = figure.low95 = figure.high95 = NAN;  // some draws have no such figure
        continue;
      }
      std::sort(values.begin(), values.end());
      double mean = 0, square = 0;
      for (const double v : values) mean += v / static_cast<double>(values.size());
      for (const double v : values) square += (v - mean) * (v - mean) / static_cast<double>(values.size() - 1);
      const auto quantile = [&](double share) {
        return values[static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
      };
      figure.stddev = std::sqrt(square);
      figure.low95 = quantile(0.025);
      figure.high95 = quantile(0.975);
    }
  return p;
}

}  // namespace crownfit
