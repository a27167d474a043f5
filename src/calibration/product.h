#pragma once
// Result of a calibration command: a file for the capture, quality figures, and whether it is good enough.

#include <filesystem>
#include <string>
#include <vector>

#include "base/json_file.h"
#include "photo/image.h"

namespace crownfit {

struct Figure {
  std::string name;
  double value;
  std::string unit;
};

/// A side file of a capture. With a refusal it is not good enough to be written.
struct Product {
  std::string format;              ///< "crownfit-camera/1", ...; empty: no file of that kind
  JsonValue::Object content;       ///< what the file holds beside format, quality and provenance
  std::vector<Figure> figures;     ///< its quality; also written under "quality"
  std::vector<std::string> notes;  ///< caveats of a usable product
  std::vector<std::string> refusals;
  Image picture;  ///< to look at; empty: none
};

/// "0.21 px"; a few digits, for messages.
std::string Text(double value, const std::string& unit = "");

/// The product as JSON, with its figures under "quality" and the digests of `inputs` under "provenance".
JsonValue ProductJson(const Product& product, const std::vector<std::filesystem::path>& inputs);

}  // namespace crownfit
