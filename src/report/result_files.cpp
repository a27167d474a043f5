#include "report/result_files.h"

#include <sys/resource.h>
#include <unistd.h>

#include <ctime>

#include "base/files.h"
#include "base/json_file.h"
#include "capture/capture.h"
#include "fit/fit_result.h"
#include "photo/figures.h"
#include "photo/image_io.h"
#include "report/finding_words.h"
#include "report/joint_json.h"
#include "report/plain_words.h"
#include "report/report_files.h"

namespace crownfit {
namespace {

JsonValue OneOrList(const std::vector<double>& v) { return v.size() == 1 ? JsonValue(v[0]) : JsonValue(v); }

JsonValue ParameterJson(const FittedParameter& p) {
  JsonValue::Object o{{"value", OneOrList(p.value)}};
  if (!p.stddev.empty()) {
    o.emplace_back("stddev", OneOrList(p.stddev));
    JsonValue::Array intervals;
    for (size_t i = 0; i < p.value.size(); ++i) intervals.push_back(std::vector<double>{p.low95[i], p.high95[i]});
    o.emplace_back("interval95", intervals.size() == 1 ? intervals[0] : JsonValue(intervals));
  }
  o.emplace_back("status", Word(p.status));
  if (p.ChannelsThatAre(p.status).size() < p.value.size()) {
    JsonValue::Array words;
    for (const Status s : p.of_channels) words.emplace_back(Word(s));
    o.emplace_back("status_by_channel", words);
  }
  return o;
}

const FittedParameter* Find(const CrownFit& fit, size_t layer, Quantity quantity) {
  for (const auto& p : fit.uncertainty.parameters)
    if (p.layer == layer && p.quantity == quantity) return &p;
  return nullptr;
}

/// Users compare thickness_mm: where a mesh or a field gives the thickness, it is its mean times the scale.
JsonValue ThicknessJson(const CrownFit& fit, size_t layer) {
  const bool has_scale = ThicknessQuantity(fit.capture, layer) == Quantity::kThicknessScale;
  const FittedParameter* stated = Find(fit, layer, Quantity::kThickness);
  const bool is_last = layer + 1 == fit.capture.layers.size();
  if (!has_scale && (!is_last || fit.capture.layers[layer][Quantity::kThickness].stated)) return ParameterJson(*stated);
  FittedParameter p = *Find(fit, layer, Quantity::kThicknessScale);
  for (auto* list : {&p.value, &p.stddev, &p.low95, &p.high95})
    for (double& v : *list) v *= fit.mean_thickness_mm[layer];
  return ParameterJson(p);
}

JsonValue ErrorJson(const std::vector<const PhotographResult*>& photographs) {
  // Over several photographs all blocks have equal weight, so means are weighted by block counts. Quantiles are taken
  // per photograph and averaged the same way.
  double weight = 0, median = 0, p95 = 0, mean = 0, pt = 0, at = 0, pixel_median = 0, pixel_p95 = 0, chi2 = 0;
  for (const auto* p : photographs) {
    const double w = static_cast<double>(p->difference.blocks);
    weight += w;
    median += w * p->difference.median;
    p95 += w * p->difference.p95;
    mean += w * p->difference.mean;
    pt += w * p->difference.share_below_pt;
    at += w * p->difference.share_below_at;
    pixel_median += w * p->difference.pixel_median;
    pixel_p95 += w * p->difference.pixel_p95;
    chi2 += w * p->reduced_chi2;
  }
  if (weight == 0) return JsonValue();
  return JsonValue::Object{{"de00_median", median / weight},       {"de00_p95", p95 / weight},
                           {"de00_mean", mean / weight},           {"share_below_pt", pt / weight},
                           {"share_below_at", at / weight},        {"de00_median_pixel", pixel_median / weight},
                           {"de00_p95_pixel", pixel_p95 / weight}, {"reduced_chi2", chi2 / weight}};
}

JsonValue ReadingsJson(const CrownFit& fit) {
  const auto three = [](const auto& v) { return std::vector<double>(v.begin(), v.end()); };
  JsonValue::Array readings;
  for (const ReadingResult& r : fit.readings)
    readings.push_back(JsonValue::Object{{"name", r.measurement},
                                         {"use", r.is_holdout ? "holdout" : "fit"},
                                         {"quantity", r.quantity},
                                         {"value", three(r.read.value)},
                                         {"stddev", three(r.read.stddev)},
                                         {"predicted", three(r.predicted)}});
  return readings;
}

JsonValue LayerJson(const CrownFit& fit, size_t layer) {
  JsonValue::Object o{{"name", fit.capture.layers[layer].name}};
  for (const auto& row : kParameters) {
    if (row.owner != Owner::kLayer) continue;
    if (row.quantity == Quantity::kThickness) {
      o.emplace_back(row.key, ThicknessJson(fit, layer));
      continue;
    }
    if (row.quantity == Quantity::kThicknessScale && !fit.capture.layers[layer][Quantity::kThicknessScale].stated)
      continue;
    o.emplace_back(row.key, ParameterJson(*Find(fit, layer, row.quantity)));
  }
  return o;
}

JsonValue ViewerJson(const CrownFit& fit) {
  JsonValue::Array layers;
  for (const auto& layer : fit.seen_by_shader.layers) {
    JsonValue::Object o{{"name", layer.name}};
    for (Quantity q : {Quantity::kIor, Quantity::kReducedScattering, Quantity::kAbsorption})
      o.emplace_back(RowOf(q).key, std::vector<double>(layer[q].begin(), layer[q].end()));
    layers.push_back(o);
  }
  return JsonValue::Object{
      {"note", "effective parameters of the real-time shader; not physical if the fit used another model"},
      {"layers", layers},
      {"roughness", fit.seen_by_shader.surface[Quantity::kRoughness][0]}};
}

JsonValue ProvenanceJson(const CrownFit& fit) {
  JsonValue::Object digests;
  std::vector<std::filesystem::path> inputs = fit.capture.input_files;
  if (!fit.options.prior.empty()) inputs.push_back(fit.options.prior);
  for (const auto& file : inputs)
    digests.emplace_back(std::filesystem::relative(file, fit.capture.folder).generic_string(), Sha256OfFile(file));
  JsonValue::Array fixed, freed, shared;
  for (const auto& [name, value] : fit.options.overrides.fix)
    fixed.push_back(JsonValue::Object{{"name", name}, {"value", std::vector<double>(value.begin(), value.end())}});
  for (const auto& name : fit.options.overrides.free) freed.push_back(name);
  for (const auto& [name, sharing] : fit.options.overrides.share)
    shared.push_back(JsonValue::Object{{"name", name}, {"shared", Word(sharing)}});
  return JsonValue::Object{
      {"crownfit", CROWNFIT_VERSION},
      {"inputs_sha256", digests},
      {"seed", static_cast<double>(fit.options.seed)},
      {"model_choice", fit.model_choice},
      {"options",
       JsonValue::Object{{"model", Word(fit.options.model)},
                         {"fix", fixed},
                         {"free", freed},
                         {"shared", shared},
                         {"left_out", fit.left_out},
                         {"priors", fit.options.use_priors},
                         {"prior_sha256", fit.options.prior.empty() ? "" : Sha256OfFile(fit.options.prior)},
                         {"paths_per_photograph", static_cast<double>(fit.options.paths_per_photograph)},
                         {"twelve_taps", fit.options.twelve_taps},
                         {"max_pixels_per_photograph", static_cast<double>(fit.options.max_pixels_per_photograph)}}}};
}

JsonValue TogetherJson(const CrownFit& fit) {
  JsonValue::Array captures;
  for (const TogetherWith& t : fit.together) {
    JsonValue::Object own;
    for (const FittedParameter& p : t.its_own) own.emplace_back(p.name, ParameterJson(p));
    captures.push_back(JsonValue::Object{{"name", t.name},
                                         {"status", t.usable ? "usable" : "not_usable"},
                                         {"block_chi2", t.block_chi2},
                                         {"its_own", own}});
  }
  return captures;
}

JsonValue StepsJson(const CrownFit& fit) {
  const auto list = [](const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  JsonValue::Array steps;
  for (const WalkedFitStep& s : fit.steps)
    steps.push_back(JsonValue::Object{{"stage", s.stage},
                                      {"paths_per_photograph", s.paths_per_photograph},
                                      {"reduced_chi2", s.reduced_chi2},
                                      {"block_chi2", s.block_chi2},
                                      {"from", list(s.from)},
                                      {"step", list(s.step)},
                                      {"stddev", list(s.stddev)},
                                      {"stddev_of_walks", list(s.stddev_of_walks)}});
  std::vector<std::string> names;
  for (const FreeEntry& e : fit.entries) names.push_back(e.name);
  return JsonValue::Object{{"entries", names}, {"walked_paths", fit.walked_paths}, {"steps", steps}};
}

std::string NowUtc() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

std::string MaterialJson(const CrownFit& fit) {
  JsonValue::Array channels, layers;
  for (size_t c = 0; c < fit.capture.channel_names.size(); ++c)
    channels.push_back(
        JsonValue::Object{{"name", fit.capture.channel_names[c]}, {"wavelength_nm", fit.capture.wavelengths_nm[c]}});
  for (size_t l = 0; l < fit.capture.layers.size(); ++l) layers.push_back(LayerJson(fit, l));
  JsonValue::Object surface, by_name, scales, scales_stddev;
  for (const auto& row : kParameters)
    if (IsOfSurface(fit.capture, row))
      surface.emplace_back(row.key, ParameterJson(*Find(fit, kSurfaceOwner, row.quantity)));
  std::vector<const PhotographResult*> used, held_out;
  for (const auto& p : fit.photographs) {
    (p.is_holdout ? held_out : used).push_back(&p);
    JsonValue error = ErrorJson({&p});
    if (auto* figures = std::get_if<JsonValue::Object>(&error.data); figures && p.residual_chi2) {
      figures->emplace_back("block_chi2", p.residual_chi2->patches.chi2);
      figures->emplace_back("region_chi2", p.residual_chi2->regions.chi2);
    }
    by_name.emplace_back(p.name, std::move(error));
    if (!p.exposure_is_fitted) continue;
    scales.emplace_back("exposure_scale " + p.name, p.exposure);
    if (p.exposure_stddev > 0) scales_stddev.emplace_back("exposure_scale " + p.name, p.exposure_stddev);
  }
  const std::vector<double>& lights_stddev = fit.knowledge.scales_stddev.light;  // 0: no photograph determines it
  for (size_t l = 0; l < fit.capture.lights.size(); ++l) {
    const Light& light = fit.capture.lights[l];
    if (!light.scale_is_free && light.intensity_stddev <= 0) continue;
    scales.emplace_back("intensity_scale " + light.name, fit.scales.light[l]);
    if (!lights_stddev.empty() && lights_stddev[l] > 0)
      scales_stddev.emplace_back("intensity_scale " + light.name, lights_stddev[l]);
  }
  JsonValue::Object moved;
  for (const MovedCalibration& m : fit.calibration)
    moved.emplace_back(m.what, JsonValue::Object{{"moved_stddevs", m.Stddevs()}});
  JsonValue::Object beside;
  for (const SceneryLevel& level : fit.scenery)
    beside.emplace_back(level.photograph,
                        JsonValue::Object{{"ratio", JsonValue::Array(level.ratio.begin(), level.ratio.end())},
                                          {"stddev", JsonValue::Array(level.stddev.begin(), level.stddev.end())}});
  JsonValue::Object off_laws;
  for (const LawDeparture& d : fit.departures)
    off_laws.emplace_back(d.parameter, JsonValue::Object{{"shared", Word(d.law)},
                                                         {"moved", JsonValue::Array(d.moved.begin(), d.moved.end())},
                                                         {"off", JsonValue::Array(d.off.begin(), d.off.end())},
                                                         {"stddev", JsonValue::Array(d.stddev.begin(), d.stddev.end())},
                                                         {"chi2", d.chi2},
                                                         {"freedom", d.freedom}});
  const Uncertainty& u = fit.uncertainty;
  JsonValue::Object result{
      {"format", "crownfit-material/1"},
      {"model", Word(fit.model)},
      {"status", fit.usable ? "usable" : "not_usable"},
      {"reasons", InWords(fit.reasons)},
      {"caveats", InWords(fit.caveats)},
      {"channels", channels},
      {"layers", layers},
      {"surface", surface},
      {"viewer", ViewerJson(fit)},
      {"image_error",
       JsonValue::Object{{"fit", ErrorJson(used)}, {"holdout", ErrorJson(held_out)}, {"photographs", by_name}}},
      {"measurements", ReadingsJson(fit)},
      {"identifiability", JsonValue::Object{{"verdict", VerdictInWords(fit)},
                                            {"advice", fit.advice},
                                            {"weak_directions", AsVectors(u.weak_directions)},
                                            {"off_shared_laws", off_laws},
                                            {"condition", u.condition},
                                            {"reduced_chi2", u.reduced_chi2},
                                            {"block_chi2", u.block_chi2},
                                            {"region_chi2", fit.residual_chi2.regions.chi2},
                                            {"variance_inflation", u.inflation},
                                            {"monte_carlo_share_of_variance", u.of_walks}}},
      {"joint", JointJson(fit)},
      {"linear_scales", scales},
      {"linear_scales_stddev", scales_stddev},
      {"calibration", moved},
      {"scenery_levels", beside},
      {"provenance", ProvenanceJson(fit)}};
  if (!fit.together.empty()) result.emplace_back("captures", TogetherJson(fit));
  return ToJsonText(result);
}

void WriteResult(const std::filesystem::path& folder, const CrownFit& fit, const RunRecord& run) {
  for (const auto& p : fit.photographs)
    WriteImageFile(folder / "figures" / (p.name + ".png"),
                   TriptychFigure(p.photograph, p.prediction, p.compared, p.difference, p.rgb_from_sensor,
                                  p.name + (p.is_holdout ? " (held out)" : "")));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  char host[256] = "";
  gethostname(host, sizeof host - 1);
  WriteTextFile(folder / "run.json",
                ToJsonText(JsonValue::Object{{"format", "crownfit-run/1"},
                                             {"command_line", run.command_line},
                                             {"host", host},
                                             {"instruction_set", CROWNFIT_INSTRUCTION_SET},
                                             {"threads", run.threads},
                                             {"wall_s", run.wall_s},
                                             {"finished_utc", NowUtc()},
                                             {"peak_memory_MiB", static_cast<double>(usage.ru_maxrss) / 1024.0},
                                             {"iterations", fit.iterations},
                                             {"casts", fit.casts},
                                             {"walks", StepsJson(fit)},
                                             {"fitted_pixels", static_cast<double>(fit.fitted_pixels)}}));
  WriteReportFiles(folder, fit);
  WriteTextFile(folder / "material.json", MaterialJson(fit));
}

}  // namespace crownfit
