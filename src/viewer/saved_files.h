#pragma once
// Files that the viewer's window saves. Nothing is overwritten: names in use get _2, _3 and so on. Every file's name is
// printed; the return value is the message for the window.

#include <filesystem>
#include <map>
#include <string>

#include "optics/material.h"
#include "photo/image.h"

namespace crownfit {

/// Saves view_<photograph>.png as shown, and .exr.
std::string SavePictures(const std::filesystem::path& folder, const std::string& photograph, const Image& shown,
                         const Image& linear);

/// Saves view_<photograph>_window.png
std::string SaveWindowPicture(const std::filesystem::path& folder, const std::string& photograph, const Image& shown);

/// Saves view_material.json
std::string SaveMaterial(const std::filesystem::path& folder, const Capture& capture, const Material& material,
                         const std::map<std::string, double>& linear_scales, const std::filesystem::path& made_from);

}  // namespace crownfit
