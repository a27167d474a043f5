#include "base/files.h"

#include <openssl/evp.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>

#include "base/error.h"
#include "base/text.h"

namespace crownfit {

void WriteBesideAndRename(const std::filesystem::path& file,
                          const std::function<void(const std::filesystem::path&)>& write) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) throw InputError(file, "", "is a folder", "Name a file in it.");
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  // The extension is kept because image writers choose the format by it.
  auto beside = file;
  beside.replace_filename("." + file.stem().string() + "." + std::to_string(getpid()) + ".part" +
                          file.extension().string());
  try {
    write(beside);
  } catch (...) {
    std::filesystem::remove(beside, error);
    throw;
  }
  std::filesystem::rename(beside, file, error);
  if (!error) return;
  const std::string reason = error.message();
  std::filesystem::remove(beside, error);
  throw InputError(file, "", "can't be written: " + reason, "Choose an output folder you may write to.");
}

void MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder)) error = std::make_error_code(std::errc::not_a_directory);
  if (!error && access(folder.c_str(), W_OK) != 0) error = {errno, std::generic_category()};
  if (error)
    throw InputError(folder, "", "can't be written: " + error.message(), "Choose an output folder you may write to.");
}

void WriteTextFile(const std::filesystem::path& file, const std::string& text) {
  WriteBesideAndRename(file, [&](const std::filesystem::path& beside) {
    std::ofstream stream(beside, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw InputError(file, "", "can't be written", "Choose an output folder you may write to.");
  });
}

std::string RemedyOfMissing(const std::filesystem::path& file, const std::string& usual) {
  return file.string().find('\\') == std::string::npos ? usual : "Write / between folders, not \\ as on Windows.";
}

std::string ReadWholeFile(const std::filesystem::path& file, double most_bytes, const std::string& remedy) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw InputError(file, "", "is a folder", "Name a file in it.");
  if (!std::filesystem::is_regular_file(file, ignored))
    throw InputError(file, "", "there is no such file", RemedyOfMissing(file));
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : -1;
  if (static_cast<double>(size) > most_bytes)
    throw InputError(file, "",
                     Printed("the file has %.1f MiB, more than %.1f", std::ldexp(static_cast<double>(size), -20),
                             std::ldexp(most_bytes, -20)),
                     remedy);
  std::string text(static_cast<size_t>(std::max<std::streamoff>(size, 0)), '\0');
  if (size < 0 || !stream.seekg(0).read(text.data(), size)) throw InputError(file, "", "the file can't be read");
  return text;
}

std::string Sha256OfFile(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file, "", "the file can't be read");
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  char buffer[1 << 16];
  while (stream.read(buffer, sizeof buffer) || stream.gcount() > 0)
    EVP_DigestUpdate(context.get(), buffer, static_cast<size_t>(stream.gcount()));
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  EVP_DigestFinal_ex(context.get(), digest, &size);
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    text += "0123456789abcdef"[digest[i] >> 4];
    text += "0123456789abcdef"[digest[i] & 15];
  }
  return text;
}

}  // namespace crownfit
