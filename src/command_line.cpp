#include "command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <sstream>

#include "command_line_parts.h"

namespace crownfit {
namespace {

/// Values of `fit` that need more than CLI11's types.
struct FitText {
  std::vector<std::string> captures, fixes;
  bool no_priors = false;
};

/// The same of `batch`.
struct BatchWords {
  bool to_slurm = false;
  std::string partition, time, account, shard;
  SlurmOptions slurm;
};

/// What `fit` and `batch` share: every one of these may be a column of a manifest.
std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, CommandLine& line, FitText& text) {
  return {
      fit->add_option(
          "--model", line.fit.model,
          "shader: seconds, for looks. path: goes on from there to the optimum of random walks, minutes. auto "
          "(default\n"
          "of fit): path, unless the photographs can't tell shader from the truth. Default of batch: shader.\n"
          "layered: of captures that hold measurements of flat samples alone; their default."),
      fit->add_option(
             "--target-de00", line.fit.target_de00,
             "Choose --model and --walks before the fit: the cheapest whose pictures of this scene are within so\n"
             "much CIEDE2000 of the truth. Looks at the scene by some walks first.")
          ->check(CLI::PositiveNumber),
      fit->add_option("--budget-s", line.fit.budget_s,
                      "Choose --model and --walks before the fit: the most accurate that takes so many seconds on two\n"
                      "cores, by stored costs and not by the clock. With --target-de00: the cheapest that keeps both.")
          ->check(CLI::PositiveNumber),
      fit->add_option("--fix", text.fixes,
                      "NAME=VALUE or NAME=R,G,B: hold a parameter, such as dentine.absorption_per_mm=0.05.")
          ->take_all(),
      fit->add_option("--free", line.fit.overrides.free, "NAME: fit a parameter the capture holds fixed.")->take_all(),
      fit->add_option(
             "--prior", line.fit.prior,
             "Material file (material.json of an earlier fit, or a class of materials) whose values and standard "
             "deviations are\nthe priors; what they carry is called `prior` in the result.")
          ->check(CLI::ExistingFile),
      fit->add_flag("--no-priors", text.no_priors, "Let the photographs alone decide."),
      fit->add_option("--seed", line.fit.seed, "Seed of random numbers (default 1); model shader uses none."),
      fit->add_flag("--twelve-taps", line.fit.twelve_taps,
                    "Blur by the thesis's 1 + 12 taps in place of 49: faster, coarser."),
      fit->add_option(
             "--walks", line.fit.paths_per_photograph,
             "Model path: walks per photograph of each last run (default 1250000); half as many, 1.4 times the noise.")
          ->check(CLI::Range(size_t{1000}, size_t{10000000000})),
      fit->add_option("--profiles", line.fit.profile_points,
                      "Model shader: likelihood profiles in the report, by so many fits to either side of each weak\n"
                      "parameter (default 2); 0: parabolas, no time. Default of batch: 0.")
          ->check(CLI::Range(0, 50)),
      fit->add_option("--max-pixels", line.fit.max_pixels_per_photograph,
                      "Pixels per photograph that the fit uses (default 6000).")
          ->check(CLI::Range(size_t{100}, size_t{100000000})),
  };
}

std::string FaultOfFit(const std::vector<std::string>& fit_arguments);

CLI::App* AddBatch(CLI::App& app, CommandLine& line, FitText& text, BatchWords& more) {
  auto* batch = app.add_subcommand(
      "batch",
      "Fits every crown of a manifest, several at a time, each in a process of its own; then writes summary.csv,\n"
      "summary.html and statistics.csv. Run the same command again to go on after a stop or a crash: what is\n"
      "finished is skipped, what changed is fitted again. docs/batch.md shows manifests, clusters, and what happens "
      "when.");
  batch->add_option(
      "MANIFEST", line.batch.manifest,
      "CSV with the columns id and capture, then any of group and the options of `crownfit fit`; or JSON.");
  batch->add_option("-o,--output", line.batch.output, "Folder for the results (made when missing).");
  batch
      ->add_option("--jobs", line.batch.jobs, "Crowns at a time; 0: one per processor. Threads are divided among them.")
      ->check(CLI::Range(0, 1024));
  batch->add_option("--time-limit", line.batch.limits.seconds, "Seconds a crown may take (default 3600).")
      ->check(CLI::PositiveNumber);
  batch
      ->add_option("--memory-limit", line.batch.limits.memory_MiB,
                   "MiB of memory a crown may take (default: no limit).")
      ->check(CLI::PositiveNumber);
  batch->add_option("--retries", line.batch.retries, "How often a crown that crashed is tried again (default 1).")
      ->check(CLI::Range(0, 100));
  batch->add_flag("--keep-going", line.batch.keep_going, "Fit the good rows of a manifest that has faults.");
  batch->add_option(
      "--program", line.batch.program,
      "What to run in place of this program, with the same arguments: a wrapper such as nice or a container.");
  AddFitOptions(batch, line, text);
  AddCommonOptions(batch, line);
  batch->add_option("--shard", more.shard,
                    "i/n: fit the i-th of n parts alone, beside others that fit theirs; `batch collect` sums up.");
  batch
      ->add_flag("--slurm", more.to_slurm,
                 "Submit the work to Slurm as an array over a folder that all nodes see, and return. The same command\n"
                 "again resubmits what died.")
      ->group("Slurm");
  batch->add_option("--chunk", more.slurm.chunk, "Crowns a task (default: so many that scheduling costs under 5 %).")
      ->check(CLI::Range(size_t{1}, size_t{1000000}))
      ->group("Slurm");
  batch->add_option("-p,--partition", more.partition, "As sbatch has it.")->group("Slurm");
  batch->add_option("-t,--time", more.time, "As sbatch has it.")->group("Slurm");
  batch->add_option("-A,--account", more.account, "As sbatch has it.")->group("Slurm");
  batch
      ->add_option("--sbatch", more.slurm.sbatch,
                   "Any further argument of sbatch, such as --sbatch=--mem=2G; repeat it.")
      ->take_all()
      ->group("Slurm");
  batch->require_subcommand(0, 1);
  const std::pair<const char*, const char*> tasks[] = {
      {"status", "How far a batch is, here or on the cluster."},
      {"collect", "Write the summary of what is finished."},
      {"cancel", "Take a batch's tasks from Slurm's queue; what is finished stays."}};
  for (const auto& [name, what] : tasks)
    batch->add_subcommand(name, what)->add_option("DIR", line.batch.output, "The batch's folder.")->required();
  return batch;
}

/// What the batch must know of `fit`, and what the user said for all crowns.
BatchOptions BatchOf(const CommandLine& line, const std::string& program, const std::vector<CLI::Option*>& fit_options,
                     const CLI::App* batch) {
  BatchOptions options = line.batch;
  options.threads = line.fit.threads;
  std::error_code error;
  options.self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) options.self = program;
  if (options.program.empty()) options.program = options.self;
  options.fit.fault = FaultOfFit;
  for (const CLI::Option* option : fit_options) {
    const std::string dashed = option->get_name();
    const bool is_flag = option->get_items_expected_max() == 0;
    options.fit.columns.push_back(
        {dashed.substr(2), is_flag, option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll});
    const CLI::Option* said = batch->get_option(dashed);
    if (dashed == "--model" && said->count() == 0 && !line.fit.target_de00 && !line.fit.budget_s)
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "shader"});
    if (dashed == "--profiles" && said->count() == 0)
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "0"});
    if (said->count() == 0) continue;
    if (is_flag) options.fit.defaults.push_back(dashed);
    for (const std::string& value : said->results())
      if (!is_flag) options.fit.defaults.insert(options.fit.defaults.end(), {dashed, value});
  }
  return options;
}

void AddView(CLI::App& app, CommandLine& line) {
  auto* view = app.add_subcommand("view",
                                  "The crown in the light, drawn by the graphics processor as the fit's model "
                                  "sees it: a window, or --screenshot or --benchmark without one.");
  view->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  view->add_option("--capture", line.capture, "Crown, cameras and lamps: folder with capture.json, or that file.");
  view->add_option("--mesh", line.meshes,
                   "In place of a capture: surface of a layer in mm (PLY, STL, OBJ); repeat it, "
                   "outermost first. Lit by two softboxes and a weak dome.")
      ->allow_extra_args(false);
  view->add_option("--photograph", line.photograph, "Whose camera and lamps (default: the first).");
  view->add_option("--screenshot", line.screenshot, "Write one picture: .exr (linear) or .png. Needs no display.");
  view->add_option("--size", line.size, "WxH: of the picture, in place of the camera's own; or of the window.");
  view->add_option("--benchmark", line.benchmark_frames, "Draw so many frames and print how long they take.")
      ->check(CLI::Range(1, 1000000));
  view->add_option("--save-to", line.save_to, "Folder for what the window saves (default: where you are).");
  view->add_flag("--physical", line.physical,
                 "Show the physical parameters where the material has effective ones (`crownfit match`).");
  view->add_flag("--print-layout", line.print_layout,
                 "For tests: print where the window's widgets stand, `name x y w h`, and `end`.");
  AddCommonOptions(view, line);
}

void AddMatch(CLI::App& app, CommandLine& line) {
  auto* match = app.add_subcommand(
      "match",
      "Find parameters with which the viewer looks as the path model does with a material's own, under "
      "light made for it; written as the material's block \"viewer\".");
  match->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  match->add_option("--capture", line.capture, "The crown: folder with capture.json, or that file.")->required();
  match->add_option("-o,--output", line.output, "Where the material with its new block goes.")->required();
  match->add_option("--paths", line.paths, "Paths a pixel of the pictures to match (default 256).")
      ->check(CLI::Range(8, 1000000));
  match->add_option("--pixels", line.pixels, "Their width and height (default 64).")->check(CLI::Range(16, 1024));
  match->add_option("--seed", line.fit.seed, "Seed of the walks (default 1).");
  AddCommonOptions(match, line);
}

/// Parses; complaints go to `errors`, with the command's help unless they are to be `brief`.
CommandLine Parse(const std::vector<std::string>& arguments, std::ostream& errors, bool brief) {
  CommandLine line;
  for (const auto& a : arguments) line.text += (line.text.empty() ? "" : " ") + a;

  CLI::App app{
      "Fits the materials of dental crowns and teeth to calibrated photographs.\n\n"
      "  crownfit check CAPTURE                 complete and consistent? what will it tell, what to photograph next?\n"
      "  crownfit fit CAPTURE -o RESULT         scattering, absorption, thickness, roughness, with error bars\n"
      "  crownfit report RESULT                 the page of a result again: report.html\n"
      "  crownfit batch MANIFEST -o DIR         hundreds of crowns: parallel, resumable, with a summary\n"
      "  crownfit render CAPTURE --material M   the photographs a material predicts\n"
      "  crownfit view M --capture CAPTURE      the crown in a window: turn it, light it, change the material\n"
      "  crownfit match M --capture C -o M2     effective parameters that make the viewer look like path tracing\n"
      "  crownfit synthesize RECIPE -o CAPTURE  path-traced photographs with a known answer\n"
      "  crownfit predict MATERIAL              its colour and translucency at other thicknesses, over other stumps\n"
      "  crownfit shades ...                    your own shade tabs, and the nearest to a material\n"
      "  crownfit slab SLAB.json                reflectance and transmittance of a flat layered sample\n"
      "  crownfit calibrate WHAT IMAGES         camera, noise, blur, colour, lights and poses from photographs\n"
      "  crownfit capture init ...              meshes, photographs and calibration gathered into a capture\n"
      "  crownfit export M --to FORMAT -o DIR   for Mitsuba, pbrt, Blender, glTF, MaterialX, or as a table\n"
      "  crownfit compare A B                   CIEDE2000 between two pictures\n"
      "  crownfit benchmark tradeoff C -o DIR   speed against accuracy of every model, on your capture\n\n"
      "CAPTURE is a folder that holds capture.json, or that file. docs/file_formats.md describes it.\n"
      "Exit codes: 0 done; 1 finished, but the result must not be used (reasons are printed); 2 wrong input;\n"
      "3 interrupted; 4 internal error."};
  app.name("crownfit");
  app.require_subcommand(1);
  app.set_version_flag("--version", "crownfit " CROWNFIT_VERSION);
  app.failure_message(CLI::FailureMessage::help);

  FitText text;
  auto* fit = app.add_subcommand(
      "fit", "Fits the material of a capture; writes report.html, material.json, run.json and figures/.");
  fit->add_option(
         "CAPTURE", text.captures,
         "Folder with capture.json, or that file. Several: they show one material (discs of several\n"
         "thicknesses, crowns from one blank) and are fitted together; layers of the same name share everything\n"
         "but their thickness. RESULT/captures/ then holds a result for each.")
      ->required();
  fit->add_option("-o,--output", line.output, "Folder for the result (made when missing).")->required();
  const std::vector<CLI::Option*> fit_options = AddFitOptions(fit, line, text);
  fit->add_flag("--json", line.json, "Print material.json on stdout in place of the summary.");
  AddCommonOptions(fit, line);

  app.add_subcommand(
         "report",
         "Makes report.html of a result again, for a browser, without network: the verdict in plain words,\n"
         "photographs against predictions, colours by thirds of the crown, parameters with intervals, their\n"
         "correlation, convergence and provenance. `crownfit fit` makes it too. docs/report.md explains it.")
      ->add_option("RESULT", line.output, "Folder that `crownfit fit` wrote, wherever it was moved to.")
      ->required();

  auto* check = app.add_subcommand(
      "check",
      "Reads a capture with all its files and says whether it can be fitted, what its photographs would tell of every "
      "free number, what the scene requires, and which photograph to take next; fits nothing.");
  check->add_option("CAPTURE", line.capture, "Folder with capture.json, or that file.")->required();
  check->add_option("-o,--output", line.output, "PNG with slices through the layers, to look at.");
  check->add_flag("--json", line.json, "Print JSON.");
  AddCommonOptions(check, line);

  auto* render =
      app.add_subcommand("render", "Predicts the photographs of a capture with a material (EXR, and PNG to look at).");
  render->add_option("CAPTURE", line.capture, "Folder with capture.json, or that file. Its photographs need not exist.")
      ->required();
  render->add_option("--material", line.material, "material.json or truth.json; default: the capture's own values.");
  render->add_option("-o,--output", line.output, "Folder for the pictures.")->required();
  render->add_option("--model", line.fit.model,
                     "shader: the real-time terms, seconds. path: random walks, the reference; with a variance layer.");
  render->add_option("--paths", line.paths, "Paths per pixel of model path (default 256).")
      ->check(CLI::Range(1, 100000000));
  render->add_option("--photograph", line.photograph, "Only this one.");
  render
      ->add_option("--noise", line.noise, "Add relative noise of this standard deviation (0.01: 1 %), keyed by --seed.")
      ->check(CLI::Range(0.0, 1.0));
  render->add_flag(
      "--derivatives", line.derivatives,
      "Model path: also PHOTOGRAPH_derivatives.exr, derivatives by scattering, absorption, g, index and so on.");
  render->add_flag("--half", line.half_float, "16-bit EXR.");
  render->add_flag("--twelve-taps", line.fit.twelve_taps, "Blur by the thesis's 1 + 12 taps in place of 49.");
  render->add_flag("--fine", line.fine, "Four times the light samples.");
  render->add_option("--scale", line.scale, "Pictures of so many times the camera's width and height (default 1).")
      ->check(CLI::Range(0.01, 1.0));
  render->add_option("--seed", line.fit.seed, "Seed of the noise (default 1).");
  AddCommonOptions(render, line);

  AddView(app, line);
  AddMatch(app, line);
  AddCalibrate(app, line);
  AddCapture(app, line);
  AddExport(app, line);
  AddPredict(app, line);
  AddShades(app, line);
  AddBenchmark(app, line);
  BatchWords more;
  const CLI::App* batch = AddBatch(app, line, text, more);

  auto* synthesize = app.add_subcommand(
      "synthesize", "Path-traces a capture with a known answer: photographs, calibration, meshes, truth.json.");
  synthesize->add_option("RECIPE", line.capture, "recipe.json (docs/file_formats.md).")->required();
  synthesize->add_option("-o,--output", line.output, "Folder for the capture (made when missing).")->required();
  AddCommonOptions(synthesize, line);

  auto* slab = app.add_subcommand("slab", "Reflectance and transmittance of a flat layered sample, as JSON.");
  slab->add_option("SLAB", line.capture, "slab.json (docs/file_formats.md).")->required();
  slab->add_option("--model", line.fit.model,
                   "layered: adding-doubling, milliseconds (default). path: random walks, with errors and rings.");
  slab->add_option("--photons", line.photons,
                   "Photons of model path at normal incidence (default 1000000); a quarter as many come diffusely.")
      ->check(CLI::Range(uint64_t{2}, uint64_t{1000000000000}));
  slab->add_option("--seed", line.fit.seed, "Seed of model path (default 1).");
  AddCommonOptions(slab, line);

  auto* compare =
      app.add_subcommand("compare", "CIEDE2000 (D65, 2 degrees) between two linear pictures, over 8 x 8 blocks.");
  compare->add_option("IMAGE_A", line.image_a, "The photograph; sets the common brightness.")->required();
  compare->add_option("IMAGE_B", line.image_b, "What to compare with it.")->required();
  compare->add_option("--mask", line.mask, "Compare where this picture is above 0.5.");
  compare->add_option("-o,--output", line.output, "PNG map of the differences.");
  compare->add_flag("--json", line.json, "Print JSON.");

  try {
    std::vector<std::string> backwards(arguments.rbegin(), arguments.rend() - 1);
    app.parse(backwards);
  } catch (const CLI::ParseError& e) {
    if (brief) errors << e.what() << "\n";
    const int code = brief ? e.get_exit_code() : app.exit(e, std::cout, errors);
    line.exit_code = code == 0 ? 0 : 2;
    return line;
  }
  line.command = app.get_subcommands().front()->get_name();
  if (line.command == "calibrate")
    line.calibrate.task = app.get_subcommands().front()->get_subcommands().front()->get_name();
  if (line.command == "shades") line.shades.task = app.get_subcommands().front()->get_subcommands().front()->get_name();
  line.fit.use_priors = !text.no_priors;
  if (slab->parsed() && slab->count("--model") == 0) line.fit.model = "layered";
  if (render->parsed() && render->count("--model") == 0) line.fit.model = "shader";
  const auto complain = [&](const std::string& message) {
    errors << (brief ? "" : "crownfit: ") << message << "\n";
    line.exit_code = 2;
  };
  line.captures.assign(text.captures.begin(), text.captures.end());
  const std::map<std::string, std::vector<std::string>> models{{"fit", {"auto", "shader", "path", "layered"}},
                                                               {"batch", {"auto", "shader", "path", "layered"}},
                                                               {"render", {"shader", "path"}},
                                                               {"slab", {"layered", "path"}}};
  if (const auto known = models.find(line.command); known != models.end()) {
    const auto& names = known->second;
    if (std::find(names.begin(), names.end(), line.fit.model) == names.end()) {
      std::string list;
      for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
      complain("--model " + line.fit.model + ": " + line.command + " of this version has: " + list + ".");
    }
  }
  const bool is_planned = line.fit.target_de00 || line.fit.budget_s;
  if (is_planned && (line.fit.model != "auto" || line.fit.paths_per_photograph != FitOptions().paths_per_photograph))
    complain("--target-de00 and --budget-s choose --model and --walks: leave those away, or say --model auto.");
  constexpr int kFewestForDerivatives = 16;
  if (line.derivatives && (line.fit.model != "path" || line.paths < kFewestForDerivatives))
    complain("--derivatives: only with --model path, and at least 16 --paths: their errors are found from groups.");
  for (const auto& fix : text.fixes) {
    const size_t equals = fix.find('=');
    const char* end = fix.data() + fix.size();
    const char* next = equals == std::string::npos ? end : fix.data() + equals;
    std::vector<double> values;
    bool good = next != end;
    while (good && next != end) {
      values.push_back(0);
      const auto [stop, error] = std::from_chars(next + 1, end, values.back());
      good = error == std::errc() && (stop == end || *stop == ',');
      next = stop;
    }
    if (!good || (values.size() != 1 && values.size() != kChannels))
      complain("--fix " + fix + ": expected NAME=VALUE, or NAME=R,G,B with a number for each channel");
    values.resize(kChannels, values[0]);
    line.fit.overrides.fix.push_back({fix.substr(0, equals), {values[0], values[1], values[2]}});
  }
  if (batch->parsed()) {
    if (!batch->get_subcommands().empty()) line.batch_task = batch->get_subcommands().front()->get_name();
    if (line.batch_task.empty() && (line.batch.manifest.empty() || line.batch.output.empty()))
      complain("batch: expected MANIFEST -o DIR, or status, collect or cancel with DIR; see crownfit batch --help");
    line.batch = BatchOf(line, arguments[0], fit_options, batch);
    if (!more.shard.empty()) {
      Shard shard;
      int length = 0;
      if (std::sscanf(more.shard.c_str(), "%zu/%zu%n", &shard.number, &shard.count, &length) != 2 ||
          static_cast<size_t>(length) != more.shard.size() || shard.number < 1 || shard.number > shard.count)
        complain("--shard " + more.shard + ": expected i/n with 1 <= i <= n, such as 3/10");
      line.batch.shard = shard;
    }
    if (more.to_slurm) line.slurm = more.slurm;
    for (const auto& [option, value] :
         {std::pair{"--partition=", more.partition}, {"--time=", more.time}, {"--account=", more.account}})
      if (more.to_slurm && !value.empty()) line.slurm->sbatch.push_back(option + value);
  }
  return line;
}

std::string FaultOfFit(const std::vector<std::string>& fit_arguments) {
  std::vector<std::string> arguments{"crownfit", "fit", "CAPTURE", "-o", "RESULT"};
  arguments.insert(arguments.end(), fit_arguments.begin(), fit_arguments.end());
  std::ostringstream errors;
  Parse(arguments, errors, /*brief=*/true);
  std::string fault = errors.str();
  while (!fault.empty() && fault.back() == '\n') fault.pop_back();
  return fault;
}

}  // namespace

void AddCommonOptions(CLI::App* app, CommandLine& line) {
  app->add_option("--threads", line.fit.threads, "Threads to use; 0: one per processor. Results do not depend on it.")
      ->check(CLI::Range(0, 1024));
  app->add_option("--progress", line.progress, "auto: a bar when stderr is a terminal; none; json: lines on stderr.")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ProgressMode>{
          {"auto", ProgressMode::kAuto}, {"none", ProgressMode::kNone}, {"json", ProgressMode::kJson}}));
}

CommandLine ParseCommandLine(int argc, char** argv) {
  return Parse(std::vector<std::string>(argv, argv + argc), std::cerr, /*brief=*/false);
}

}  // namespace crownfit
