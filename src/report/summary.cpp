#include "report/summary.h"

#include "base/text.h"
#include "fit/fit_result.h"
#include "report/finding_words.h"
#include "report/plain_words.h"

namespace crownfit {

std::string Summary(const CrownFit& fit) {
  std::string text;
  const auto add = [&](const char* format, auto... values) { text += Printed(format, values...); };
  text += std::string("Status: ") + (fit.usable ? "usable" : "NOT USABLE") + "\n";
  for (const auto& reason : InWords(fit.reasons)) text += "  because: " + reason + "\n";
  text += VerdictInWords(fit) + "\n";
  for (const auto& exchange : ExchangesInWords(fit)) text += exchange + "\n";
  if (!fit.advice.empty()) text += fit.advice + ".\n";
  text += "\n";
  add("%-38s %-7s %10s  %-24s %s\n", "parameter", "channel", "value", "95 % interval", "status");
  for (const auto& p : fit.uncertainty.parameters) {
    if (p.stddev.empty()) continue;
    for (size_t i = 0; i < p.value.size(); ++i) {
      add("%-38s %-7s %10.4g  %-24s %s\n", i == 0 ? p.name.c_str() : "",
          p.value.size() == 1 ? "all" : fit.capture.channel_names[i].c_str(), p.value[i],
          Printed("[%.4g, %.4g]", p.low95[i], p.high95[i]).c_str(),
          i == 0 || p.Of(i) != p.Of(i - 1) ? Word(p.Of(i)) : "");
    }
  }
  for (const TogetherWith& t : fit.together)
    for (const auto& p : t.its_own)
      add("%-38s %-7s %10.4g  [%.4g, %.4g] %s\n", (t.name + ": " + p.name).c_str(), "all", p.value[0], p.low95[0],
          p.high95[0], Word(p.status));
  if (!fit.readings.empty())
    add("\n%-24s %-14s %26s  %26s  %s\n", "measurement", "quantity", "reading", "predicted", "difference in stddevs");
  for (const ReadingResult& r : fit.readings) {
    add("%-24s %-14s", r.measurement.c_str(), r.quantity.c_str());
    for (const Spectrum* values : {&r.read.value, &r.predicted}) {
      for (const double v : *values) add(" %8.4g", v);
      text += " ";
    }
    for (int c = 0; c < r.predicted.size(); ++c) add(" %+.1f", (r.predicted[c] - r.read.value[c]) / r.read.stddev[c]);
    text += r.is_holdout ? "  held out\n" : "\n";
  }
  if (!fit.photographs.empty())
    add("\n%-24s %8s %8s %12s %12s %8s\n", "photograph", "median", "95 %", "not seen", "acceptable", "chi2");
  for (const auto& p : fit.photographs)
    add("%-24s %8.2f %8.2f %10.0f %% %10.0f %% %8.2f%s\n", p.name.c_str(), p.difference.median, p.difference.p95,
        100 * p.difference.share_below_pt, 100 * p.difference.share_below_at, p.reduced_chi2,
        p.is_holdout ? "  held out" : "");
  if (!fit.photographs.empty())
    add("CIEDE2000 over blocks of 8 x 8 pixels. Not seen: at most 0.8. Acceptable: at most 1.8.%s\n",
        fit.is_by_walks() ? " It includes the noise of photographs and predictions." : "");
  text += "\nModel: " + std::string(Word(fit.model)) + " (" + fit.model_choice + ").\n";
  for (const auto& caveat : InWords(fit.caveats)) text += "Note: " + caveat + "\n";
  return text;
}

}  // namespace crownfit
