#include "batch/batch_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"

namespace crownfit {
namespace {

namespace fs = std::filesystem;

void Move(const fs::path& made, const fs::path& place) {
  std::error_code error;
  fs::rename(made, place, error);
  if (error) throw InputError(place, "", "can't be written: " + error.message(), "Choose a folder you may write to.");
}

}  // namespace

FileLock::FileLock(const fs::path& file, bool is_shared, const fs::path& folder) {
  handle_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (handle_ < 0)
    throw InputError(file, "", std::string("can't be written: ") + std::strerror(errno),
                     "Choose an output folder you may write to.");
  if (flock(handle_, (is_shared ? LOCK_SH : LOCK_EX) | LOCK_NB) == 0) {
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    const std::string who = std::string(host) + ", process " + std::to_string(getpid()) + "\n";
    if (ftruncate(handle_, 0) == 0) [[maybe_unused]]
      const auto ignored = write(handle_, who.data(), who.size());
    return;
  }
  close(handle_);
  std::ifstream stream(file);
  std::string who;
  std::getline(stream, who);
  throw InputError(folder, "", "another batch is running here (" + who + ")",
                   "Wait for it, stop it, or choose another folder.");
}

FileLock::~FileLock() { close(handle_); }

BatchFolder::BatchFolder(const fs::path& root, const std::optional<Shard>& shard)
    : root_(root), work_(root / "work" / (shard ? shard->Name() : "all")) {
  MakeFolder(root_);
  lock_.emplace(root_ / "batch.lock", shard.has_value(), root_);
  if (shard) {
    MakeFolder(root_ / "locks");
    shard_lock_.emplace(root_ / "locks" / shard->Name(), false, root_);
  }
  std::error_code ignored;
  fs::remove_all(shard ? work_ : root_ / "work", ignored);  // left by a batch that was killed
  MakeFolder(work_ / "crowns");
  MakeFolder(work_ / "stderr");
  MakeFolder(root_ / "crowns");
}

BatchFolder::~BatchFolder() {
  std::error_code ignored;
  fs::remove_all(work_, ignored);
  fs::remove(root_ / "work", ignored);  // fails while others use it
}

void BatchFolder::Write(const fs::path& name, const std::string& text) const {
  WriteTextFile(work_ / name.filename(), text);
  if (name.has_parent_path()) MakeFolder(root_ / name.parent_path());
  Move(work_ / name.filename(), root_ / name);
}

void BatchFolder::Keep(const fs::path& made, const std::string& id) const {
  std::error_code error;
  if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, crown(id).c_str(), RENAME_EXCHANGE) == 0) {
    fs::remove_all(made, error);
  } else {  // no older result, or the file system can't exchange
    fs::remove_all(crown(id), error);
    Move(made, crown(id));
  }
  fs::remove(root_ / "failed" / (id + ".json"), error);
}

void BatchFolder::KeepFailure(const std::string& id, const std::string& reason,
                              const std::string& standard_error) const {
  Write(fs::path("failed") / (id + ".json"),
        ToJsonText(JsonValue::Object{{"id", id}, {"reason", reason}, {"stderr", standard_error}}));
  std::error_code ignored;
  fs::remove_all(crown(id), ignored);
}

void BatchFolder::CheckRoom(const std::string& failure) const {
  constexpr uintmax_t kLeast = 16 << 20;
  std::error_code error;
  const auto space = fs::space(root_, error);
  if (!error && space.available < kLeast)
    throw InputError(root_, "", "the disk is full (" + std::to_string(space.available >> 10) + " KiB left): " + failure,
                     "Free some space and run the same command again; finished crowns stay.");
}

void WriteIntoFolder(const fs::path& root, const fs::path& name, const std::string& text) {
  const fs::path made = root / "work" / ("writing-" + std::to_string(getpid()));
  WriteTextFile(made, text);
  if (name.has_parent_path()) MakeFolder((root / name).parent_path());
  Move(made, root / name);
  std::error_code ignored;
  fs::remove(root / "work", ignored);  // fails while others use it
}

}  // namespace crownfit
