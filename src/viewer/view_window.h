#pragma once
// The viewer's window: the user turns, lights and edits the crown beside its photograph.

#include <filesystem>
#include <optional>
#include <string>

#include "base/progress.h"
#include "optics/material_file.h"

namespace crownfit {

struct WindowOptions {
  std::filesystem::path material_file;      ///< for the title and for saved files
  size_t photograph = 0;                    ///< the one shown first
  std::optional<std::pair<int, int>> size;  ///< of the window
  std::filesystem::path save_to = ".";
  bool prints_layout = false;   ///< "name x y w h" of every widget on stdout, once
  bool has_photographs = true;  ///< false: the capture was made up around a mesh
  int threads = 0;
  std::string note;  ///< origin of the parameters, for the panel
};

/// Opens the window and stays until it is closed. Prints the files it saves. Throws InputError without a display.
void ViewInWindow(const Capture& capture, const MaterialRecord& record, const WindowOptions& options,
                  Progress& progress);

}  // namespace crownfit
