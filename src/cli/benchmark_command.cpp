#include <algorithm>
#include <cstdio>
#include <functional>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/common_options.h"
#include "cli/trade_off.h"
#include "report/scatter_plot.h"

namespace crownfit {
namespace {

struct TradeOffCommand {
  std::filesystem::path capture, output;
  TradeOffOptions options;
  CommonOptions common;
};

std::string Joined(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : " ") + word;
  return all;
}

std::string Cell(const std::optional<double>& value) { return value ? Number(*value, 4) : ""; }

size_t SeriesOf(const TradeOffRow& row) { return row.model == "shader" ? 0 : row.model == "diffusion" ? 1 : 2; }

/// The rows with results, as points: `y` of each.
std::vector<ScatterPoint> Points(const std::vector<TradeOffRow>& rows,
                                 const std::function<double(const TradeOffRow&)>& y) {
  std::vector<ScatterPoint> points;
  for (const TradeOffRow& row : rows)
    if (row.fault.empty() && row.cpu_s > 0 && y(row) > 0)
      points.push_back({row.cpu_s, y(row), row.name, SeriesOf(row), false});
  MarkFront(points);
  return points;
}

bool IsOnFront(const std::vector<ScatterPoint>& points, const TradeOffRow& row) {
  return std::any_of(points.begin(), points.end(), [&](const ScatterPoint& p) {
    return p.is_on_front && p.label == row.name && p.series == (SeriesOf(row));
  });
}

std::string Csv(const std::vector<TradeOffRow>& rows, const char* kind, const std::vector<ScatterPoint>& points) {
  std::string text;
  for (const TradeOffRow& row : rows) {
    const bool has_figures = row.fault.empty();
    text += std::string(kind) + "," + row.model + ",\"" + row.name + "\"," + Joined(row.arguments) + "," +
            Cell(row.cpu_s) + "," + Cell(row.wall_s) + "," + Cell(row.peak_MiB) + ",";
    for (const double v : {row.de00_median, row.de00_p95, row.de00_median_worst})
      text += (has_figures && v > 0 ? Cell(v) : "") + ",";
    text += Cell(row.error_median_percent) + "," + Cell(row.error_largest_percent) + ",";
    text += (row.error_median_percent ? std::to_string(row.intervals_that_hold) + "," + std::to_string(row.intervals)
                                      : ",") +
            ",";
    text += (has_figures ? row.status : "failed") + "," + (IsOnFront(points, row) ? "1" : "0") + "\n";
  }
  return text;
}

void Print(const std::vector<TradeOffRow>& rows, const std::vector<ScatterPoint>& points) {
  for (const TradeOffRow& row : rows) {
    if (!row.fault.empty()) {
      std::printf("%-7s %-26s failed: %s\n", row.model.c_str(), row.name.c_str(), row.fault.c_str());
      continue;
    }
    std::printf("%-7s %-26s %9.2f %9.2f %8.0f %8.2f %8.2f %s", row.model.c_str(), row.name.c_str(), row.cpu_s,
                row.wall_s, row.peak_MiB, row.de00_median, row.de00_p95, IsOnFront(points, row) ? " *" : "  ");
    if (row.error_median_percent)
      std::printf(" %6.1f %% %6.0f %%  %d of %d", *row.error_median_percent, *row.error_largest_percent,
                  row.intervals_that_hold, row.intervals);
    std::printf("  %s\n", row.status.c_str());
  }
}

int RunTradeOff(const TradeOffCommand& asked) {
  std::error_code error;
  std::filesystem::create_directories(asked.output / "pictures", error);
  if (error)
    throw InputError(asked.output, "", "can't be written: " + error.message(),
                     "Choose an output folder you may write to.");
  TradeOffOptions options = asked.options;
  options.threads = asked.common.threads;
  Progress progress(asked.common.progress);
  const TradeOff t =
      MeasureTradeOff(std::filesystem::read_symlink("/proc/self/exe"), asked.capture, options, asked.output, progress);
  progress.Clear();
  const auto predictions = Points(t.predictions, [](const TradeOffRow& row) { return row.de00_median; });
  const auto fits = Points(t.fits, [](const TradeOffRow& row) { return row.error_median_percent.value_or(0); });
  const std::vector<std::string> series{"model shader", "model diffusion", "model path"};
  WriteTextFile(asked.output / "tradeoff.csv",
                "kind,model,name,arguments,cpu_s,wall_s,peak_MiB,de00_median,de00_p95,de00_median_worst_photograph,"
                "parameter_error_median_percent,parameter_error_largest_percent,intervals_that_hold,intervals,status,"
                "on_pareto_front\n" +
                    Csv(t.predictions, "render", predictions) + Csv(t.fits, "fit", fits));
  WriteTextFile(asked.output / "prediction.svg",
                ScatterPlotSvg({"Predicted photographs against a reference of " +
                                    std::to_string(options.reference_paths) + " paths per pixel",
                                "processor seconds for all photographs, start-up and reading included",
                                "CIEDE2000, median over 8 x 8 blocks",
                                series,
                                predictions,
                                {{t.reference_de00_median, "noise of the reference"}}}));
  if (options.fits)
    WriteTextFile(asked.output / "fits.svg", ScatterPlotSvg({"Fitted values against " + t.fitted_to,
                                                             "processor seconds",
                                                             "|ln(fitted / true)|, median over parameters, %",
                                                             series,
                                                             fits,
                                                             {}}));
  std::printf("%-7s %-26s %9s %9s %8s %8s %8s\n", "model", "setting", "CPU s", "clock s", "MiB", "median", "95 %");
  Print(t.predictions, predictions);
  std::printf(
      "Rendered: %s. Reference: %d paths per pixel, with a noise of CIEDE2000 %.2f (95 %%: %.2f). *: on the Pareto "
      "front.\n",
      t.rendered.c_str(), options.reference_paths, t.reference_de00_median, t.reference_de00_p95);
  if (options.fits) {
    std::printf(
        "\nFits: CIEDE2000 against the photographs; median and largest error of the fitted values against %s; how many "
        "95 %% intervals hold it\n",
        t.fitted_to.c_str());
    Print(t.fits, fits);
  }
  std::printf("%s\n", (asked.output / "tradeoff.csv").c_str());
  return 0;
}

}  // namespace

void AddBenchmark(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<TradeOffCommand>();
  auto* benchmark = app.add_subcommand(
      "benchmark", "Measures how fast and how accurate the program is on your own capture and machine.");
  benchmark->require_subcommand(1);
  benchmark->footer(
      "Example:\n"
      "  crownfit benchmark tradeoff crown -o tradeoff");
  auto* trade_off = benchmark->add_subcommand(
      "tradeoff",
      "Measures speed against accuracy: renders the capture's photographs with every model and setting,\n"
      "and compares them with a long path-traced reference.");
  trade_off->footer(
      "Writes tradeoff.csv, the pictures, and prediction.svg: a plot with its Pareto front, the settings that\n"
      "no other beats in both time and CIEDE2000. With --fits it also writes fits.svg with the errors of the fitted "
      "values.\n"
      "Run it while the machine is otherwise idle.\n\n"
      "Example:\n"
      "  crownfit benchmark tradeoff crown -o tradeoff");
  trade_off->add_option("CAPTURE", asked->capture, "Folder that holds capture.json, or that file.")->required();
  trade_off->add_option("-o,--output", asked->output, "Folder for table, plots and pictures; it is created if missing.")
      ->required();
  trade_off->add_option("--material", asked->options.material,
                        "material.json to render (default: the capture's truth.json if there is one, else the values\n"
                        "that the capture states).");
  trade_off
      ->add_option("--paths", asked->options.reference_paths,
                   "Paths per pixel of the reference (default 1024). Four times as many halve its noise.")
      ->check(CLI::Range(16, 100000000));
  trade_off->add_flag("--fits", asked->options.fits,
                      "Also fit with every setting. Errors are against truth.json, or else against the fit with the\n"
                      "most random walks. Takes many minutes.");
  AddCommonOptions(trade_off, asked->common);
  RunWith(trade_off, command, asked, RunTradeOff);
}

}  // namespace crownfit
