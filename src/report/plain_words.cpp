#include "report/plain_words.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "base/text.h"
#include "capture/capture.h"
#include "report/finding_words.h"

namespace crownfit {
namespace {

/// "enamel.reduced_scattering_per_mm[B]" in everyday words.
std::string PlainName(std::string name) {
  for (const auto& [from, to] : {std::pair{".", " "}, {"_per_mm", ""}, {"_mm", ""}, {"[", " "}, {"]", ""}})
    if (const size_t at = name.find(from); at != name.npos) name.replace(at, std::strlen(from), to);
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// A sentence with all names of fitted parameters in everyday words; the longest first, as one may begin another.
std::string InPlainNames(std::string text, const CrownFit& fit) {
  std::vector<std::string> names;
  for (const FreeEntry& e : fit.entries) names.push_back(e.name);
  for (const FittedParameter& p : fit.uncertainty.parameters) names.push_back(p.name);
  std::sort(names.begin(), names.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (const std::string& name : names)
    for (size_t at = text.find(name); at != text.npos; at = text.find(name)) {
      const std::string plain = PlainName(name);
      if (plain == name) break;
      text.replace(at, name.size(), plain);
    }
  return text;
}

/// All blocks of 8 x 8 pixels have equal weight.
std::string PictureSentence(const CrownFit& fit, bool of_holdouts) {
  double blocks = 0, median = 0, unseen = 0, accepted = 0;
  int count = 0;
  for (const PhotographResult& p : fit.photographs) {
    if (p.is_holdout != of_holdouts) continue;
    const double w = static_cast<double>(p.difference.blocks);
    ++count;
    blocks += w;
    median += w * p.difference.median;
    unseen += w * p.difference.share_below_pt;
    accepted += w * p.difference.share_below_at;
  }
  if (blocks == 0) return of_holdouts ? "No photograph was held out, so none checks the fit independently." : "";
  const std::string figures = Printed(
      "CIEDE2000 %.1f in the median. On %.0f %% of the area the difference is too small to be seen (%.1f), on %.0f %% "
      "it is acceptable (%.1f).",
      median / blocks, 100 * unseen / blocks, kPerceptible, 100 * accepted / blocks, kAcceptable);
  const std::string photographs = count == 1 ? "photograph" : Printed("%d photographs", count);
  return "For the " + photographs +
         (of_holdouts ? " held out, which the fit never saw,"
                      : std::string(" that ") + (count == 1 ? "was" : "were") + " fitted") +
         " the prediction is off by " + figures;
}

/// If their stated errors are right, readings are off by about one standard deviation.
std::string ReadingSentence(const CrownFit& fit, bool of_holdouts) {
  int count = 0;
  double squares = 0, largest = 0;
  std::string worst;
  for (const ReadingResult& r : fit.readings) {
    if (r.is_holdout != of_holdouts) continue;
    for (int c = 0; c < r.predicted.size(); ++c, ++count) {
      const double off = std::abs(r.predicted[c] - r.read.value[c]) / r.read.stddev[c];
      squares += off * off;
      if (off >= largest) largest = off, worst = r.measurement;
    }
  }
  if (count == 0) return "";
  return Printed(
             "%d readings of flat samples%s are off by %.1f of their standard deviations (root mean square), %.1f at "
             "most ",
             count, of_holdouts ? " held out, which the fit never saw," : "", std::sqrt(squares / count), largest) +
         "('" + worst + "').";
}

/// Half width of the widest 95 % interval of these channels of a parameter, as a factor.
double Reach(const FittedParameter& p, const std::vector<size_t>& channels) {
  double reach = 1.0;
  for (const size_t i : channels)
    reach = std::max(reach, p.low95[i] > 0 ? std::sqrt(p.high95[i] / p.low95[i]) : HUGE_VAL);
  return reach;
}

/// Name with the channels, unless all have this status; "" where none has it.
std::string NameOf(const CrownFit& fit, const FittedParameter& p, Status status) {
  const std::vector<size_t> channels = p.ChannelsThatAre(status);
  std::string name = channels.empty() ? "" : PlainName(p.name);
  if (channels.size() == p.value.size()) return name;
  for (const size_t c : channels) name += (c == channels[0] ? " " : "/") + fit.capture.channel_names[c];
  return name;
}

void AddHowSure(const CrownFit& fit, std::vector<std::string>& sentences) {
  struct Class {
    double reach;
    const char* words;
    std::vector<std::string> names;
  };
  std::vector<Class> classes{{1.1, "Known within 10 %: ", {}},
                             {1.25, "Known within 25 %: ", {}},
                             {2.0, "Known within a factor of 2: ", {}},
                             {HUGE_VAL, "Known less well than a factor of 2: ", {}}};
  std::vector<std::string> held, unknown, at_bound;
  for (const FittedParameter& p : fit.uncertainty.parameters) {
    const auto add = [&](Status status, std::vector<std::string>& names) {
      if (const std::string name = NameOf(fit, p, status); !name.empty()) names.push_back(name);
    };
    add(Status::kPrior, held);
    add(Status::kNotIdentified, unknown);
    add(Status::kAtBound, at_bound);
    const double reach = Reach(p, p.ChannelsThatAre(Status::kFitted));
    add(Status::kFitted,
        std::find_if(classes.begin(), classes.end(), [&](const Class& c) { return reach <= c.reach; })->names);
  }
  for (const Class& c : classes)
    if (!c.names.empty()) sentences.push_back(c.words + Listed(c.names) + " (95 % intervals, within the model).");
  const std::string source = fit.photographs.empty() ? "measurements" : "photographs";
  if (!unknown.empty()) sentences.push_back("The " + source + " do not determine: " + Listed(unknown) + ".");
  if (!held.empty())
    sentences.push_back("Not measured, but held by their priors (what is usual for the material): " + Listed(held) +
                        ".");
  if (!at_bound.empty()) sentences.push_back("At the end of the allowed range: " + Listed(at_bound) + ".");
}

/// The fit's own advice, and recommendations of docs/photographing.md that this capture lacks, where they would help to
/// determine an open parameter.
std::vector<std::string> Advice(const CrownFit& fit) {
  if (fit.photographs.empty()) return {};
  std::set<Quantity> open;
  for (const FittedParameter& p : fit.uncertainty.parameters)
    if (p.status == Status::kNotIdentified || p.status == Status::kPrior) open.insert(p.quantity);
  const auto is_open = [&](auto... quantities) { return (open.count(quantities) + ...) > 0; };
  std::set<size_t> backings;
  bool has_edge = false, shows_surface = false;
  for (const PhotographSpec& p : fit.capture.photographs) {
    if (p.is_holdout) continue;
    if (p.backing) backings.insert(*p.backing);
    has_edge |= !p.scenery.empty();
    shows_surface |= p.polarisation != Polarisation::kCross;
  }
  std::vector<std::string> advice;
  if (!fit.advice.empty()) advice.push_back(InPlainNames(fit.advice, fit) + ".");
  if (is_open(Quantity::kAbsorption, Quantity::kReducedScattering) && backings.size() < 2)
    advice.push_back("The front on a black and on a white tile, which separates absorption from scattering.");
  if (is_open(Quantity::kThickness, Quantity::kThicknessScale, Quantity::kReducedScattering) && !has_edge)
    advice.push_back(
        "The front with the straight shadow of a blade on it, which is a length scale and separates scattering from "
        "thickness. Better still, measure the thickness.");
  if (is_open(Quantity::kRoughness, Quantity::kWetness) && !shows_surface)
    advice.push_back("The front without polarisers, or with parallel ones, which shows the surface's reflection.");
  if (advice.empty() && !open.empty())
    advice.push_back(
        "No photograph is known to determine the rest. Another thickness of the same material, fitted together, or a "
        "measured flat sample may.");
  return advice;
}

}  // namespace

std::vector<std::string> ExchangesInWords(const CrownFit& fit) {
  constexpr double kClose = 0.95;
  constexpr size_t kMost = 3;
  const Eigen::MatrixXd& c = fit.uncertainty.covariance;
  std::vector<std::pair<double, std::string>> pairs;
  for (Eigen::Index i = 0; i < c.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) {
      const double r = c(i, j) / std::sqrt(c(i, i) * c(j, j));
      if (std::abs(r) > kClose)
        pairs.emplace_back(
            -std::abs(r),
            PlainName(fit.entries[j].name) + " and " + PlainName(fit.entries[i].name) +
                " can be exchanged: " + (r > 0 ? "raising or lowering both" : "raising one and lowering the other") +
                Printed(" fits almost as well (correlation %+.2f).", r));
    }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::string> sentences;
  for (size_t i = 0; i < std::min(kMost, pairs.size()); ++i) sentences.push_back(pairs[i].second);
  return sentences;
}

std::string InWords(const WeakDirection& direction) {
  std::vector<std::string> raised, lowered;
  for (const WeakDirection::Part& p : direction.parts) (p.weight > 0 ? raised : lowered).push_back(PlainName(p.entry));
  return "Raising " + Listed(raised) + (lowered.empty() ? "" : " while lowering " + Listed(lowered)) +
         (std::isfinite(direction.stddev) ? " fits almost as well." : " changes nothing that was measured.");
}

std::vector<std::string> AsVectors(const std::vector<WeakDirection>& directions) {
  std::vector<std::string> vectors;
  for (const WeakDirection& d : directions) {
    std::string text;
    for (const WeakDirection::Part& p : d.parts)
      text += Printed("%+.2f ", p.weight) + (p.scale == Scale::kLog ? "ln " : "") + p.entry + " ";
    vectors.push_back(
        text + (std::isfinite(d.stddev) ? Printed("(standard deviation %.2g)", d.stddev) : "(not determined at all)"));
  }
  return vectors;
}

PlainVerdict PlainVerdictOf(const CrownFit& fit) {
  PlainVerdict verdict;
  verdict.headline = fit.usable ? "Usable." : "Do not use this result.";
  for (const bool of_holdouts : {false, true})
    for (const std::string& s :
         {fit.photographs.empty() ? "" : PictureSentence(fit, of_holdouts), ReadingSentence(fit, of_holdouts)})
      if (!s.empty()) verdict.sentences.push_back(s);
  if (!fit.usable)
    verdict.sentences.push_back(
        "The precision below holds only if the model does; the reasons say why it may not hold here.");
  AddHowSure(fit, verdict.sentences);
  for (std::string& exchange : ExchangesInWords(fit)) verdict.sentences.push_back(std::move(exchange));
  verdict.photographs_that_would_help = Advice(fit);
  return verdict;
}

}  // namespace crownfit
