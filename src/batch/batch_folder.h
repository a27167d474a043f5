#pragma once
// The folder of a batch: who works in it, and how things get into it whole.

#include <filesystem>
#include <optional>
#include <string>

#include "batch/manifest.h"

namespace crownfit {

/// A file that one process holds, or several share; the hold goes with the process, however it ends.
class FileLock {
 public:
  /// Throws InputError when another holds it; `folder` is what the complaint names.
  FileLock(const std::filesystem::path& file, bool is_shared, const std::filesystem::path& folder);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int handle_;
};

/// Whatever is written is made in work/ and then moved to its place. Everything throws InputError when it can't.
class BatchFolder {
 public:
  /// Alone in the folder, or beside other shards.
  BatchFolder(const std::filesystem::path& root, const std::optional<Shard>& shard);
  ~BatchFolder();
  BatchFolder(const BatchFolder&) = delete;
  BatchFolder& operator=(const BatchFolder&) = delete;

  const std::filesystem::path& work() const { return work_; }  ///< with the folders crowns and stderr
  std::filesystem::path crown(const std::string& id) const { return root_ / "crowns" / id; }

  void Write(const std::filesystem::path& name, const std::string& text) const;
  /// A whole crown at once, in place of an older one.
  void Keep(const std::filesystem::path& made, const std::string& id) const;
  /// An older result is of other inputs, and goes.
  void KeepFailure(const std::string& id, const std::string& reason, const std::string& standard_error) const;
  /// Throws when a full disk may be why a crown failed: the next ones would too.
  void CheckRoom(const std::string& failure) const;

 private:
  std::filesystem::path root_, work_;
  std::optional<FileLock> lock_, shard_lock_;
};

/// Writes into a folder where others may be at work; `name` is relative to it.
void WriteIntoFolder(const std::filesystem::path& root, const std::filesystem::path& name, const std::string& text);

}  // namespace crownfit
