#include "viewer/saved_files.h"

#include <cstdio>

#include "optics/material_file.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

std::filesystem::path FreeName(const std::filesystem::path& folder, const std::string& stem, const char* extension) {
  for (int i = 1;; ++i) {
    const auto name = folder / (stem + (i > 1 ? "_" + std::to_string(i) : "") + extension);
    if (std::error_code ignored; !std::filesystem::exists(name, ignored)) return name;
  }
}

void Print(const std::filesystem::path& file) {
  std::printf("%s\n", file.c_str());
  std::fflush(stdout);  // a reading process waits for it
}

std::string Saved(const std::filesystem::path& file) { return "Saved " + std::filesystem::absolute(file).string(); }

}  // namespace

std::string SavePictures(const std::filesystem::path& folder, const std::string& photograph, const Image& shown,
                         const Image& linear) {
  const auto png = FreeName(folder, "view_" + photograph, ".png");
  const auto exr = std::filesystem::path(png).replace_extension(".exr");
  WriteImageFile(png, shown);
  WriteImageFile(exr, linear);
  Print(png);
  Print(exr);
  return Saved(png) + " and .exr (linear)";
}

std::string SaveWindowPicture(const std::filesystem::path& folder, const std::string& photograph, const Image& shown) {
  const auto png = FreeName(folder, "view_" + photograph + "_window", ".png");
  WriteImageFile(png, shown);
  Print(png);
  return Saved(png);
}

std::string SaveMaterial(const std::filesystem::path& folder, const Capture& capture, const Material& material,
                         const std::map<std::string, double>& linear_scales, const std::filesystem::path& made_from) {
  const auto file = FreeName(folder, "view_material", ".json");
  WriteHandSetMaterial(file, capture, material, linear_scales, made_from.string());
  Print(file);
  return Saved(file);
}

}  // namespace crownfit
