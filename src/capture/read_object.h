#pragma once
// Reads what a capture's object is, and references that the rest of the capture has too: files, and things by name.

#include <string>
#include <vector>

#include "base/json_file.h"
#include "capture/capture.h"

namespace crownfit {

/// Far above what real captures need, far below files that only list names.
inline constexpr size_t kMostThings = 10000;

/// Index of the item called `name`; otherwise throws InputError for the key.
template <class Item>
size_t IndexOf(const std::vector<Item>& items, const std::string& name, const JsonNode& node, const char* what) {
  std::string known;
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + items[i].name;
  }
  node.Fail("there is no " + std::string(what) + " called '" + name + "'",
            known.empty() ? "The capture defines none." : "Known: " + known + ".");
}

/// A path relative to the capture's folder, which becomes one of its input files.
std::filesystem::path ReadPath(const JsonNode& node, Capture& capture);

/// Layers, surface, scenery, backings and directions. `has_shape`: there are photographs, so the object needs meshes.
void ReadObject(const JsonNode& node, bool has_shape, Capture& capture);

}  // namespace crownfit
