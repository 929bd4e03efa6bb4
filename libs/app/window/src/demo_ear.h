// A case that needs no scan: a phantom's ear, made by the 'osteo' program in a process of its own while the start page
// goes on. Private to libs/app/window; no screen of its own.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace osteo::inline app {

class DemoEar {
 public:
  /// `program`: 'osteo'; empty or not there: it cannot be made. `folder`: what is made lies in it.
  DemoEar(std::filesystem::path program, std::filesystem::path folder)
      : program_(std::move(program)), folder_(std::move(folder)) {}
  ~DemoEar() { close(); }
  DemoEar(const DemoEar&) = delete;
  DemoEar& operator=(const DemoEar&) = delete;
  /// XDG_DATA_HOME/osteotome/demo, else ~/.local/share/osteotome/demo; empty where neither is set.
  [[nodiscard]] static std::filesystem::path usual_folder();

  /// It is there, or can be made.
  [[nodiscard]] bool offered() const;
  [[nodiscard]] std::filesystem::path the_case() const { return folder_ / "case"; }
  /// Empty, or why it cannot be made. No-op while it is being made.
  std::string make();
  [[nodiscard]] bool making() const { return process_ > 0; }
  /// 0 to 1, of all of it.
  [[nodiscard]] double share() const { return share_; }
  /// Once, when it has ended: empty, or why there is none. Waits for nothing.
  [[nodiscard]] std::optional<std::string> poll();

 private:
  void close();
  void read_on();
  std::filesystem::path program_, folder_;
  pid_t process_ = -1;
  int from_ = -1;
  std::string said_;
  double share_ = 0;
};

}  // namespace osteo::inline app
