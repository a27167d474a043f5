#include "cli/common_options.h"

#include <algorithm>
#include <cstdio>

#include "base/error.h"

namespace crownfit {

void AddCommonOptions(CLI::App* app, CommonOptions& common) {
  app->add_option("--threads", common.threads,
                  "Threads to use; 0 (default): one per processor. Results do not depend on it.")
      ->check(CLI::Range(0, 1024));
  app->add_option("--progress", common.progress,
                  "auto (default): a bar if stderr is a terminal; none; json: lines of JSON on stderr.")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ProgressMode>{
          {"auto", ProgressMode::kAuto}, {"none", ProgressMode::kNone}, {"json", ProgressMode::kJson}}));
}

CLI::Option* AddModel(CLI::App* app, Model& model, const std::vector<Model>& known, const std::string& help) {
  return app->add_option_function<std::string>(
      "--model",
      [app, known, &model](const std::string& text) {
        const std::optional<Model> named = ModelOf(text);
        if (named && std::count(known.begin(), known.end(), *named)) {
          model = *named;
          return;
        }
        std::string names;
        for (const Model m : known) names += (names.empty() ? "" : ", ") + std::string(Word(m));
        throw InputError("", "--model " + text, app->get_name() + " knows " + names + ".");
      },
      help);
}

CLI::Option* AddCollisions(CLI::App* app, int& collisions) {
  return app
      ->add_option("--collisions", collisions,
                   "Model diffusion: collisions of a random walk before it switches to diffusion (default 10).\n"
                   "0: plain diffusion. More: nearer to model path, and slower.")
      ->check(CLI::Range(0, 1000000));
}

void PrintNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::fprintf(stderr, "note: %s\n", note.c_str());
}

void AddEncodingOptions(CLI::App* app, std::string& encoding) {
  auto* stated =
      app->add_option("--encoding", encoding,
                      "How values stand for light: file (what the file states; default), linear, srgb, or a\n"
                      "gamma such as 2.2.");
  app->add_flag_callback(
         "--linear", [&encoding] { encoding = "linear"; }, "The same as --encoding linear.")
      ->excludes(stated);
}

}  // namespace crownfit
