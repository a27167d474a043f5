#include "base/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "base/json_file.h"

namespace crownfit {

Progress::Progress(ProgressMode mode)
    : style_(mode == ProgressMode::kJson                            ? Style::kJson
             : mode == ProgressMode::kAuto && isatty(STDERR_FILENO) ? Style::kBar
                                                                    : Style::kSilent) {}

Progress::~Progress() { Clear(); }

void Progress::Show(const std::string& stage, double share, const std::string& detail) {
  share = std::clamp(share, 0.0, 1.0);
  const std::string named = work_ + stage;
  if (style_ == Style::kJson) {
    std::string line = ToJsonText(JsonValue::Object{{"stage", named}, {"share", share}, {"detail", detail}});
    std::replace(line.begin(), line.end(), '\n', ' ');
    std::fprintf(stderr, "%s\n", line.c_str());
  } else if (style_ == Style::kBar) {
    constexpr int kWidth = 24;
    const int filled = static_cast<int>(share * kWidth);
    std::fprintf(stderr, "\r\033[K%-22s [%s%s] %3.0f %% %s", named.c_str(), std::string(filled, '#').c_str(),
                 std::string(kWidth - filled, ' ').c_str(), 100.0 * share, detail.c_str());
    std::fflush(stderr);
    bar_is_shown_ = true;
  }
}

void Progress::Clear() {
  if (bar_is_shown_) std::fprintf(stderr, "\r\033[K");
  bar_is_shown_ = false;
}

}  // namespace crownfit
