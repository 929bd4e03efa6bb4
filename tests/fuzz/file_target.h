// Gives the fuzzer's bytes to a reader as a file in memory.
#pragma once
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "osteo/core/base/error.h"

template <class Read>
int fuzz_file(const std::uint8_t* data, std::size_t size, const char* suffix, Read&& read) {
  static const std::string path = "/dev/shm/osteo-fuzz-" + std::to_string(::getpid()) + suffix;
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return 0;
  std::fwrite(data, 1, size, file);
  std::fclose(file);
  try {
    read(path);
  } catch (const osteo::Error&) {
  }
  return 0;
}
