#include "batch/summary.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/html.h"
#include "base/text.h"

namespace crownfit {
namespace {

constexpr double kAcceptable = 1.8;     // CIEDE2000, Paravina et al. 2015
constexpr double kOutlier = 3.5;        // robust standard deviations, Iglewicz and Hoaglin 1993
constexpr size_t kFewestToCompare = 5;  // crowns of a group; in smaller groups none counts as an outlier

std::string Text(const std::optional<double>& v) { return v ? Number(*v, 6) : ""; }

std::string Hundredths(double v) { return Printed("%.2f", v); }

std::string Hundredths(const std::optional<double>& v) { return v ? Hundredths(*v) : ""; }

std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c == '\n' || c == '\r' ? ' ' : c);
  return quoted + "\"";
}

std::string Joined(const std::vector<std::string>& texts, const char* between) {
  std::string all;
  for (const std::string& t : texts) all += (all.empty() ? "" : between) + t;
  return all;
}

/// Every parameter of any crown, in order of first appearance.
std::vector<std::string> ParameterNames(std::span<const CrownOutcome> crowns) {
  std::vector<std::string> names;
  for (const CrownOutcome& crown : crowns)
    if (crown.record)
      for (const RecordedParameter& p : crown.record->parameters)
        if (std::find(names.begin(), names.end(), p.name) == names.end()) names.push_back(p.name);
  return names;
}

const RecordedParameter* Find(const CrownOutcome& crown, const std::string& name) {
  if (!crown.record) return nullptr;
  for (const RecordedParameter& p : crown.record->parameters)
    if (p.name == name) return &p;
  return nullptr;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

GroupStatistics Of(const std::string& group, const std::string& parameter,
                   const std::vector<const RecordedParameter*>& crowns) {
  GroupStatistics s{group, parameter, crowns.size(), 0, 0, 0, 0, 0};
  double weights = 0, sum = 0, plain = 0, chi2 = 0, squares = 0;
  std::vector<double> values, deviations;
  for (const RecordedParameter* p : crowns) {
    const double weight = 1 / (*p->stddev * *p->stddev);
    weights += weight;
    sum += weight * p->value;
    plain += p->value / static_cast<double>(crowns.size());
    values.push_back(p->value);
  }
  s.mean = sum / weights;
  s.median = Median(values);
  for (const RecordedParameter* p : crowns) {
    chi2 += std::pow((p->value - s.mean) / *p->stddev, 2);
    squares += std::pow(p->value - plain, 2);
    deviations.push_back(std::abs(p->value - s.median));
  }
  s.robust_spread = 1.4826 * Median(deviations);
  const double freedom = static_cast<double>(crowns.size()) - 1;
  if (freedom > 0) s.spread = std::sqrt(squares / freedom);
  // Birge 1932: inflates the error where the crowns differ by more than their intervals.
  s.error_of_mean = std::sqrt(1 / weights) * (freedom > 0 ? std::sqrt(std::max(1.0, chi2 / freedom)) : 1.0);
  return s;
}

constexpr const char* kPage = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>crownfit batch</title>
<style>
body{font:15px/1.4 system-ui,sans-serif;margin:2em;color:#222;background:#fff}
table{border-collapse:collapse;margin:1em 0}th,td{padding:.35em .7em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}
th{position:sticky;top:0;background:#f4f4f4;cursor:pointer;white-space:nowrap}th:focus{outline:2px solid #06c}
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}img{height:64px;display:block}
.good{color:#06652b}.bad{color:#a40000}.flag{background:#fde9c8;border-radius:4px;padding:0 .4em;white-space:nowrap;margin-right:.3em;display:inline-block}
small{color:#555}details{max-width:30em}details summary{cursor:pointer;white-space:nowrap}@media print{th{position:static}body{margin:0}}
</style>
)";

constexpr const char* kSort = R"(<script>
for (const head of document.querySelectorAll('th')) {
  head.tabIndex = 0;
  const sort = () => {
    const body = head.closest('table').tBodies[0], column = head.cellIndex, up = head.dataset.up !== 'true';
    head.dataset.up = up;
    const key = row => row.cells[column].dataset.sort ?? row.cells[column].textContent;
    [...body.rows].sort((a, b) => {
      const x = key(a), y = key(b), n = Number(x) - Number(y);
      return (up ? 1 : -1) * (x === '' ? (y === '' ? 0 : 1) : y === '' ? -1 : isNaN(n) ? x.localeCompare(y) : n);
    }).forEach(row => body.append(row));
  };
  head.addEventListener('click', sort);
  head.addEventListener('keydown', event => { if (event.key === 'Enter') sort(); });
}
</script>
</html>
)";

/// "0.0123 [0.0101, 0.0145]", red where it was not identified.
std::string ParameterCell(const RecordedParameter* p) {
  if (!p) return "<td data-sort=\"\"></td>";
  std::string cell = "<td class=\"n\" data-sort=\"" + Number(p->value, 6) + "\">" + Number(p->value, 4);
  if (p->low && p->high) cell += Printed("<br><small>%.4g to %.4g</small>", *p->low, *p->high);
  if (p->status != "fitted") cell += "<br><small class=\"bad\">" + Html(p->status) + "</small>";
  return cell + "</td>";
}

}  // namespace

std::string StatusOf(const CrownOutcome& crown) {
  switch (crown.state) {
    case CrownState::kFitted:
      return crown.record->status;
    case CrownState::kFaulty:
      return "faulty";
    case CrownState::kFailed:
      return "failed";
    case CrownState::kWaiting:
      break;
  }
  return "waiting";
}

std::vector<GroupStatistics> StatisticsOf(std::span<const CrownOutcome> crowns) {
  std::map<std::string, std::vector<const CrownOutcome*>> groups;
  for (const CrownOutcome& crown : crowns)
    if (crown.usable()) groups[crown.row.group].push_back(&crown);
  const std::vector<std::string> names = ParameterNames(crowns);
  std::vector<GroupStatistics> statistics;
  for (const auto& [group, members] : groups)
    for (const std::string& name : names) {
      std::vector<const RecordedParameter*> fitted;
      for (const CrownOutcome* crown : members)
        if (const RecordedParameter* p = Find(*crown, name); p && p->status == "fitted" && p->stddev.value_or(0) > 0)
          fitted.push_back(p);
      if (!fitted.empty()) statistics.push_back(Of(group, name, fitted));
    }
  return statistics;
}

std::vector<std::vector<std::string>> FlagsOf(std::span<const CrownOutcome> crowns,
                                              std::span<const GroupStatistics> statistics) {
  std::vector<std::vector<std::string>> flags;
  for (const CrownOutcome& crown : crowns) {
    std::vector<std::string>& of_crown = flags.emplace_back();
    if (crown.state != CrownState::kFitted) {
      of_crown.push_back(StatusOf(crown));
      continue;
    }
    if (!crown.usable()) of_crown.push_back("not usable");
    if (crown.record->de00_median.value_or(0.0) > kAcceptable) of_crown.push_back("image error");
    for (const RecordedParameter& p : crown.record->parameters) {
      if (p.status == "at_bound") of_crown.push_back("at bound: " + p.name);
      for (const GroupStatistics& s : statistics) {
        if (s.group != crown.row.group || s.parameter != p.name || s.number < kFewestToCompare || !p.stddev) continue;
        if (std::abs(p.value - s.median) > kOutlier * std::hypot(s.robust_spread, *p.stddev))
          of_crown.push_back("outlier: " + p.name);
      }
    }
  }
  return flags;
}

std::string SummaryCsv(std::span<const CrownOutcome> crowns) {
  const std::vector<std::string> names = ParameterNames(crowns);
  const auto flags = FlagsOf(crowns, StatisticsOf(crowns));
  std::string csv = "id,group,status,flags,reasons,de00_median,de00_p95,holdout_de00_median";
  for (const std::string& n : names)
    for (const char* what : {"", " stddev", " low95", " high95", " status"}) csv += "," + Cell(n + what);
  csv += "\n";
  for (size_t i = 0; i < crowns.size(); ++i) {
    const CrownOutcome& crown = crowns[i];
    const CrownRecord* r = crown.record ? &*crown.record : nullptr;
    csv += Cell(crown.row.id) + "," + Cell(crown.row.group) + "," + StatusOf(crown) + "," +
           Cell(Joined(flags[i], "; ")) + "," + Cell(r ? Joined(r->reasons, "; ") : crown.reason) + "," +
           (r ? Text(r->de00_median) : "") + "," + (r ? Text(r->de00_p95) : "") + "," +
           (r ? Text(r->holdout_de00_median) : "");
    for (const std::string& name : names) {
      const RecordedParameter* p = Find(crown, name);
      csv +=
          "," + (p ? Text(p->value) + "," + Text(p->stddev) + "," + Text(p->low) + "," + Text(p->high) + "," + p->status
                   : ",,,,");
    }
    csv += "\n";
  }
  return csv;
}

std::string StatisticsCsv(std::span<const GroupStatistics> statistics) {
  std::string csv = "group,parameter,number,mean,error_of_mean,spread,median,robust_spread\n";
  for (const GroupStatistics& s : statistics)
    csv += Cell(s.group) + "," + Cell(s.parameter) + "," + std::to_string(s.number) + "," + Text(s.mean) + "," +
           Text(s.error_of_mean) + "," + Text(s.spread) + "," + Text(s.median) + "," + Text(s.robust_spread) + "\n";
  return csv;
}

std::string TimesCsv(std::span<const CrownOutcome> crowns) {
  std::string csv = "id,wall_s,peak_memory_MiB\n";
  for (const CrownOutcome& crown : crowns)
    if (crown.record)
      csv += Cell(crown.row.id) + "," + Text(crown.record->wall_s) + "," + Text(crown.record->peak_MiB) + "\n";
  return csv;
}

std::string SummaryHtml(std::span<const CrownOutcome> crowns) {
  const std::vector<std::string> names = ParameterNames(crowns);
  const std::vector<GroupStatistics> statistics = StatisticsOf(crowns);
  const auto flags = FlagsOf(crowns, statistics);
  const auto usable = std::count_if(crowns.begin(), crowns.end(), [](const auto& c) { return c.usable(); });
  std::string html = kPage;
  html += "<h1>" + std::to_string(crowns.size()) + " crowns, " + std::to_string(usable) + " usable</h1>\n";
  html += "<p>Click a heading to sort. Flags: image error: median CIEDE2000 above " + Text(kAcceptable) +
          "; outlier: more than " + Text(kOutlier) + " robust standard deviations from the median of its group.</p>\n";
  html +=
      "<table><thead><tr><th>crown<th>photograph, prediction, "
      "difference<th>group<th>status<th>flags<th>CIEDE2000<br><small>median</small><th>95 %";
  for (const std::string& n : names) html += "<th>" + Html(n) + "<br><small>95 % interval</small>";
  html += "</tr></thead><tbody>\n";
  for (size_t i = 0; i < crowns.size(); ++i) {
    const CrownOutcome& crown = crowns[i];
    const CrownRecord* r = crown.record ? &*crown.record : nullptr;
    const std::string folder = "crowns/" + crown.row.id + "/", why = r ? Joined(r->reasons, "; ") : crown.reason;
    html += "<tr><td>" + (r ? "<a href=\"" + Html(folder + "report.html") + "\">" + Html(crown.row.id) + "</a>"
                            : Html(crown.row.id));
    html += "<td>";
    if (r && !r->picture.empty())
      html += "<a href=\"" + Html(folder + r->picture) + "\"><img loading=\"lazy\" alt=\"\" src=\"" +
              Html(folder + r->picture) + "\"></a>";
    html += "<td>" + Html(crown.row.group) + "<td class=\"" + (crown.usable() ? "good" : "bad") + "\">";
    html += why.empty() ? Html(StatusOf(crown))
                        : "<details><summary>" + Html(StatusOf(crown)) + "</summary>" + Html(why) + "</details>";
    html += "<td data-sort=\"" + std::to_string(flags[i].size()) + "\">";
    for (const std::string& flag : flags[i]) html += "<span class=\"flag\">" + Html(flag) + "</span>";
    html += "<td class=\"n\">" + (r ? Hundredths(r->de00_median) : "") + "<td class=\"n\">" +
            (r ? Hundredths(r->de00_p95) : "");
    for (const std::string& name : names) html += ParameterCell(Find(crown, name));
    html += "</tr>\n";
  }
  html +=
      "</tbody></table>\n"
      "<h2>Statistics of the usable crowns</h2>\n"
      "<p>The mean is weighted by the intervals. Its error is widened where crowns differ by more than their intervals "
      "allow.</p>\n"
      "<table><thead><tr><th>group<th>parameter<th>crowns<th>mean<th>error of mean<th>spread over "
      "crowns<th>median</tr></thead><tbody>\n";
  for (const GroupStatistics& s : statistics) {
    html += "<tr><td>" + Html(s.group) + "<td>" + Html(s.parameter);
    for (const std::string& n :
         {std::to_string(s.number), Text(s.mean), Text(s.error_of_mean), Text(s.spread), Text(s.median)})
      html += "<td class=\"n\">" + n;
    html += "</tr>\n";
  }
  return html + "</tbody></table>\n" + kSort;
}

}  // namespace crownfit
