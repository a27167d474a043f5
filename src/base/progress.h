#pragma once
// Progress on stderr: a bar when it is a terminal, JSON lines or nothing when asked for.

#include <string>

namespace crownfit {

enum class ProgressMode { kAuto, kNone, kJson };

/// Shows how far a named stage has come. One object per command; not shared between threads.
class Progress {
 public:
  explicit Progress(ProgressMode mode);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Prefix of the following stages, such as one of several captures; empty: none.
  void NameWork(const std::string& work) { work_ = work.empty() ? "" : work + ": "; }
  /// `share` in [0, 1]; `detail` is a few words such as "chi2 1.03".
  void Show(const std::string& stage, double share, const std::string& detail = "");
  /// Removes the bar, so that other output starts on a clean line.
  void Clear();

 private:
  enum class Style { kSilent, kBar, kJson } style_;
  bool bar_is_shown_ = false;
  std::string work_;
};

}  // namespace crownfit
