#pragma once
// The folder of a batch: locks, and atomic writes.

#include <filesystem>
#include <optional>
#include <string>

#include "batch/manifest.h"

namespace crownfit {

/// A file lock, held by one process or shared by several; it ends with the process, however that ends.
class FileLock {
 public:
  /// Throws InputError, naming `folder`, when another process holds the lock.
  FileLock(const std::filesystem::path& file, bool is_shared, const std::filesystem::path& folder);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int handle_;
};

/// Everything is written in work/ and then moved to its place. All functions throw InputError on failure.
class BatchFolder {
 public:
  /// Takes the folder exclusively, or shares it with other shards.
  BatchFolder(const std::filesystem::path& root, const std::optional<Shard>& shard);
  ~BatchFolder();
  BatchFolder(const BatchFolder&) = delete;
  BatchFolder& operator=(const BatchFolder&) = delete;

  const std::filesystem::path& work() const { return work_; }  ///< contains the folders crowns and stderr
  std::filesystem::path crown(const std::string& id) const { return root_ / "crowns" / id; }

  void Write(const std::filesystem::path& name, const std::string& text) const;
  /// Moves a whole crown into place at once, replacing an older one.
  void Keep(const std::filesystem::path& made, const std::string& id) const;
  /// Also removes an older result, which belongs to other inputs.
  void KeepFailure(const std::string& id, const std::string& reason, const std::string& standard_error) const;
  /// Throws when a full disk may be why a crown failed: the next ones would fail too.
  void CheckRoom(const std::string& failure) const;

 private:
  std::filesystem::path root_, work_;
  std::optional<FileLock> lock_, shard_lock_;
};

/// Writes into a folder that other processes may be using; `name` is relative to it.
void WriteIntoFolder(const std::filesystem::path& root, const std::filesystem::path& name, const std::string& text);

}  // namespace crownfit
