#pragma once
// Atomic writing of files, and digests of inputs.

#include <filesystem>
#include <functional>
#include <string>

namespace crownfit {

/// Calls `write` with a temporary name in the same folder, then renames it, so that `file` is never half-written.
/// Creates a missing folder. Throws InputError when the place can't be written.
void WriteBesideAndRename(const std::filesystem::path& file,
                          const std::function<void(const std::filesystem::path&)>& write);

/// Creates a missing folder; throws InputError when it can't be written to. To be called before long work.
void MakeFolder(const std::filesystem::path& folder);

/// WriteBesideAndRename for text.
void WriteTextFile(const std::filesystem::path& file, const std::string& text);

/// What to do where `file` does not exist: the remedy of Windows' paths where it has a backslash, otherwise `usual`.
std::string RemedyOfMissing(const std::filesystem::path& file, const std::string& usual = "");

/// The bytes of a file. Throws InputError when it is no regular file (a folder, a pipe, a device), unreadable, or
/// larger than `most_bytes` (with `remedy`).
std::string ReadWholeFile(const std::filesystem::path& file, double most_bytes, const std::string& remedy);

/// SHA-256 of a file's bytes, hexadecimal.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace crownfit
