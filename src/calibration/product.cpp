#include "calibration/product.h"

#include <algorithm>

#include "base/files.h"
#include "base/text.h"

namespace crownfit {

std::string Text(double value, const std::string& unit) { return Number(value) + (unit.empty() ? "" : " " + unit); }

JsonValue ProductJson(const Product& product, const std::vector<std::filesystem::path>& inputs) {
  JsonValue::Object root, quality, digests;
  if (!product.format.empty()) root.emplace_back("format", product.format);
  root.insert(root.end(), product.content.begin(), product.content.end());
  for (const Figure& figure : product.figures) quality.emplace_back(figure.name, figure.value);
  if (!product.notes.empty()) quality.emplace_back("notes", product.notes);
  for (const auto& input : inputs) {
    const auto is_this = [&](const auto& digest) { return digest.first == input.string(); };
    if (std::none_of(digests.begin(), digests.end(), is_this))
      digests.emplace_back(input.string(), Sha256OfFile(input));
  }
  root.emplace_back("quality", std::move(quality));
  root.emplace_back("provenance", JsonValue::Object{{"inputs_sha256", std::move(digests)}});
  return root;
}

}  // namespace crownfit
