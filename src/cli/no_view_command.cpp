// `crownfit view` of a program built without the viewer.

#include "base/error.h"
#include "cli/common_options.h"

namespace crownfit {

void AddView(CLI::App& app, Command&) {
  auto* view = app.add_subcommand("view", "Shows the crown in a window. This program was built without it.");
  view->allow_extras();
  view->final_callback([] {
    throw InputError("", "view", "this program was built without the viewer",
                     "Build it with -DCROWNFIT_VIEWER=ON, or use `crownfit render`.");
  });
}

}  // namespace crownfit
