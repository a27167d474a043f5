#include "batch/crown_record.h"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>

#include "base/error.h"
#include "base/files.h"

namespace crownfit {
namespace {

/// Empty when the file is not there.
std::string StampOf(const std::filesystem::path& file, double* changed_s = nullptr) {
  struct stat s {};
  if (stat(file.c_str(), &s) != 0) return "";
  const double seconds = static_cast<double>(s.st_mtim.tv_sec) + 1e-9 * static_cast<double>(s.st_mtim.tv_nsec);
  if (changed_s) *changed_s = seconds;
  return std::to_string(s.st_size) + " " + std::to_string(s.st_mtim.tv_sec) + "." + std::to_string(s.st_mtim.tv_nsec);
}

const JsonValue* Find(const JsonValue& value, const char* key) {
  const auto* object = std::get_if<JsonValue::Object>(&value.data);
  if (!object) return nullptr;
  const auto found = std::find_if(object->begin(), object->end(), [&](const auto& m) { return m.first == key; });
  return found == object->end() ? nullptr : &found->second;
}
const JsonValue& At(const JsonValue& value, const char* key) {
  static const JsonValue nothing;
  const JsonValue* found = Find(value, key);
  return found ? *found : nothing;
}
std::string Text(const JsonValue& value) {
  const auto* text = std::get_if<std::string>(&value.data);
  return text ? *text : "";
}
std::optional<double> Number(const JsonValue& value) {
  const auto* number = std::get_if<double>(&value.data);
  return number ? std::optional(*number) : std::nullopt;
}
const JsonValue::Array& List(const JsonValue& value) {
  static const JsonValue::Array nothing;
  const auto* list = std::get_if<JsonValue::Array>(&value.data);
  return list ? *list : nothing;
}
std::vector<std::string> Texts(const JsonValue& value) {
  std::vector<std::string> texts;
  for (const JsonValue& item : List(value)) texts.push_back(Text(item));
  return texts;
}
JsonValue Maybe(const std::optional<double>& number) { return number ? JsonValue(*number) : JsonValue(); }

/// One value, or one per channel, as in material.json. Fixed parameters are left out.
void AddParameters(const std::string& owner, const JsonValue& of, const std::vector<std::string>& channels,
                   std::vector<RecordedParameter>& parameters) {
  for (const auto& [key, parameter] : std::get<JsonValue::Object>(of.data)) {
    const std::string status = Text(At(parameter, "status"));
    if (status.empty() || status == "fixed") continue;
    const JsonValue &value = At(parameter, "value"), &stddev = At(parameter, "stddev"),
                    &interval = At(parameter, "interval95");
    const JsonValue* by_channel = Find(parameter, "status_by_channel");
    const size_t count = std::max<size_t>(1, List(value).size());
    for (size_t i = 0; i < count; ++i) {
      const bool many = !List(value).empty();
      RecordedParameter p{owner + "." + key + (many && i < channels.size() ? "[" + channels[i] + "]" : ""),
                          by_channel ? Text(List(*by_channel).at(i)) : status,
                          0,
                          {},
                          {},
                          {}};
      p.value = Number(many ? List(value)[i] : value).value_or(0);
      if (Find(parameter, "stddev")) {
        p.stddev = Number(many ? List(stddev).at(i) : stddev);
        const JsonValue::Array& ends = many ? List(List(interval).at(i)) : List(interval);
        if (ends.size() == 2) {
          p.low = Number(ends[0]);
          p.high = Number(ends[1]);
        }
      }
      parameters.push_back(p);
    }
  }
}

}  // namespace

CrownRecord RecordOf(const std::filesystem::path& result, const std::filesystem::path& capture_folder,
                     const std::vector<std::string>& arguments, double begun_s) {
  const JsonFile file(result / "material.json");
  const JsonValue& material = file.value;
  CrownRecord record;
  record.program = CROWNFIT_VERSION;
  record.arguments = arguments;
  record.status = Text(At(material, "status"));
  record.reasons = Texts(At(material, "reasons"));
  const JsonValue& error = At(material, "image_error");
  record.de00_median = Number(At(At(error, "fit"), "de00_median"));
  record.de00_p95 = Number(At(At(error, "fit"), "de00_p95"));
  record.holdout_de00_median = Number(At(At(error, "holdout"), "de00_median"));
  std::vector<std::string> channels;
  for (const JsonValue& channel : List(At(material, "channels"))) channels.push_back(Text(At(channel, "name")));
  for (const JsonValue& layer : List(At(material, "layers")))
    AddParameters(Text(At(layer, "name")), layer, channels, record.parameters);
  if (Find(material, "surface")) AddParameters("surface", At(material, "surface"), channels, record.parameters);
  const JsonValue& inputs = At(At(material, "provenance"), "inputs_sha256");
  if (const auto* digests = std::get_if<JsonValue::Object>(&inputs.data))
    for (const auto& [name, digest] : *digests) {
      double changed_s = 0;
      const std::string stamp = StampOf(capture_folder / name, &changed_s);
      const double now_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
      if (stamp.empty() || (changed_s > begun_s && changed_s < now_s))  // times in the future come from a wrong clock
        throw InputError(capture_folder / name, "", "changed while the crown was fitted",
                         "Run the same command again.");
      record.files.push_back({name, Text(digest), stamp});
    }
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(result / "figures", ignored)) {
    const std::string name = "figures/" + entry.path().filename().string();
    if (entry.path().extension() == ".png" && (record.picture.empty() || name < record.picture)) record.picture = name;
  }
  return record;
}

std::string RecordText(const CrownRecord& record) {
  JsonValue::Array files, parameters;
  for (const RecordedFile& f : record.files)
    files.push_back(JsonValue::Object{{"name", f.name}, {"sha256", f.sha256}, {"stamp", f.stamp}});
  for (const RecordedParameter& p : record.parameters)
    parameters.push_back(JsonValue::Object{{"name", p.name},
                                           {"status", p.status},
                                           {"value", p.value},
                                           {"stddev", Maybe(p.stddev)},
                                           {"low", Maybe(p.low)},
                                           {"high", Maybe(p.high)}});
  return ToJsonText(JsonValue::Object{{"format", "crownfit-crown/1"},
                                      {"crownfit", record.program},
                                      {"arguments", record.arguments},
                                      {"files", files},
                                      {"status", record.status},
                                      {"reasons", record.reasons},
                                      {"de00_median", Maybe(record.de00_median)},
                                      {"de00_p95", Maybe(record.de00_p95)},
                                      {"holdout_de00_median", Maybe(record.holdout_de00_median)},
                                      {"wall_s", record.wall_s},
                                      {"peak_memory_MiB", record.peak_MiB},
                                      {"picture", record.picture},
                                      {"parameters", parameters}});
}

std::optional<CrownRecord> ReadRecord(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  CrownRecord record;
  try {
    const JsonFile json(file);
    const JsonValue& root = json.value;
    if (Text(At(root, "format")) != "crownfit-crown/1") return std::nullopt;
    record.program = Text(At(root, "crownfit"));
    record.arguments = Texts(At(root, "arguments"));
    for (const JsonValue& f : List(At(root, "files")))
      record.files.push_back({Text(At(f, "name")), Text(At(f, "sha256")), Text(At(f, "stamp"))});
    record.status = Text(At(root, "status"));
    record.reasons = Texts(At(root, "reasons"));
    record.de00_median = Number(At(root, "de00_median"));
    record.de00_p95 = Number(At(root, "de00_p95"));
    record.holdout_de00_median = Number(At(root, "holdout_de00_median"));
    record.wall_s = Number(At(root, "wall_s")).value_or(0);
    record.peak_MiB = Number(At(root, "peak_memory_MiB")).value_or(0);
    record.picture = Text(At(root, "picture"));
    for (const JsonValue& p : List(At(root, "parameters")))
      record.parameters.push_back({Text(At(p, "name")), Text(At(p, "status")), Number(At(p, "value")).value_or(0),
                                   Number(At(p, "stddev")), Number(At(p, "low")), Number(At(p, "high"))});
  } catch (const InputError&) {
    return std::nullopt;
  }
  return record;
}

Freshness Compare(CrownRecord& record, const std::filesystem::path& capture_folder,
                  const std::vector<std::string>& arguments) {
  if (record.program != CROWNFIT_VERSION || record.arguments != arguments || record.files.empty())
    return Freshness::kStale;
  Freshness freshness = Freshness::kFresh;
  for (RecordedFile& file : record.files) {
    const std::string stamp = StampOf(capture_folder / file.name);
    if (stamp == file.stamp) continue;
    if (stamp.empty() || Sha256OfFile(capture_folder / file.name) != file.sha256) return Freshness::kStale;
    file.stamp = stamp;
    freshness = Freshness::kRestamped;
  }
  return freshness;
}

}  // namespace crownfit
