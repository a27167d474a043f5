#pragma once
// Files written beside and renamed, and digests of inputs.

#include <filesystem>
#include <functional>
#include <string>

namespace crownfit {

/// Calls `write` with a temporary name in the same folder, then renames it: nothing half-written stands under `file`.
/// Makes the folder when it is missing. Throws InputError when the place can't be written.
void WriteBesideAndRename(const std::filesystem::path& file,
                          const std::function<void(const std::filesystem::path&)>& write);

/// Makes the folder when it is missing; throws InputError when nothing can be written there. For what takes long.
void MakeFolder(const std::filesystem::path& folder);

/// The text form of the first.
void WriteTextFile(const std::filesystem::path& file, const std::string& text);

/// The bytes of a file. Throws InputError: no regular file (a folder, a pipe, a device), unreadable, or more than
/// `most_bytes`, with `remedy`.
std::string ReadWholeFile(const std::filesystem::path& file, double most_bytes, const std::string& remedy);

/// SHA-256 of a file's bytes, hexadecimal.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace crownfit
